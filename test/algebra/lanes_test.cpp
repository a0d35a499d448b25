// Bodies work on several states at once: a scalar of lanes whose comparisons are masks, which no `if` would accept, and
// whose lanes take different sides of every choice.  And packs, the scalar of lanes that KSL itself uses.
#ifdef __GNUC__ // packs wider than this build's registers are passed between functions of this file alone
#pragma GCC diagnostic ignored "-Wpsabi"
#endif
#include "ksl/algebra.hpp"
#include "ksl/pack.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>
#include <limits>

namespace {

constexpr int width = 6;

struct mask { bool at[width]; };

struct lanes {
  double at[width];

  lanes() = default;
  explicit lanes(double x) {
    for (double &y : at)
      y = x;
  }
  template <class F> static lanes each(F f) {
    lanes x;
    for (int k = 0; k < width; k++)
      x.at[k] = f(k);
    return x;
  }
  template <class F> static mask test(F f) {
    mask m;
    for (int k = 0; k < width; k++)
      m.at[k] = f(k);
    return m;
  }

  friend lanes operator+(lanes a, lanes b) {
    return each([&](int k) { return a.at[k] + b.at[k]; });
  }
  friend lanes operator-(lanes a, lanes b) {
    return each([&](int k) { return a.at[k] - b.at[k]; });
  }
  friend lanes operator*(lanes a, lanes b) {
    return each([&](int k) { return a.at[k] * b.at[k]; });
  }
  friend lanes operator/(lanes a, lanes b) {
    return each([&](int k) { return a.at[k] / b.at[k]; });
  }
  friend lanes operator-(lanes a) {
    return each([&](int k) { return -a.at[k]; });
  }
  friend mask operator<(lanes a, lanes b) {
    return test([&](int k) { return a.at[k] < b.at[k]; });
  }
  friend mask operator>(lanes a, lanes b) {
    return test([&](int k) { return a.at[k] > b.at[k]; });
  }
  friend mask operator<=(lanes a, lanes b) {
    return test([&](int k) { return a.at[k] <= b.at[k]; });
  }
  friend mask operator==(lanes a, lanes b) {
    return test([&](int k) { return a.at[k] == b.at[k]; });
  }
};

} // namespace

template <> struct ksl::math<lanes> {
  using one = ksl::math<double>;
  static inline const lanes epsilon{one::epsilon};
  static lanes sqrt(lanes x) {
    return lanes::each([&](int k) { return one::sqrt(x.at[k]); });
  }
  static lanes fabs(lanes x) {
    return lanes::each([&](int k) { return one::fabs(x.at[k]); });
  }
  static lanes sin(lanes x) {
    return lanes::each([&](int k) { return one::sin(x.at[k]); });
  }
  static lanes cos(lanes x) {
    return lanes::each([&](int k) { return one::cos(x.at[k]); });
  }
  static lanes atan2(lanes y, lanes x) {
    return lanes::each([&](int k) { return one::atan2(y.at[k], x.at[k]); });
  }
  // a side not chosen must be finite all the same
  static lanes select(mask m, lanes a, lanes b) {
    return lanes::each([&](int k) {
      const double chosen = m.at[k] ? a.at[k] : b.at[k], other = m.at[k] ? b.at[k] : a.at[k];
      return std::isfinite(other) ? chosen : std::numeric_limits<double>::quiet_NaN();
    });
  }
};

// every body compiles for it
template struct ksl::algebra<lanes>;

namespace {

using A = ksl::algebra<lanes>;
using B = ksl::algebra<double>;

/// An object of numbers in lane k of one of lanes.
template <class Y, class X> Y lane(const X &x, int k) {
  lanes from[sizeof(X) / sizeof(lanes)];
  double to[sizeof(X) / sizeof(lanes)];
  std::memcpy(from, &x, sizeof x);
  for (unsigned i = 0; i < sizeof(X) / sizeof(lanes); i++)
    to[i] = from[i].at[k];
  Y y;
  std::memcpy(&y, to, sizeof y);
  return y;
}

/// Twists that need different sides: zero, below and above the switch of the series, half turns about two axes, any.
ksl::screw<lanes> twists() {
  const double w[width][3] = {{0, 0, 0},    {1e-9, -2e-9, 0}, {0.02, 0.02, 0.02},
                              {M_PI, 0, 0}, {0, 1.8, -2.5},   {-0.5, 0.9, 1.1}};
  ksl::screw<lanes> s;
  lanes *const ang[] = {&s.ang.x, &s.ang.y, &s.ang.z};
  for (int j = 0; j < 3; j++)
    *ang[j] = lanes::each([&](int k) { return w[k][j]; });
  s.lin = {lanes(1), lanes(-2), lanes(3)};
  return s;
}

template <class X> bool same(const X &a, const X &b) { return std::memcmp(&a, &b, sizeof a) == 0; }

} // namespace

