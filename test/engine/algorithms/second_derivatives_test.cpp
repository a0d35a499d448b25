// Second derivatives against dual numbers of dual numbers through inverse and forward dynamics, with every kind of joint, on random
// trees.
#include "random_trees.hpp"

#include "ksl/dual.hpp"
#include "ksl/engine/algorithms/derivatives/forward_dynamics_second_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/inverse_dynamics_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/inverse_dynamics_second_derivatives.hpp"
#include "ksl/engine/algorithms/forward/forward_dynamics.hpp"
#include "ksl/engine/algorithms/inverse/inverse_dynamics.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace {

using twice = ksl::second_order_dual<1>;
using robots::numbers;
using robots::random_state;
using robots::random_tree;
using robots::state;

constexpr int most_kinds = 3; ///< of variables: q, v, and a or tau

/// q = q ⊕ step e_k
template <class T> void move(const ksl::model &m, numbers<T> &q, int k, const T &step) {
  numbers<T> x(static_cast<std::size_t>(m.nv()), T(0.0));
  x[static_cast<std::size_t>(k)] = step;
  for (int i = 1; i < m.view().bodies; ++i) {
    const ksl::body<double> &b = m.view().body[i];
    numbers<T> moved(8);
    ksl::with_joint(b.kind,
                    [&]<class J>(J) { J::integrate(q.data() + b.q_index, x.data() + b.v_index, moved.data()); });
    std::copy_n(moved.begin(), ksl::row_of(b.kind).nq, q.begin() + b.q_index);
  }
}

/// A function of q, v and a third vector, (nv).
template <class Compute> struct function {
  const ksl::model &m;
  const state &s;
  Compute compute;

  /// The derivative by coordinate l of variable `later` of the derivative by coordinate k of variable `first`.
  numbers<double> derivative(int first, int k, int later, int l) const {
    numbers<twice> x[most_kinds] = {{s.q.begin(), s.q.end()}, {s.v.begin(), s.v.end()}, {s.a.begin(), s.a.end()}};
    twice inner(ksl::dual<1>::variable(0, 0)), outer = twice::variable(0.0, 0);
    for (const auto &[variable, coordinate, step] : {std::tuple{later, l, inner}, std::tuple{first, k, outer}})
      if (variable == 0)
        move(m, x[0], coordinate, step);
      else
        x[variable][static_cast<std::size_t>(coordinate)] = x[variable][static_cast<std::size_t>(coordinate)] + step;
    const numbers<twice> push(s.push.begin(), s.push.end());
    numbers<double> out;
    for (const twice &y :
         compute(x[0], x[1], x[2], ksl::external_wrenches<twice>{s.external().n, s.pushed.data(), push.data(), s.axes}))
      out.push_back(y.derivative[0].derivative[0]);
    return out;
  }

  /// Holds D (nv, nv, nv) against the derivatives by the variables `first` and `later`, and returns the largest error relative to the
  /// largest element.
  double error(int first, int later, const double *D) const {
    const int nv = m.nv();
    double error = 0, scale = 1;
    for (int k = 0; k < nv; ++k)
      for (int l = 0; l < nv; ++l) {
        const numbers<double> expected = derivative(first, k, later, l);
        for (int i = 0; i < nv; ++i) {
          const double found = D[(i * nv + k) * nv + l];
          error = std::fmax(error, std::fabs(found - expected[static_cast<std::size_t>(i)]));
          scale = std::fmax(scale, std::fabs(expected[static_cast<std::size_t>(i)]));
          if (!(std::fabs(found) < 1e300))
            return INFINITY;
        }
      }
    return error / scale;
  }
};

/// The four results, one after the other.  third: a or tau.
template <class T, class Compute> numbers<T> results(const state &s, const numbers<T> &q, const numbers<T> &third,
                                                     Compute compute) {
  const numbers<T> v(s.v.begin(), s.v.end()), push(s.push.begin(), s.push.end());
  const std::size_t n = s.v.size() * s.v.size() * s.v.size();
  numbers<T> D(4 * n, T(NAN));
  const ksl::external_wrenches<T> external{s.external().n, s.pushed.data(), push.data(), s.axes};
  compute(q.data(), v.data(), third.data(), external, D.data(), &D[n], &D[2 * n], &D[3 * n]);
  return D;
}

template <class T> numbers<T> of_efforts(const ksl::model &m, const state &s, const numbers<T> &q,
                                         const numbers<T> &a) {
  const ksl::owned_workspace<ksl::inverse_dynamics_second_derivatives_workspace<T>> w(m.view());
  return results(s, q, a, [&](auto... x) { ksl::inverse_dynamics_second_derivatives<T>(m.view(), *w, x...); });
}

template <class T> numbers<T> of_accelerations(const ksl::model &m, const state &s, const numbers<T> &q,
                                               const numbers<T> &tau) {
  const ksl::owned_workspace<ksl::forward_dynamics_second_derivatives_workspace<T>> w(m.view());
  return results(s, q, tau, [&](auto... x) { ksl::forward_dynamics_second_derivatives<T>(m.view(), *w, x...); });
}

