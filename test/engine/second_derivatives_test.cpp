// Second derivatives against dual numbers of dual numbers through inverse and forward dynamics, with every kind of joint, on random
// trees.
#include "random_trees.hpp"

#include "ksl/dual.hpp"
#include "ksl/engine/forward_dynamics.hpp"
#include "ksl/engine/inverse_dynamics.hpp"
#include "ksl/engine/inverse_dynamics_derivatives.hpp"
#include "ksl/engine/inverse_dynamics_second_derivatives.hpp"
#include "ksl/engine/owned_workspace.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace {

using T = ksl::second_order_dual<1>;
using robots::numbers;
using robots::random_state;
using robots::random_tree;
using robots::state;

constexpr int most_kinds = 3; ///< of variables: q, v, and a or tau

/// A function of q, v and a third vector, (nv).
template <class Compute> struct function {
  const ksl::model &m;
  const state &s;
  Compute compute;

  /// q ⊕ step e_k
  void move(numbers<T> &q, int k, const T &step) const {
    numbers<T> x(s.v.size(), T(0.0));
    x[static_cast<std::size_t>(k)] = step;
    for (int i = 1; i < m.view().bodies; ++i) {
      const ksl::body<double> &b = m.view().body[i];
      numbers<T> moved(8);
      ksl::with_joint(b.kind, [&]<class J>(J) { J::integrate(&q[b.q_index], &x[b.v_index], moved.data()); });
      std::copy_n(moved.begin(), ksl::row_of(b.kind).nq, q.begin() + b.q_index);
    }
  }

  /// The derivative by coordinate l of variable `later` of the derivative by coordinate k of variable `first`.
  numbers<double> derivative(int first, int k, int later, int l) const {
    numbers<T> x[most_kinds] = {{s.q.begin(), s.q.end()}, {s.v.begin(), s.v.end()}, {s.a.begin(), s.a.end()}};
    T inner(ksl::dual<1>::variable(0, 0)), outer = T::variable(0.0, 0);
    for (const auto &[variable, coordinate, step] : {std::tuple{later, l, inner}, std::tuple{first, k, outer}})
      if (variable == 0)
        move(x[0], coordinate, step);
      else
        x[variable][static_cast<std::size_t>(coordinate)] = x[variable][static_cast<std::size_t>(coordinate)] + step;
    const numbers<T> push(s.push.begin(), s.push.end());
    numbers<double> out;
    for (const T &y : compute(x[0], x[1], x[2], ksl::external_wrenches<T>{s.external().n, s.pushed.data(), push.data()}))
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

/// The four results, one after the other.
template <class N> numbers<N> second_derivatives_of_efforts(const ksl::model &m, const state &s) {
  const numbers<N> q(s.q.begin(), s.q.end()), v(s.v.begin(), s.v.end()), a(s.a.begin(), s.a.end()), push(s.push.begin(), s.push.end());
  const std::size_t n = s.v.size() * s.v.size() * s.v.size();
  numbers<N> D(4 * n);
  const ksl::owned_workspace<ksl::inverse_dynamics_second_derivatives_workspace<N>> w(m.view());
  ksl::inverse_dynamics_second_derivatives<N>(m.view(), *w, q.data(), v.data(), a.data(),
                                              {static_cast<int>(s.pushed.size()), s.pushed.data(), push.data()}, D.data(), &D[n],
                                              &D[2 * n], &D[3 * n]);
  return D;
}

void check_inverse_dynamics(const ksl::model &m, const state &s) {
  const auto tau = [&](const numbers<T> &q, const numbers<T> &v, const numbers<T> &a, const ksl::external_wrenches<T> &external) {
    numbers<T> out(v.size());
    const ksl::owned_workspace<ksl::inverse_dynamics_workspace<T>> w(m.view());
    ksl::inverse_dynamics<T>(m.view(), *w, q.data(), v.data(), a.data(), external, out.data());
    return out;
  };
  const function<decltype(tau)> f{m, s, tau};
  const std::size_t n = s.v.size() * s.v.size() * s.v.size();
  const numbers<double> D = second_derivatives_of_efforts<double>(m, s);
  CHECK(f.error(0, 0, &D[0]) <= 1e-13);
  CHECK(f.error(1, 1, &D[n]) <= 1e-13);
  CHECK(f.error(0, 1, &D[2 * n]) <= 1e-13);
  CHECK(f.error(2, 0, &D[3 * n]) <= 1e-13);
}

} // namespace

TEST_CASE("second derivatives of inverse dynamics: every kind of joint") {
  std::mt19937 random(1);
  const ksl::model m = ksl::load(KSL_EVERY_KIND);
  check_inverse_dynamics(m, random_state(m, random));
}

TEST_CASE("second derivatives of inverse dynamics: random trees") {
  std::mt19937 random(2);
  for (int turn = 0; turn < 24; ++turn) {
    CAPTURE(turn);
    const ksl::model m = random_tree(2 + turn % 12, random);
    if (m.nv() > 0)
      check_inverse_dynamics(m, random_state(m, random));
  }
}
