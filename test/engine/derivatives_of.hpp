// Derivatives of what is computed from q, v and a, by dual numbers: the witness of analytic derivatives.
#pragma once

#include "random_trees.hpp"

#include "ksl/dual.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace derivatives {

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
    numbers<T> q(s.q.begin(), s.q.end()), v(s.v.begin(), s.v.end()), a(s.a.begin(), s.a.end()),
        step(s.v.size(), T(0.0));
    (which == 0 ? step : which == 1 ? v : a)[static_cast<std::size_t>(k)].derivative[0] = 1;
    for (int i = 1; i < m.view().bodies; ++i) {
      const ksl::body<double> &b = m.view().body[i];
      numbers<T> moved(8);
      ksl::with_joint(b.kind,
                      [&]<class J>(J) { J::integrate(q.data() + b.q_index, step.data() + b.v_index, moved.data()); });
      std::copy_n(moved.begin(), ksl::row_of(b.kind).nq, q.begin() + b.q_index);
    }
    const numbers<T> push(s.push.begin(), s.push.end());
    numbers<double> out;
    for (const T &x : compute(q, v, a, ksl::external_wrenches<T>{s.external().n, s.pushed.data(), push.data(), s.axes}))
      out.push_back(x.derivative[0]);
    return out;
  }
};

inline double largest(const numbers<double> &x) {
  double out = 1;
  for (double y : x)
    out = std::fmax(out, std::fabs(y));
  return out;
}

/// Holds D (3, n, nv) against the derivatives of n numbers by q, v and a.
template <class Compute> void check_derivatives(const function<Compute> &f, const numbers<double> &D,
                                                double tolerance) {
  const int nv = f.m.nv();
  const std::size_t n = D.size() / static_cast<std::size_t>(3 * nv);
  double error = 0;
  for (int which = 0; which < 3; ++which)
    for (int k = 0; k < nv; ++k) {
      const numbers<double> expected = f.derivative(which, k);
      REQUIRE(expected.size() == n);
      for (std::size_t i = 0; i < n; ++i)
        error = std::fmax(error, std::fabs(D[(static_cast<std::size_t>(which) * n + i) * static_cast<std::size_t>(nv) +
                                             static_cast<std::size_t>(k)] -
                                           expected[i]));
    }
  CHECK(error <= tolerance * largest(D));
}

} // namespace derivatives
