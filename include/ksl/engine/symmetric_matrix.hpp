// KSL: symmetric matrices whose zeros follow from the shape of the tree.
#pragma once

#include "ksl/engine/body_lanes.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

using index = std::ptrdiff_t; ///< of rows and columns: as wide as addresses, which avoids sign extension

/// An n × n matrix, row-major.  With plain numbers, set() writes both triangles, and zeros are written too.  With packs and
/// other scalars, only the upper triangle is written, into a matrix of zeros, and mirrored at the end.
template <class T> struct symmetric_matrix {
  T *first;
  index n;

  /// row ≤ column
  KSL_LANES void set(index row, index column, const T &x) const {
    first[row * n + column] = x;
    if constexpr (is_number<T>)
      first[column * n + row] = x;
  }
  /// Writes zeros to the columns [from, end) of a row.
  KSL_LANES void clear(index row, index from, index end) const {
    if constexpr (is_number<T>)
      for (index k = from; k < end; k += native_lanes<T>)
        store_first<T>(native_pack<T>(T(0)), first + row * n + k, static_cast<int>(end - k));
  }
  void clear_all() const {
    for (index k = 0; k < n * n && !is_number<T>; ++k)
      first[k] = T(0);
  }
  void mirror() const {
    for (index i = 0; i < n && !is_number<T>; ++i)
      for (index k = 0; k < i; ++k)
        first[i * n + k] = first[k * n + i];
  }
};

} // namespace KSL_ISA
} // namespace ksl
