// Analytic derivatives against dual numbers through the very algorithms that they are the derivatives of, with every kind of joint,
// on random trees.
#include "random_trees.hpp"

#include "ksl/dual.hpp"
#include "ksl/engine/inverse_dynamics_derivatives.hpp"
#include "ksl/engine/owned_workspace.hpp"
#include "ksl/engine/reactions_derivatives.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace {

using T = ksl::dual<1>;
using robots::numbers;
using robots::random_state;
using robots::random_tree;
using robots::state;

/// What is computed from q, v and a.
template <class Compute> struct function {
  const ksl::model &m;
  const state &s;
  Compute compute;

  /// Its derivatives by coordinate k of q, along q ⊕ s e_k (which: 0), of v (1) or a (2).
  numbers<double> derivative(int which, int k) const {
    numbers<T> q(s.q.begin(), s.q.end()), v(s.v.begin(), s.v.end()), a(s.a.begin(), s.a.end()), step(s.v.size(), T(0.0));
    (which == 0 ? step : which == 1 ? v : a)[static_cast<std::size_t>(k)].derivative[0] = 1;
    for (int i = 1; i < m.view().bodies; ++i) {
      const ksl::body<double> &b = m.view().body[i];
      numbers<T> moved(8);
      ksl::with_joint(b.kind, [&]<class J>(J) { J::integrate(&q[b.q_index], &step[b.v_index], moved.data()); });
      std::copy_n(moved.begin(), ksl::row_of(b.kind).nq, q.begin() + b.q_index);
    }
    const numbers<T> push(s.push.begin(), s.push.end());
    numbers<double> out;
    for (const T &x : compute(q, v, a, ksl::external_wrenches<T>{s.external().n, s.pushed.data(), push.data()}))
      out.push_back(x.derivative[0]);
    return out;
  }
};

double largest(const numbers<double> &x) {
  double out = 1;
  for (double y : x)
    out = std::fmax(out, std::fabs(y));
  return out;
}

/// Holds D (3, n, nv) against the derivatives of n numbers by q, v and a.
template <class Compute> void check_derivatives(const function<Compute> &f, const numbers<double> &D, double tolerance) {
  const int nv = f.m.nv();
  const std::size_t n = D.size() / static_cast<std::size_t>(3 * nv);
  double error = 0;
  for (int which = 0; which < 3; ++which)
    for (int k = 0; k < nv; ++k) {
      const numbers<double> expected = f.derivative(which, k);
      REQUIRE(expected.size() == n);
      for (std::size_t i = 0; i < n; ++i)
        error = std::fmax(error, std::fabs(D[(which * n + i) * static_cast<std::size_t>(nv) + static_cast<std::size_t>(k)] - expected[i]));
    }
  CHECK(error <= tolerance * largest(D));
}

void check_inverse_dynamics(const ksl::model &m, const state &s) {
  const auto tau = [&](const numbers<T> &q, const numbers<T> &v, const numbers<T> &a, const ksl::external_wrenches<T> &external) {
    numbers<T> out(v.size());
    const ksl::owned_workspace<ksl::inverse_dynamics_workspace<T>> w(m.view());
    ksl::inverse_dynamics<T>(m.view(), *w, q.data(), v.data(), a.data(), external, out.data());
    return out;
  };
  const std::size_t n = s.v.size() * s.v.size();
  numbers<double> D(3 * n, NAN);
  const ksl::owned_workspace<ksl::inverse_dynamics_derivatives_workspace<double>> w(m.view());
  ksl::inverse_dynamics_derivatives(m.view(), *w, s.q.data(), s.v.data(), s.a.data(), s.external(), D.data(), &D[n], &D[2 * n]);
  check_derivatives(function<decltype(tau)>{m, s, tau}, D, 1e-13);
}

void check_reactions(const ksl::model &m, const state &s, ksl::reaction_request request) {
  numbers<int> links;
  for (int l = m.view().links - 1; l >= 0; --l)
    links.push_back(l);
  request.n = m.view().links;
  request.link = links.data();
  const std::size_t n = 6 * links.size(), size = n * s.v.size();
  const auto found = [&](const numbers<T> &q, const numbers<T> &v, const numbers<T> &a, const ksl::external_wrenches<T> &external) {
    numbers<T> tau(v.size()), out(n);
    const ksl::owned_workspace<ksl::reactions_workspace<T>> w(m.view());
    ksl::inverse_dynamics_with_reactions<T>(m.view(), *w, q.data(), v.data(), a.data(), external, tau.data(), request, out.data());
    return out;
  };
  numbers<double> D(3 * size, NAN);
  const ksl::owned_workspace<ksl::reactions_derivatives_workspace<double>> w(m.view());
  ksl::reactions_derivatives(m.view(), *w, s.q.data(), s.v.data(), s.a.data(), request, s.external(), D.data(), &D[size], &D[2 * size]);
  check_derivatives(function<decltype(found)>{m, s, found}, D, 1e-13);
}

/// A request for other axes, another point and part than before.
ksl::reaction_request request_of(int turn, int links) {
  using ksl::wrench_frame;
  constexpr wrench_frame frames[3] = {wrench_frame::joint, wrench_frame::world, wrench_frame::link};
  ksl::reaction_request r;
  r.at = frames[turn % 3], r.axes = frames[turn / 3 % 3];
  r.at_link = (7 * turn + 1) % links, r.axes_link = (5 * turn + 2) % links;
  r.part = static_cast<ksl::wrench_part>(turn % 2 ? turn / 2 % 4 : 0);
  if (turn % 4 == 1)
    r.offset[0] = 0.3, r.offset[1] = -0.2, r.offset[2] = 0.7;
  r.on = turn % 5 == 3 ? ksl::wrench_side::parent : ksl::wrench_side::child;
  r.angular_first = turn % 7 == 4;
  return r;
}

} // namespace

TEST_CASE("derivatives of inverse dynamics: every kind of joint") {
  std::mt19937 random(1);
  const ksl::model m = ksl::load(KSL_EVERY_KIND);
  for (int turn = 0; turn < 5; ++turn)
    check_inverse_dynamics(m, random_state(m, random));
}

TEST_CASE("derivatives of inverse dynamics: random trees") {
  std::mt19937 random(2);
  for (int turn = 0; turn < 60; ++turn) {
    CAPTURE(turn);
    const ksl::model m = random_tree(2 + turn % 23, random);
    if (m.nv() > 0)
      check_inverse_dynamics(m, random_state(m, random));
  }
}

TEST_CASE("derivatives of reactions: every kind of joint, axes, points and parts") {
  std::mt19937 random(3);
  const ksl::model m = ksl::load(KSL_EVERY_KIND);
  for (int turn = 0; turn < 36; ++turn) {
    CAPTURE(turn);
    check_reactions(m, random_state(m, random), request_of(turn, m.view().links));
  }
}

TEST_CASE("derivatives of reactions: random trees") {
  std::mt19937 random(4);
  for (int turn = 0; turn < 60; ++turn) {
    CAPTURE(turn);
    const ksl::model m = random_tree(2 + turn % 13, random);
    if (m.nv() > 0)
      check_reactions(m, random_state(m, random), request_of(turn, m.view().links));
  }
}
