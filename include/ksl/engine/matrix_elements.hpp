// KSL: elements of symmetric matrices whose zeros follow from the shape of the tree.  Plain numbers write both triangles and the
// zeros as they come by; of packs and other scalars only the upper triangle is written, into a matrix of zeros.
#pragma once

#include "ksl/engine/body_lanes.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

using index = std::ptrdiff_t; ///< of elements: as wide as addresses, which avoids sign extension

/// M[row][column] of the upper triangle; for plain numbers of the lower one, too.
template <class T> KSL_LANES void put_element(const T &x, index nv, index row, index column, T *M) {
  M[row * nv + column] = x;
  if constexpr (is_number<T>)
    M[column * nv + row] = x;
}

/// Zeros in a row of M from a column to another, where joints have no common way to the ground; of packs they are there.
template <class T> KSL_LANES void clear_elements(index nv, index row, index from, index end, T *M) {
  if constexpr (is_number<T>)
    for (index k = from; k < end; k += native_lanes<T>)
      store_first<T>(native_pack<T>(T(0)), M + row * nv + k, static_cast<int>(end - k));
}

} // namespace KSL_ISA
} // namespace ksl
