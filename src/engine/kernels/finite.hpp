// Checks whether all numbers of an array are finite, a register at a time.
#pragma once

#include "ksl/pack.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

/// True if no number is NaN or infinite.  x · 0 is NaN for NaN and ∞ and zero for all others, so the sum of all products is
/// zero only if every number is finite.
template <class S> bool finite(const S *x, std::size_t n) {
  using P = native_pack<S>;
  constexpr std::size_t lanes = native_lanes<S>;
  const P zero(S(0));
  P sum[4] = {zero, zero, zero, zero}; // four independent sums hide the latency of an addition
  for (; n >= 4 * lanes; n -= 4 * lanes, x += 4 * lanes)
    for (std::size_t k = 0; k < 4; ++k) {
      P numbers;
      __builtin_memcpy(&numbers, x + k * lanes, sizeof numbers);
      sum[k] = sum[k] + numbers * zero;
    }
  for (; n > 0; n -= n < lanes ? n : lanes, x += lanes)
    sum[0] = sum[0] + load_first(x, static_cast<int>(n < lanes ? n : lanes)) * zero;
  const P all = (sum[0] + sum[1]) + (sum[2] + sum[3]);
  bool found = true;
  for (int lane = 0; lane < native_lanes<S>; ++lane)
    found &= all[lane] == 0;
  return found;
}

} // namespace KSL_ISA
} // namespace ksl
