// KSL: symmetric matrices whose zeros follow from the shape of the tree.
#pragma once

#include "ksl/engine/lanes/body_lanes.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

using index = std::ptrdiff_t; ///< of rows and columns: as wide as addresses, which avoids sign extension

/// An n × n matrix, row-major.  set() writes both triangles.  With plain numbers clear() writes the zeros between; with packs and other
/// scalars clear_all() writes them first.
template <class T> struct symmetric_matrix {
  T *first;
  index n;

  /// Sets an element, row ≤ column.  The second argument is its place in tree_rows, which is not needed here.
  KSL_LANES void set(index row, index, index column, const T &x) const {
    first[row * n + column] = x;
    first[column * n + row] = x;
  }
  /// Writes zeros to the columns [from, end) of a row.
  template <bool always = false> KSL_LANES void clear(index row, index from, index end) const {
    if constexpr (is_number<T>)
      for (index k = from; k < end; k += native_lanes<T>)
        store_first<T>(native_pack<T>(T(0)), first + row * n + k, static_cast<int>(end - k));
    else if constexpr (always)
      for (index k = from; k < end; ++k)
        first[row * n + k] = T(0);
  }
  void clear_all() const {
    for (index k = 0; k < n * n && !is_number<T>; ++k)
      first[k] = T(0);
  }
};

/// The upper triangle of an n × n matrix, row-major.  Elements below it are left as they are.
template <class T> struct upper_triangle {
  T *first;
  index n;

  KSL_LANES void set(index row, index, index column, const T &x) const { first[row * n + column] = x; }
  KSL_LANES void clear(index, index, index) const {}
  void clear_all() const {
    for (index row = 0; row < n; ++row)
      symmetric_matrix<T>{first, n}.template clear<true>(row, row, n);
  }
};

} // namespace KSL_ISA
} // namespace ksl
