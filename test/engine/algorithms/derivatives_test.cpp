// Analytic derivatives against dual numbers through the very algorithms that they are the derivatives of, with every kind of joint,
// on random trees.  Second derivatives against dual numbers of dual numbers.
#include "states.hpp"
#include "robot_files.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace {

using namespace robots;
using twice = ksl::second_order_dual<1>;

/// A step for states of a robot with every kind of joint.
template <class Step> void for_every_kind(unsigned seed, int states, Step step) {
  std::mt19937 random(seed);
  const ksl::model m = ksl::load(every_kind_file);
  for (int turn = 0; turn < states; ++turn) {
    CAPTURE(turn);
    step(m, random_state(m, random), turn);
  }
}

/// A step for a state of each of some random trees; every other one has the physics of joints.  These are small, so that they take less than a
/// second, and mutants meet them (test/mutate/driver.cpp).
template <class Step> void for_trees(unsigned seed, int trees, int most_bodies, Step step) {
  std::mt19937 random(seed);
  for (int turn = 0; turn < trees; ++turn) {
    CAPTURE(turn);
    const joints_are joints = turn % 2 ? joints_are::physical : joints_are::plain;
    const ksl::model m = random_tree(2 + turn % (most_bodies - 1), random, joints);
    if (m.nv() > 0)
      step(m, random_state(m, random), turn);
  }
}

/// All links, the last first; other axes, points, parts, orders and kinds for every turn.
request asked_of(const ksl::model &m, int turn) {
  using ksl::wrench_frame;
  constexpr wrench_frame frames[3] = {wrench_frame::joint, wrench_frame::world, wrench_frame::link};
  const int links = m.view().links;
  request asked = of_links(m);
  ksl::reaction_request &r = asked.reactions;
  r.at = frames[turn % 3], r.axes = frames[turn / 3 % 3];
  r.at_link = (7 * turn + 1) % links, r.axes_link = (5 * turn + 2) % links;
  r.part = static_cast<ksl::wrench_part>(turn % 2 ? turn / 2 % 4 : 0);
  r.on = turn % 5 == 3 ? ksl::wrench_side::parent : ksl::wrench_side::child;
  r.angular_first = turn % 7 == 4;
  ksl::frame_options &how = asked.frame;
  how.axes = static_cast<ksl::expressed_in>(turn % 2);
  how.at = static_cast<ksl::expressed_in>(turn / 2 % 2);
  how.kind = static_cast<ksl::acceleration_kind>(turn % 3);
  how.angular_first = turn % 5 == 2;
  for (double *const offset : {r.offset, how.offset})
    if (turn % 4 != 2)
      offset[0] = 0.3, offset[1] = -0.2, offset[2] = 0.7;
  return asked;
}

/// Of both energies by q and by v: of the potential one by v nothing.
void check_energy(const ksl::model &m, const state &s) {
  const numbers<double> found = results<algorithms::energy_derivatives>(m, s);
  const std::size_t nv = s.v.size();
  numbers<double> expected(3 * nv);
  for (std::size_t k = 0; k < nv; ++k) {
    const numbers<double> by_q = derivatives_by<algorithms::energy>(0, k, m, s, {}),
                          by_v = derivatives_by<algorithms::energy>(1, k, m, s, {});
    expected[k] = by_q[0], expected[nv + k] = by_v[0], expected[2 * nv + k] = by_q[1];
    CHECK(by_v[1] == 0);
  }
  CHECK(difference(found, expected) <= 1e-13);
}

