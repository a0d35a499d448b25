// KSL: large angles reduced by multiples of π/2, exactly (Payne and Hanek 1983).
//
// An angle is an integer m times a power of two, and only m 2ᵉ 2/π mod 4 is needed.  The leading bits of 2/π, up to a position
// that depends on e, contribute multiples of 4 and are left out.  The next 192 bits are enough: no double is closer to a
// multiple of π/2 than 2⁻⁶¹, and even then 75 bits are left.  Only integer arithmetic is used, so that every compiler and
// processor gives the same bits.
#pragma once

#include "ksl/isa.hpp"

#include <cstdint>

namespace ksl {

/// x = quarters · π/2 + numerator · unit, up to a multiple of 2π.
struct reduced_large_angle {
  int quarters;           ///< −4 … 4
  std::int64_t numerator; ///< 2⁶¹ … 2⁶³, with the sign of the remainder
  double unit;            ///< a power of two
};

inline namespace KSL_ISA {

namespace large_angle {

/// 64 zero bits followed by the bits of 2/π: as many as the largest double needs.
inline constexpr std::uint64_t two_over_pi[20] = {
    0x0000000000000000, 0xa2f9836e4e441529, 0xfc2757d1f534ddc0, 0xdb6295993c439041, 0xfe5163abdebbc561,
    0xb7246e3a424dd2e0, 0x06492eea09d1921c, 0xfe1deb1cb129a73e, 0xe88235f52ebb4484, 0xe99c7026b45f7e41,
    0x3991d639835339f4, 0x9c845f8bbdf9283b, 0x1ff897ffde05980f, 0xef2f118b5a0a6d1f, 0x6d367ecf27cb09b7,
    0x4f463f669e5fea2d, 0x7527bac7ebe5f17b, 0x3d0739f78a5292ea, 0x6bfb5fb11f8d5d08, 0x56033046fc7b6bab};
inline constexpr std::uint64_t quarter_pi = 0x6487ed5110b4611a; ///< π/4, times 2⁶³

/// The upper 64 bits of a product.
inline std::uint64_t upper_product(std::uint64_t a, std::uint64_t b) {
  constexpr std::uint64_t half = 0xffffffff;
  const std::uint64_t a0 = a & half, a1 = a >> 32, b0 = b & half, b1 = b >> 32;
  const std::uint64_t middle = a1 * b0 + (a0 * b0 >> 32), other = a0 * b1 + (middle & half);
  return a1 * b1 + (middle >> 32) + (other >> 32);
}

/// A fraction of 128 bits: upper 2⁻⁶⁴ + lower 2⁻¹²⁸.
struct fraction { std::uint64_t upper, lower; };

inline fraction shifted_left(const fraction &f, int n) { // 0 < n < 64
  return {f.upper << n | f.lower >> (64 - n), f.lower << n};
}

/// The fractional part of m 2ᵉ / 2π.  e ≥ −62, since the table has 64 zeros before the first bit of 2/π.
inline fraction turns(std::uint64_t m, int e) {
  const int begin = e - 2 + 64, shift = begin % 64; // of the bits of 2/π
  const std::uint64_t *const word = two_over_pi + begin / 64;
  std::uint64_t w[3];
  for (int i = 0; i < 3; ++i)
    w[i] = shift ? word[i] << shift | word[i + 1] >> (64 - shift) : word[i];
  const std::uint64_t low = m * w[1], sum = low + upper_product(m, w[2]), carry = sum < low;
  return {m * w[0] + upper_product(m, w[1]) + carry, sum};
}

} // namespace large_angle

/// Reduces a finite x, |x| ≥ 2¹⁸.  |numerator × unit| is at most π/4, with a relative error below 2⁻⁶⁰: no double is so close to
/// a multiple of π/2 that fewer than 64 of the 128 bits are left.
inline reduced_large_angle reduce_large(double x) {
  using namespace large_angle;
  std::uint64_t bits;
  __builtin_memcpy(&bits, &x, sizeof bits);
  constexpr std::uint64_t leading = std::uint64_t(1) << 52;
  const fraction turn = turns((bits & (leading - 1)) | leading, static_cast<int>(bits >> 52 & 0x7ff) - 1075);
  fraction f = shifted_left(turn, 2); // of a quarter turn
  int quarters = static_cast<int>(turn.upper >> 62);
  std::int64_t sign = bits >> 63 ? -1 : 1;
  if (sign < 0)
    quarters = -quarters;
  if (f.upper >> 63) { // more than half a quarter: round up, the remainder is negative
    quarters += static_cast<int>(sign);
    f = {~f.upper + (f.lower == 0), ~f.lower + 1};
    sign = -sign;
  }
  const int zeros = __builtin_clzll(f.upper); // at least one, since f < 1/2
  const std::uint64_t numerator = upper_product(shifted_left(f, zeros).upper, quarter_pi);
  const std::uint64_t exponent = static_cast<std::uint64_t>(1023 - 62 - zeros) << 52;
  reduced_large_angle out = {quarters, sign * static_cast<std::int64_t>(numerator), 0};
  __builtin_memcpy(&out.unit, &exponent, sizeof exponent);
  return out;
}

} // namespace KSL_ISA
} // namespace ksl