void check_inverse_dynamics(const ksl::model &m, const state &s) {
  const auto tau = [&](const numbers<twice> &q, const numbers<twice> &v, const numbers<twice> &a,
                       const ksl::external_wrenches<twice> &external) {
    numbers<twice> out(v.size());
    const ksl::owned_workspace<ksl::inverse_dynamics_workspace<twice>> w(m.view());
    ksl::inverse_dynamics<twice>(m.view(), *w, q.data(), v.data(), a.data(), external, out.data());
    return out;
  };
  const function<decltype(tau)> f{m, s, tau};
  const std::size_t n = s.v.size() * s.v.size() * s.v.size();
  const numbers<double> D = of_efforts(m, s, s.q, s.a);
  CHECK(f.error(0, 0, &D[0]) <= 1e-13);
  CHECK(f.error(1, 1, &D[n]) <= 1e-13);
  CHECK(f.error(0, 1, &D[2 * n]) <= 1e-13);
  CHECK(f.error(2, 0, &D[3 * n]) <= 1e-13);
}

/// s.a holds the efforts.
void check_forward_dynamics(const ksl::model &m, const state &s) {
  const auto a = [&](const numbers<twice> &q, const numbers<twice> &v, const numbers<twice> &tau,
                     const ksl::external_wrenches<twice> &external) {
    numbers<twice> out(v.size());
    const ksl::owned_workspace<ksl::forward_dynamics_workspace<twice>> w(m.view());
    ksl::forward_dynamics<twice>(m.view(), *w, q.data(), v.data(), tau.data(), external, out.data());
    return out;
  };
  const function<decltype(a)> f{m, s, a};
  const std::size_t n = s.v.size() * s.v.size() * s.v.size();
  const numbers<double> D = of_accelerations(m, s, s.q, s.a);
  CHECK(f.error(0, 0, &D[0]) <= 1e-11); // the condition of M enters
  CHECK(f.error(1, 1, &D[n]) <= 1e-11);
  CHECK(f.error(0, 1, &D[2 * n]) <= 1e-11);
  CHECK(f.error(0, 2, &D[3 * n]) <= 1e-11);
}

/// Third derivatives commute: that of the first result by a_j or tau_j is that of the last by a coordinate of q.
template <class Compute> void check_third_derivatives(const ksl::model &m, const state &s, bool j_is_last,
                                                      double tolerance, Compute compute) {
  using T = ksl::dual<1>;
  const std::size_t nv = s.v.size(), n = nv * nv * nv, j = nv / 2, l = nv - 1;
  const numbers<double> values = compute(s.q, s.a);
  const numbers<T> q(s.q.begin(), s.q.end()), third(s.a.begin(), s.a.end());
  numbers<T> changed = third, moved = q;
  changed[j].derivative[0] = 1;
  move(m, moved, static_cast<int>(l), T::variable(0.0, 0));
  const numbers<T> by_third = compute(q, changed), by_q = compute(moved, third);
  double error = 0, scale = 1;
  for (std::size_t i = 0; i < nv; ++i)
    for (std::size_t k = 0; k < nv; ++k) {
      const double x = by_third[(i * nv + k) * nv + l].derivative[0];
      const double y = by_q[3 * n + (j_is_last ? (i * nv + k) * nv + j : (i * nv + j) * nv + k)].derivative[0];
      error = std::fmax(error, std::fabs(x - y)), scale = std::fmax(scale, std::fabs(y));
    }
  CHECK(error <= tolerance * scale);
  for (std::size_t i = 0; i < 4 * n; ++i)
    REQUIRE(std::fabs(by_q[i].value - values[i]) <= 1e-10 * (1 + std::fabs(values[i])));
}

} // namespace

TEST_CASE("second derivatives on dual numbers") {
  std::mt19937 random(5);
  const ksl::model m = ksl::load(KSL_EVERY_KIND);
  const state s = random_state(m, random);
  check_third_derivatives(m, s, false, 1e-12, [&](const auto &q, const auto &a) { return of_efforts(m, s, q, a); });
  check_third_derivatives(m, s, true, 1e-9,
                          [&](const auto &q, const auto &tau) { return of_accelerations(m, s, q, tau); });
}

TEST_CASE("second derivatives of forward dynamics: every kind of joint") {
  std::mt19937 random(3);
  const ksl::model m = ksl::load(KSL_EVERY_KIND);
  check_forward_dynamics(m, random_state(m, random));
}

TEST_CASE("second derivatives of forward dynamics: random trees") {
  std::mt19937 random(4);
  for (int turn = 0; turn < 5; ++turn) {
    CAPTURE(turn);
    const ksl::model m = random_tree(2 + 2 * turn, random);
    if (m.nv() > 0)
      check_forward_dynamics(m, random_state(m, random));
  }
}

TEST_CASE("second derivatives of inverse dynamics: every kind of joint") {
  std::mt19937 random(1);
  const ksl::model m = ksl::load(KSL_EVERY_KIND);
  check_inverse_dynamics(m, random_state(m, random));
}

TEST_CASE("second derivatives of inverse dynamics: random trees") {
  std::mt19937 random(2);
  for (int turn = 0; turn < 8; ++turn) {
    CAPTURE(turn);
    const ksl::model m = random_tree(2 + 3 * turn / 2, random);
    if (m.nv() > 0)
      check_inverse_dynamics(m, random_state(m, random));
  }
}