/// The gradients are derivatives of the weighted sum; and those of the gradients, by dual numbers, are symmetric: by v and a of each other.
void check_gradient(const ksl::model &m, state s) {
  s.push.clear(); // none are given
  const std::size_t n = s.v.size();
  const numbers<double> found = results<algorithms::inverse_dynamics_gradient>(m, s); // the weights are tau
  numbers<double> expected(3 * n), by_v(n * n), by_a(2 * n * n);
  for (int by = 0; by < 3; ++by)
    for (std::size_t k = 0; k < n; ++k) {
      const state rates = by == 0 ? state{.q = unit(n, k)} : by == 1 ? state{.v = unit(n, k)} : state{.a = unit(n, k)};
      const state_over<first> d = moving(m, s, rates);
      const numbers<first> tau = results<algorithms::inverse_dynamics>(m, d);
      for (std::size_t i = 0; i < n; ++i)
        expected[static_cast<std::size_t>(by) * n + k] += s.tau[i] * tau[i].derivative[0];
      const numbers<double> gradients = derivatives(results<algorithms::inverse_dynamics_gradient>(m, d));
      if (by == 1)
        std::copy_n(gradients.begin() + m.nv(), n, by_v.begin() + static_cast<std::ptrdiff_t>(k * n));
      if (by == 2) // efforts have no products of v and a, nor of two a
        std::copy_n(gradients.begin() + m.nv(), 2 * n, by_a.begin() + static_cast<std::ptrdiff_t>(2 * k * n));
    }
  CHECK(difference(found, expected) <= 1e-13);
  CHECK(difference(by_v, matrices::transposed(by_v, n)) <= 1e-13);
  CHECK(difference(by_a, numbers<double>(2 * n * n)) <= 1e-13);
}

/// By the wrench on each link, with the dual part in one of its components after the other.
void check_reactions_by_external(const ksl::model &m, state s, const request &asked) {
  const numbers<double> found = results<algorithms::reactions_external_derivatives>(m, s, asked);
  const std::size_t columns = 6 * static_cast<std::size_t>(m.view().links), rows = found.size() / columns;
  s.push.assign(columns, 0.5), s.pushed = of_links(m).links, s.axes = ksl::expressed_in::frame;
  std::reverse(s.pushed.begin(), s.pushed.end());
  numbers<double> expected(found.size());
  for (std::size_t c = 0; c < columns; ++c) {
    const state_over<first> d = moving(m, s, {.push = unit(columns, c)});
    const numbers<double> column =
        derivatives(results<algorithms::inverse_dynamics_with_reactions>(m, d, asked)); // efforts come first
    for (std::size_t r = 0; r < rows; ++r)
      expected[r * columns + c] = column[column.size() - rows + r];
  }
  CHECK(difference(found, expected) <= 1e-13);
}

/// Kinds of variables: q, v, and a or tau.
enum kind : int { of_q, of_v, of_last };

state rates_of(kind by, const numbers<double> &e) {
  return by == of_q ? state{.q = e} : by == of_v ? state{.v = e} : state{.a = e, .tau = e};
}

/// Part `which` of the second derivatives: by coordinate l of `later` of what the derivative by coordinate k of `by` is.  Every third l is looked
/// at, another one for each k.
template <class Algorithm>
void check_second(const ksl::model &m, const state &s, const numbers<double> &found, std::size_t which, kind by,
                  kind later, double tolerance) {
  const std::size_t nv = s.v.size();
  const numbers<double> D = part(found, which, 4);
  numbers<double> expected = D;
  for (std::size_t k = 0; k < nv; ++k)
    for (std::size_t l = (k + nv) % 3; l < nv; l += 3) {
      const auto one = moved(m, s, rates_of(later, unit(nv, l)), twice(first::variable(0, 0)));
      const auto both = moved(m, one, rates_of(by, unit(nv, k)), twice::variable(0.0, 0));
      const numbers<twice> x = results<Algorithm>(m, both);
      for (std::size_t i = 0; i < nv; ++i)
        expected[(i * nv + k) * nv + l] = x[i].derivative[0].derivative[0];
    }
  CHECK(difference(D, expected) <= tolerance);
}

void check_inverse_twice(const ksl::model &m, const state &s, int) {
  const numbers<double> D = results<algorithms::inverse_dynamics_second_derivatives>(m, s);
  const auto check = [&](std::size_t which, kind by, kind later) {
    check_second<algorithms::inverse_dynamics>(m, s, D, which, by, later, 1e-13);
  };
  check(0, of_q, of_q), check(1, of_v, of_v), check(2, of_q, of_v), check(3, of_last, of_q);
}

