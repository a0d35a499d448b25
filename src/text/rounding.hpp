// The rounding mode of calls.  Sine and cosine of large angles, and what decides between branches by a rounding error, hold for numbers
// that are rounded to nearest, with subnormal numbers kept.  A thread of a program may have another mode (fesetround, or a library that
// was built with -ffast-math).  A call then computes in the mode of the algorithms, and leaves the thread in its own.
#pragma once

#if defined(__x86_64__)
#include <xmmintrin.h>
#elif !defined(__aarch64__)
#include <cfenv>
#endif

namespace ksl {

/// While it lives, its thread rounds to nearest.  Reading the mode takes about a nanosecond; it is set where it differs only.  Flags of
/// floating-point exceptions are kept as the call leaves them.
class nearest_rounding {
public:
  nearest_rounding() : before_(mode()) {
    if (before_ != nearest) [[unlikely]]
      set(nearest);
  }
  ~nearest_rounding() {
    if (before_ != nearest) [[unlikely]]
      set(before_);
  }
  /// Is this the mode of the thread anyway?
  static bool is_set() { return mode() == nearest; }
  nearest_rounding(const nearest_rounding &) = delete;
  nearest_rounding &operator=(const nearest_rounding &) = delete;

private:
#if defined(__x86_64__)
  using word = unsigned;
  /// of MXCSR: flush to zero, rounding control, subnormal inputs are zero
  /// bit 15 flush to zero, 14 and 13 rounding control (0: to nearest), 6 denormals are zero (Intel SDM, volume 1, 10.2.3)
  static constexpr word nearest = 0, bits = 0xE040;
  static word mode() { return _mm_getcsr() & bits; }
  static void set(word to) { _mm_setcsr((_mm_getcsr() & ~bits) | to); }
#elif defined(__aarch64__)
  using word = unsigned long;
  /// bit 24 flush to zero, 23 and 22 rounding mode (0: to nearest)
  static constexpr word nearest = 0, bits = 0x1C00000; ///< of FPCR: flush to zero, rounding mode
  static word mode() { return control() & bits; }
  static word control() {
    word now;
    asm volatile("mrs %0, fpcr" : "=r"(now));
    return now;
  }
  static void set(word to) { asm volatile("msr fpcr, %0" : : "r"((control() & ~bits) | to)); }
#else
  using word = int;
  static constexpr word nearest = FE_TONEAREST;
  static word mode() { return std::fegetround(); }
  static void set(word to) { std::fesetround(to); }
#endif

  word before_;
};

} // namespace ksl
