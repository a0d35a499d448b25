// Positions as a manifold: identities of ⊕ and ⊖ for every kind of joint, and their Jacobians against dual numbers.
#include "robots.hpp"

#include "ksl/dual.hpp"
#include "ksl/engine/algorithms/manifold/manifold.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace {

template <class T> using numbers = std::vector<T>;
using dual = ksl::dual<1>;

constexpr double pi = 3.14159265358979323846;

const ksl::model &robot() {
  static const ksl::model m = ksl::load(KSL_EVERY_KIND);
  return m;
}

numbers<double> random_numbers(int n, double scale, std::mt19937 &random) {
  std::normal_distribution<double> normal(0, scale);
  numbers<double> x(static_cast<std::size_t>(n));
  for (double &y : x)
    y = normal(random);
  return x;
}

numbers<double> random_position(const ksl::model &m, std::mt19937 &random) {
  numbers<double> q = random_numbers(m.nq(), 1, random);
  robots::normalize_quaternions(m, q.data());
  return q;
}

template <class T> numbers<T> constants(const numbers<double> &x) { return numbers<T>(x.begin(), x.end()); }

template <class T> numbers<T> integrated(const ksl::model &m, const numbers<T> &q, const numbers<T> &dv) {
  numbers<T> out(q.size());
  ksl::integrate<T>(m.view(), {}, q.data(), dv.data(), out.data());
  return out;
}

template <class T> numbers<T> differed(const ksl::model &m, const numbers<T> &q0, const numbers<T> &q1) {
  numbers<T> dv(static_cast<std::size_t>(m.nv()));
  ksl::difference<T>(m.view(), {}, q0.data(), q1.data(), dv.data());
  return dv;
}

double largest(const numbers<double> &x) {
  double most = 0;
  for (const double y : x)
    most = std::max(most, std::fabs(y));
  return most;
}

double distance(const numbers<double> &x, const numbers<double> &y) {
  double most = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    most = std::max(most, std::fabs(x[i] - y[i]));
  return most;
}

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

/// Both matrices of a function of the manifold, column after column.
struct matrices { numbers<double> one, other; };

/// Column k of the two matrices by dual numbers: along q ⊕ s e_k of the first position, and along the other argument.
matrices integrate_by_duals(const ksl::model &m, const numbers<double> &q, const numbers<double> &dv) {
  const std::size_t nv = dv.size();
  matrices J = {numbers<double>(nv * nv), numbers<double>(nv * nv)};
  const numbers<dual> there = constants<dual>(integrated(m, q, dv));
  for (std::size_t k = 0; k < nv; ++k) {
    numbers<dual> step(nv, dual(0)), moving = constants<dual>(dv);
    step[k] = dual::variable(0, 0);
    moving[k].derivative[0] = 1;
    const numbers<dual> by_q =
        differed(m, there, integrated(m, integrated(m, constants<dual>(q), step), constants<dual>(dv)));
    const numbers<dual> by_dv = differed(m, there, integrated(m, constants<dual>(q), moving));
    for (std::size_t r = 0; r < nv; ++r)
      J.one[r * nv + k] = by_q[r].derivative[0], J.other[r * nv + k] = by_dv[r].derivative[0];
  }
  return J;
}

matrices difference_by_duals(const ksl::model &m, const numbers<double> &q0, const numbers<double> &q1) {
  const std::size_t nv = static_cast<std::size_t>(m.nv());
  matrices J = {numbers<double>(nv * nv), numbers<double>(nv * nv)};
  for (std::size_t k = 0; k < nv; ++k) {
    numbers<dual> step(nv, dual(0));
    step[k] = dual::variable(0, 0);
    const numbers<dual> by_q0 = differed(m, integrated(m, constants<dual>(q0), step), constants<dual>(q1));
    const numbers<dual> by_q1 = differed(m, constants<dual>(q0), integrated(m, constants<dual>(q1), step));
    for (std::size_t r = 0; r < nv; ++r)
      J.one[r * nv + k] = by_q0[r].derivative[0], J.other[r * nv + k] = by_q1[r].derivative[0];
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
      numbers<double> dv = random_numbers(m.nv(), 1, random);
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
      numbers<double> q(q0.size()), covered = dv;
      ksl::interpolate<double>(m.view(), {}, q0.data(), q1.data(), &fraction, q.data());
      for (double &x : covered)
        x *= fraction;
      CHECK(largest(differed(m, integrated(m, q0, covered), q)) < 1e-12);
    }
  }
}

TEST_CASE("manifold: Jacobians are those of dual numbers") {
  const ksl::model &m = robot();
  const std::size_t nv = static_cast<std::size_t>(m.nv());
  std::mt19937 random(3);
  for (const double angle : angles)
    for (int round = 0; round < 5; ++round) {
      CAPTURE(angle);
      const numbers<double> q0 = random_position(m, random);
      numbers<double> dv = random_numbers(m.nv(), 1, random), one(nv * nv), other(nv * nv);
      set_angles(m, dv, angle);
      const numbers<double> q1 = integrated(m, q0, dv);
      const double scale = 1 + largest(dv) * largest(dv);
      const matrices moved = integrate_by_duals(m, q0, dv), differing = difference_by_duals(m, q0, q1);
      ksl::integrate_jacobians<double>(m.view(), {}, q0.data(), dv.data(), one.data(), other.data());
      CHECK(distance(one, moved.one) < 1e-12 * scale);
      CHECK(distance(other, moved.other) < 1e-12 * scale);
      ksl::difference_jacobians<double>(m.view(), {}, q0.data(), q1.data(), one.data(), other.data());
      CHECK(distance(one, differing.one) < 1e-12 * scale);
      CHECK(distance(other, differing.other) < 1e-12 * scale);
    }
}

TEST_CASE("manifold: Jacobians are the slopes of differences") {
  const ksl::model &m = robot();
  const std::size_t nv = static_cast<std::size_t>(m.nv());
  std::mt19937 random(4);
  const numbers<double> q0 = random_position(m, random), q1 = random_position(m, random);
  numbers<double> by_q0(nv * nv), by_q1(nv * nv);
  ksl::difference_jacobians<double>(m.view(), {}, q0.data(), q1.data(), by_q0.data(), by_q1.data());
  const double step = 1e-6;
  for (std::size_t k = 0; k < nv; ++k) {
    numbers<double> forwards(nv), backwards(nv);
    forwards[k] = step, backwards[k] = -step;
    const numbers<double> a = differed(m, q0, integrated(m, q1, forwards)),
                          b = differed(m, q0, integrated(m, q1, backwards));
    const numbers<double> c = differed(m, integrated(m, q0, forwards), q1),
                          d = differed(m, integrated(m, q0, backwards), q1);
    for (std::size_t r = 0; r < nv; ++r) {
      CHECK(std::fabs((a[r] - b[r]) / (2 * step) - by_q1[r * nv + k]) < 1e-8);
      CHECK(std::fabs((c[r] - d[r]) / (2 * step) - by_q0[r * nv + k]) < 1e-8);
    }
  }
}