void check_forward_twice(const ksl::model &m, const state &s, int) {
  const numbers<double> D = results<algorithms::forward_dynamics_second_derivatives>(m, s);
  const auto check = [&](std::size_t which, kind by, kind later) {
    check_second<algorithms::forward_dynamics>(m, s, D, which, by, later, 1e-11); // the condition of M enters
  };
  check(0, of_q, of_q), check(1, of_v, of_v), check(2, of_q, of_v), check(3, of_q, of_last);
}

/// Third derivatives commute: that of the first result by a_j or tau_j is that of the last by a coordinate of q.
template <class Algorithm>
void check_third_derivatives(const ksl::model &m, const state &s, bool j_is_last, double tolerance) {
  const std::size_t nv = s.v.size(), j = nv / 2, l = nv - 1;
  const auto by = [&](kind variable, std::size_t coordinate, std::size_t which) {
    const auto d = moving(m, s, rates_of(variable, unit(nv, coordinate)));
    return part(derivatives(results<Algorithm>(m, d)), which, 4);
  };
  const numbers<double> by_last = by(of_last, j, 0), by_q = by(of_q, l, 3);
  numbers<double> one, other;
  for (std::size_t i = 0; i < nv; ++i)
    for (std::size_t k = 0; k < nv; ++k) {
      one.push_back(by_last[(i * nv + k) * nv + l]);
      other.push_back(by_q[j_is_last ? (i * nv + k) * nv + j : (i * nv + j) * nv + k]);
    }
  CHECK(difference(one, other) <= tolerance);
}

void check_efforts(const ksl::model &m, const state &s, int) {
  check_derivatives<algorithms::inverse_dynamics, algorithms::inverse_dynamics_derivatives>(m, s);
  check_gradient(m, s);
}

void check_reactions(const ksl::model &m, const state &s, int turn) {
  const request asked = asked_of(m, turn);
  check_derivatives<algorithms::inverse_dynamics_with_reactions, algorithms::reactions_derivatives>(m, s, asked);
  check_reactions_by_external(m, s, asked);
}

void check_motions(const ksl::model &m, const state &s, int turn) {
  using namespace algorithms;
  const request asked = asked_of(m, turn);
  check_derivatives<frame_velocities, frame_velocities_derivatives>(m, s, asked);
  check_derivatives<frame_accelerations, frame_accelerations_derivatives>(m, s, asked);
  check_derivatives<centroidal_momentum, centroidal_momentum_derivatives>(m, s);
  check_derivatives<centroidal_momentum_rate, centroidal_momentum_rate_derivatives>(m, s);
  check_energy(m, s);
}

} // namespace

TEST_CASE("derivatives of inverse dynamics, and its gradient") {
  for_every_kind(1, 5, check_efforts);
  for_trees(2, 40, 14, check_efforts);
}

TEST_CASE("derivatives of reactions, for all axes, points and parts: every kind of joint") {
  for_every_kind(3, 36, check_reactions);
}
TEST_CASE("derivatives of reactions, for all axes, points and parts: random trees") {
  for_trees(4, 36, 8, check_reactions);
}

TEST_CASE("derivatives of motions, momentum and energy: every kind of joint") { for_every_kind(5, 12, check_motions); }
TEST_CASE("derivatives of motions, momentum and energy: random trees") { for_trees(6, 36, 10, check_motions); }

TEST_CASE("second derivatives of inverse dynamics: every kind of joint") { for_every_kind(7, 1, check_inverse_twice); }
TEST_CASE("second derivatives of inverse dynamics: random trees") { for_trees(8, 12, 7, check_inverse_twice); }
TEST_CASE("second derivatives of forward dynamics: every kind of joint") { for_every_kind(9, 1, check_forward_twice); }
TEST_CASE("second derivatives of forward dynamics: random trees") { for_trees(10, 10, 6, check_forward_twice); }

TEST_CASE("third derivatives commute") {
  for_every_kind(11, 1, [](const ksl::model &m, const state &s, int) {
    check_third_derivatives<algorithms::inverse_dynamics_second_derivatives>(m, s, false, 1e-12);
    check_third_derivatives<algorithms::forward_dynamics_second_derivatives>(m, s, true, 1e-9);
  });
}
