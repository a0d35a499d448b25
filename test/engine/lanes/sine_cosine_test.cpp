// The kernel against the C library in 80 bits, in units of the last place, one lane and all of them.
#include "ksl/engine/lanes/sine_cosine.hpp"

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
      x.set(i, k % 7 ? a : static_cast<S>(double(std::nearbyint(a)) * 1.5707963267948966));
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

TEST_CASE("large angles are reduced with as many bits of 2/π as they need") {
  // mpmath at 1300 bits; the second is of all doubles the one nearest to a multiple of π/2
  struct pair { double x, sine, cosine; };
  const pair known[] = {
      {1e16, 0.77968800660697875, -0.62616819813308618},
      {0x1.6ac5b262ca1ffp+849, 1, -4.6871659242546277e-19},
      {1e22, -0.8522008497671888, 0.52321478539513895},
      {-1e22, 0.8522008497671888, 0.52321478539513895},
      {1.7976931348623157e308, 0.0049619547891840628, -0.99998768942655994},
  };
  for (const pair &expected : known) {
    double sine, cosine;
    ksl::sine_cosine(expected.x, sine, cosine);
    CAPTURE(expected.x);
    CHECK(ulps(sine, expected.sine) < 1.5); // the numbers above are rounded, too
    CHECK(ulps(cosine, expected.cosine) < 1.5);
  }
}

TEST_CASE("a large angle or none in a lane leaves the other lanes their bits") {
  using P = ksl::native_pack<double>;
  for (double x : {1e17, 1e300, static_cast<double>(INFINITY), static_cast<double>(NAN)}) {
    P angles(0.5), sine, cosine;
    angles.set(1, x);
    ksl::sine_cosine(angles, sine, cosine);
    double one_sine, one_cosine;
    ksl::sine_cosine(0.5, one_sine, one_cosine);
    CAPTURE(x);
    CHECK(sine[0] == one_sine);
    CHECK(cosine[0] == one_cosine);
    CHECK(std::isnan(sine[1]) == !std::isfinite(x));
    CHECK(std::isnan(cosine[1]) == !std::isfinite(x));
  }
}
