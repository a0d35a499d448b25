// KSL: rows of matrices.
#pragma once

#include "ksl/engine/body_lanes.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

using index = std::ptrdiff_t; ///< of rows and columns: as wide as addresses, which avoids sign extension

/// Writes n zeros.
template <class T> KSL_LANES void clear_numbers(T *to, index n) {
  if constexpr (is_number<T>)
    for (index k = 0; k < n; k += native_lanes<T>)
      store_first<T>(native_pack<T>(T(0)), to + k, static_cast<int>(n - k < native_lanes<T> ? n - k : native_lanes<T>));
  else
    for (index k = 0; k < n; ++k)
      to[k] = T(0);
}

} // namespace KSL_ISA
} // namespace ksl
