// Positions as a manifold: identities of ⊕ and ⊖ for every kind of joint, and their Jacobians against dual numbers.
#include "states.hpp"
#include "robot_files.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace {

using robots::numbers, robots::random_numbers;

constexpr double pi = 3.14159265358979323846;

const ksl::model &robot() {
  static const ksl::model m = ksl::load(every_kind_file);
  return m;
}

numbers<double> random_position(const ksl::model &m, std::mt19937 &random) { return robots::random_state(m, random).q; }

template <class T> numbers<T> integrated(const ksl::model &m, const numbers<T> &q, const numbers<T> &dv) {
  return robots::results<algorithms::integrate>(m, robots::state_over<T>{.q = q, .v = dv});
}

template <class T> numbers<T> differed(const ksl::model &m, const numbers<T> &q0, const numbers<T> &q1) {
  return robots::results<algorithms::difference>(m, robots::state_over<T>{.q = q0, .q1 = q1});
}

/// The largest difference; infinite where one is not a number.
double distance(const numbers<double> &x, const numbers<double> &y) {
  double most = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    most = std::isfinite(x[i] - y[i]) ? std::max(most, std::fabs(x[i] - y[i])) : HUGE_VAL;
  return most;
}
double largest(const numbers<double> &x) { return distance(x, numbers<double>(x.size())); }

/// Rotations of joint velocities are scaled to this angle.
void set_angles(const ksl::model &m, numbers<double> &dv, double angle) {
  for (int i = 1; i < m.view().bodies; ++i) {
    const ksl::body<double> &b = m.view().body[i];
    double *const x = &dv[static_cast<std::size_t>(b.v_index + std::max(0, b.nv - 3))];
    if (ksl::row_of(b.described).quaternion >= 0) {
      const double length = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
      for (int k = 0; k < 3; ++k)
        x[k] *= angle / length;
    } else if (b.described == ksl::joint_kind::continuous) {
      *x = std::copysign(angle, *x);
    } else if (b.described == ksl::joint_kind::planar) {
      x[2] = std::copysign(angle, x[2]);
    }
  }
}

/// The derivative of f(x, y) by the step along x (which: 0) or y (1), both nv × nv matrices one after the other.
template <class F> numbers<double> by_steps(const ksl::model &m, F f) {
  const std::size_t nv = static_cast<std::size_t>(m.nv());
  numbers<double> J(2 * nv * nv);
  for (std::size_t which = 0; which < 2; ++which)
    for (std::size_t k = 0; k < nv; ++k) {
      numbers<robots::first> still(nv, robots::first(0)), step = still;
      step[k] = robots::first::variable(0, 0);
      const numbers<robots::first> column = which ? f(still, step) : f(step, still);
      for (std::size_t r = 0; r < nv; ++r)
        J[(which * nv + r) * nv + k] = column[r].derivative[0];
    }
  return J;
}

constexpr double angles[] = {1e-12, 1e-5, 0.3, 2, 3.1, 3.14159, pi - 1e-9};

} // namespace

TEST_CASE("manifold: a difference leads from the one position to the other") {
  const ksl::model &m = robot();
  std::mt19937 random(1);
  for (const double angle : angles)
    for (int round = 0; round < 20; ++round) {
      CAPTURE(angle);
      const numbers<double> q0 = random_position(m, random);
      numbers<double> dv = random_numbers(m.nv(), random);
      set_angles(m, dv, angle);
      const numbers<double> q1 = integrated(m, q0, dv), found = differed(m, q0, q1);
      // the rotation vector of a given quaternion is ill-conditioned near half a turn only in its sign
      CHECK(distance(found, dv) < 1e-12 * (1 + largest(dv)));
      CHECK(largest(differed(m, q1, integrated(m, q0, found))) < 1e-12 * (1 + largest(dv)));
    }
}

TEST_CASE("manifold: only continuous joints are wrapped") {
  const ksl::model m(robots::double_pendulum(1, 1, 1, 1)); // a continuous joint and a revolute one
  for (const double turn : {3.0, 3.5, -3.5, 6.0, 100.0, -1e5}) {
    const numbers<double> dv = differed(m, numbers<double>{0.25, 0.25}, numbers<double>{0.25 + turn, 0.25 + turn});
    CHECK(std::fabs(dv[0] - std::remainder(turn, 2 * pi)) < 1e-10); // turns are exact up to 1e5 u
    CHECK(dv[1] == turn);
  }
}

TEST_CASE("manifold: interpolation begins and ends at the positions, and moves steadily") {
  const ksl::model &m = robot();
  std::mt19937 random(2);
  for (int round = 0; round < 20; ++round) {
    const numbers<double> q0 = random_position(m, random), q1 = random_position(m, random), dv = differed(m, q0, q1);
    for (const double fraction : {0.0, 0.25, 0.5, 1.0, 1.25}) {
      const robots::state s = {.q = q0, .q1 = q1, .fraction = fraction};
      numbers<double> covered = dv;
      for (double &x : covered)
        x *= fraction;
      CHECK(largest(differed(m, integrated(m, q0, covered), robots::results<algorithms::interpolate>(m, s))) < 1e-12);
    }
  }
}

TEST_CASE("manifold: Jacobians are those of dual numbers") {
  const ksl::model &m = robot();
  using dual = numbers<robots::first>;
  std::mt19937 random(3);
  for (const double angle : angles)
    for (int round = 0; round < 5; ++round) {
      CAPTURE(angle);
      const numbers<double> q0 = random_position(m, random);
      numbers<double> dv = random_numbers(m.nv(), random);
      set_angles(m, dv, angle);
      const numbers<double> q1 = integrated(m, q0, dv);
      const double scale = 1 + largest(dv) * largest(dv);
      const dual from(q0.begin(), q0.end()), to(q1.begin(), q1.end());
      const numbers<double> moved = by_steps(m, [&](const dual &x, dual y) {
        for (std::size_t k = 0; k < dv.size(); ++k)
          y[k] = y[k] + dv[k];
        return differed(m, to, integrated(m, integrated(m, from, x), y));
      });
      CHECK(distance(robots::results<algorithms::integrate_jacobians>(m, robots::state{.q = q0, .v = dv}), moved) <
            1e-12 * scale);
      const numbers<double> differing = by_steps(
          m, [&](const dual &x, const dual &y) { return differed(m, integrated(m, from, x), integrated(m, to, y)); });
      CHECK(distance(robots::results<algorithms::difference_jacobians>(m, robots::state{.q = q0, .q1 = q1}),
                     differing) < 1e-12 * scale);
    }
}
