// The kernel against the C library in 80 bits, in units of the last place, one lane and all of them.
#include "ksl/engine/sine_cosine.hpp"

#include <doctest/doctest.h>

#if __has_include(<sleef.h>) && defined(KSL_TEST_SLEEF)
#include <sleef.h>
#endif

#include <cmath>
#include <random>
#include <type_traits>

namespace {

/// |result − exact| in units of the last place of S.
template <class S> double ulps(S result, long double exact) {
  int exponent;
  std::frexp(exact, &exponent);
  const int digits = std::is_same_v<S, double> ? 53 : 24;
  return static_cast<double>(std::fabs(static_cast<long double>(result) - exact) / std::ldexp(1.0L, exponent - digits));
}

/// Worst error over angles of a magnitude; every seventh lies next to a multiple of π/2.
template <class S> double worst(double magnitude) {
  using P = ksl::native_pack<S>;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<S> angle(static_cast<S>(-magnitude), static_cast<S>(magnitude));
  double error = 0;
  for (int k = 0; k < 20000; ++k) {
    P x, sine, cosine;
    for (int i = 0; i < ksl::native_lanes<S>; ++i) {
      const S a = angle(random);
      x.set(i, k % 7 ? a : static_cast<S>(std::nearbyint(a) * 1.5707963267948966));
    }
    ksl::sine_cosine(x, sine, cosine);
    for (int i = 0; i < ksl::native_lanes<S>; ++i) {
      S one_sine, one_cosine;
      ksl::sine_cosine(x[i], one_sine, one_cosine);
      CHECK(one_sine == sine[i]); // the bits of one lane are those of all
      CHECK(one_cosine == cosine[i]);
      if (x[i] != 0)
        error = std::max(error, ulps(sine[i], std::sin(static_cast<long double>(x[i]))));
      error = std::max(error, ulps(cosine[i], std::cos(static_cast<long double>(x[i]))));
    }
  }
  return error;
}

} // namespace

TEST_CASE("sine and cosine err by less than one unit in the last place up to a million") {
  for (double magnitude : {1e-3, 0.8, 3.0, 100.0, 1e6}) {
    CAPTURE(magnitude);
    CHECK(worst<double>(magnitude) < 1);
    CHECK(worst<float>(magnitude) < 1);
  }
}

#if defined(SLEEF_VERSION_MAJOR)
TEST_CASE("SLEEF, which errs by one unit in the last place at most, is two away at most") {
  std::mt19937_64 random(5);
  for (double magnitude : {1e-3, 1.0, 100.0, 1e6}) {
    std::uniform_real_distribution<double> angle(-magnitude, magnitude);
    for (int k = 0; k < 20000; ++k) {
      const double x = angle(random);
      double sine, cosine;
      ksl::sine_cosine(x, sine, cosine);
      CAPTURE(x);
      REQUIRE(ulps<double>(sine, Sleef_sin_u10(x)) <= 2);
      REQUIRE(ulps<double>(cosine, Sleef_cos_u10(x)) <= 2);
      float sine_float, cosine_float;
      ksl::sine_cosine(static_cast<float>(x), sine_float, cosine_float);
      REQUIRE(ulps<float>(sine_float, Sleef_sinf_u10(static_cast<float>(x))) <= 2);
      REQUIRE(ulps<float>(cosine_float, Sleef_cosf_u10(static_cast<float>(x))) <= 2);
    }
  }
}
#endif

TEST_CASE("what can't be reduced is NaN, not a number of its own making") {
  for (double x : {1e17, 1e300, static_cast<double>(INFINITY), static_cast<double>(NAN)}) {
    double sine, cosine;
    ksl::sine_cosine(x, sine, cosine);
    CAPTURE(x);
    CHECK(std::isnan(sine));
    CHECK(std::isnan(cosine));
  }
  double sine, cosine;
  ksl::sine_cosine(1e12, sine, cosine);
  CHECK(std::fabs(sine * sine + cosine * cosine - 1) < 1e-15);
}