TEST_CASE("exp and log of a lane are those of one state") {
  const ksl::screw<lanes> s = twists();
  ksl::SE3<lanes> D;
  ksl::screw<lanes> back;
  A::SE3_exp(&s, &D);
  A::SE3_log(&D, &back);
  for (int k = 0; k < width; k++) {
    CAPTURE(k);
    const auto sk = lane<ksl::screw<double>>(s, k);
    ksl::SE3<double> Dk;
    ksl::screw<double> backk;
    B::SE3_exp(&sk, &Dk);
    B::SE3_log(&Dk, &backk);
    CHECK(same(Dk, lane<ksl::SE3<double>>(D, k)));
    CHECK(same(backk, lane<ksl::screw<double>>(back, k)));
    CHECK(std::isfinite(backk.ang.x + backk.ang.y + backk.ang.z + backk.lin.x + backk.lin.y + backk.lin.z));
  }
}

TEST_CASE("norms and inertias of a lane are those of one state") {
  ksl::screw<lanes> s = twists(), unit;
  A::screw_normalized(&s, &unit);
  ksl::inertia<lanes> M{};
  M.m = lanes::each([](int k) { return k % 2 ? 0. : 1. + k; });
  M.mt = {M.m * lanes(0.5), M.m, lanes(0)};
  ksl::spatial_inertia<lanes> S;
  A::inertia_toSpatialInertia(&M, &S);
  for (int k = 0; k < width; k++) {
    CAPTURE(k);
    const auto sk = lane<ksl::screw<double>>(s, k);
    ksl::screw<double> unitk;
    B::screw_normalized(&sk, &unitk);
    CHECK(same(unitk, lane<ksl::screw<double>>(unit, k)));
    const auto Mk = lane<ksl::inertia<double>>(M, k);
    ksl::spatial_inertia<double> Sk;
    B::inertia_toSpatialInertia(&Mk, &Sk);
    CHECK(same(Sk, lane<ksl::spatial_inertia<double>>(S, k)));
  }
}

TEST_CASE("axes of a lane are those of one state, turning, sliding or at rest") {
  ksl::screw<lanes> s = twists();
  s.lin.x = lanes::each([](int k) { return k == 0 || k == 2 ? 0. : 1e9; });
  s.lin.y = s.lin.z = lanes(0);
  ksl::vec3<lanes> direction, point;
  lanes pitch;
  const lanes magnitude = A::screw_getAxis(&s, &direction, &point, &pitch);
  for (int k = 0; k < width; k++) {
    CAPTURE(k);
    const auto sk = lane<ksl::screw<double>>(s, k);
    ksl::vec3<double> directionk, pointk;
    double pitchk;
    CHECK(B::screw_getAxis(&sk, &directionk, &pointk, &pitchk) == magnitude.at[k]);
    CHECK(same(directionk, lane<ksl::vec3<double>>(direction, k)));
    CHECK(same(pointk, lane<ksl::vec3<double>>(point, k)));
    CHECK(pitchk == pitch.at[k]);
    CHECK_FALSE(std::isnan(pitchk + magnitude.at[k]));
  }
  CHECK(std::isinf(pitch.at[1]));
  CHECK(magnitude.at[0] == 0);
}

TEST_CASE("joint spaces of a lane are those of one state, for every kind about every axis") {
  const lanes q = lanes::each([](int k) { return 0.7 * k - 2; }), pitch = lanes::each([](int k) { return 0.1 * k; });
  for (int kind = KSL_JOINT_FIXED; kind <= KSL_JOINT_FREE; kind++)
    for (int axis = 0; axis < 3; axis++) {
      CAPTURE(kind);
      CAPTURE(axis);
      ksl::joint_space<lanes> J;
      const int n = A::joint_space_set(&J, kind, axis, pitch, q);
      for (int k = 0; k < width; k++) {
        ksl::joint_space<double> Jk;
        CHECK(B::joint_space_set(&Jk, kind, axis, pitch.at[k], q.at[k]) == n);
        CHECK(same(Jk, lane<ksl::joint_space<double>>(J, k)));
      }
    }
}

TEST_CASE_TEMPLATE("comparisons of packs of any width are those of their lanes", P, ksl::pack<double, 2>,
                   ksl::pack<double, 4>, ksl::pack<double, 8>, ksl::pack<float, 4>, ksl::pack<float, 8>,
                   ksl::pack<float, 16>) {
  using T = ksl::scalar_of<P>;
  constexpr int W = sizeof(P) / sizeof(T);
  const T nan = std::numeric_limits<T>::quiet_NaN(), infinity = std::numeric_limits<T>::infinity();
  P a(T(-2)), b(T(1));
  b.set(W - 1, T(-2));
  const P chosen = ksl::math<P>::select(a >= b, P(T(1)), P(T(0)));
  for (int i = 0; i < W; ++i)
    CHECK(chosen[i] == (i == W - 1 ? 1 : 0));
  CHECK(ksl::magnitudes_at_most(a, T(2)));
  for (int i = 0; i < W; ++i) // one lane is enough
    for (T beyond : {T(2.5), T(-2.5), infinity, -infinity, nan}) {
      P x = a;
      x.set(i, beyond);
      CHECK(!ksl::magnitudes_at_most(x, T(2)));
    }
}
