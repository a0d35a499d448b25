// States over any scalar, what every algorithm gives there, and derivatives by dual numbers: the witness of analytic ones.
#pragma once

#include "every_algorithm.hpp"
#include "matrices.hpp"
#include "moved.hpp"
#include "random_trees.hpp"

#include "ksl/dual.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"

#include <doctest/doctest.h>

#include <cmath>

namespace robots {

using first = ksl::dual<1>;
using matrices::difference;

/// What a call asks for besides numbers: links, of which joints are those that carry them, and how.
struct request {
  numbers<int> links;
  ksl::frame_options frame;
  ksl::reaction_request reactions;
};

/// Every so many links, the last first.
inline request of_links(const ksl::model &m, int step = 1) {
  request asked;
  for (int l = m.view().links - 1; l >= 0; l -= step)
    asked.links.push_back(l);
  return asked;
}

/// The results of an algorithm, one after the other.  NaN is what it doesn't write.
template <class Algorithm, class T>
numbers<T> results(const ksl::model &m, const state_over<T> &s, const request &asked = {}) {
  const ksl::algorithm_row &row = Algorithm::row;
  const int n = static_cast<int>(asked.links.size());
  ksl::reaction_request joints = asked.reactions;
  joints.n = n, joints.link = asked.links.data();
  ksl::state_view<T> view = {s.q.data(), s.v.data(), s.a.data(), s.tau.data(), s.q1.data(), &s.fraction};
  if (!s.push.empty())
    view.external = s.external();
  view.links = {n, asked.links.data()}, view.frame = asked.frame, view.joints = &joints;
  const ksl::extents sizes = {m.nq(), m.nv(), n, n, m.tree_elements(), m.view().links};
  std::ptrdiff_t ends[ksl::most_results + 1] = {0}; // of reactions, too
  for (int r = 0; r < row.results; ++r)
    ends[r + 1] = ends[r] + ksl::numbers_of(row.result[r], sizes);
  const bool reactions = row.request == ksl::request_kind::reactions;
  numbers<T> out(static_cast<std::size_t>(ends[row.results] + (reactions ? 6 * n : 0)), T(NAN));
  for (int r = 0; r < row.results + reactions; ++r)
    view.result[r] = out.data() + ends[r];
  using workspace = typename Algorithm::template workspace<T>;
  const auto &of = m.view_in<ksl::scalar_of<T>>();
  Algorithm::template compute<T>(of, *ksl::owned_workspace<workspace>(of), view);
  return out;
}

/// Part k of several that are equally long.
template <class T> numbers<T> part(const numbers<T> &x, std::size_t k, std::size_t parts) {
  const auto n = static_cast<std::ptrdiff_t>(x.size() / parts), begin = static_cast<std::ptrdiff_t>(k) * n;
  return {x.begin() + begin, x.begin() + begin + n};
}

inline double largest(const numbers<double> &x) {
  double out = 1;
  for (double y : x)
    out = std::fmax(out, std::fabs(y));
  return out;
}

inline numbers<double> unit(std::size_t n, std::size_t i) {
  numbers<double> x(n, 0.0);
  x[i] = 1;
  return x;
}

template <class S, class T> numbers<T> along(const numbers<S> &x, const numbers<double> &rate, const T &step) {
  numbers<T> out(x.begin(), x.end());
  for (std::size_t i = 0; i < rate.size(); ++i)
    out[i] = out[i] + T(rate[i]) * step;
  return out;
}

/// The state after a step along rates, of which those of q are velocities (nv); none are zeros.
template <class S, class T>
state_over<T> moved(const ksl::model &m, const state_over<S> &s, const state &rates, const T &step) {
  const numbers<T> still(static_cast<std::size_t>(m.nv()), T(0));
  return {moved(m, s.q, along(still, rates.q, step)),
          along(s.v, rates.v, step),
          along(s.a, rates.a, step),
          along(s.tau, rates.tau, step),
          along(s.push, rates.push, step),
          numbers<T>(s.q1.begin(), s.q1.end()),
          s.pushed,
          s.axes,
          T(s.fraction)};
}
inline state_over<first> moving(const ksl::model &m, const state &s, const state &rates) {
  return moved(m, s, rates, first::variable(0, 0));
}
/// With time as the variable: q moves along v, v along a.
inline state_over<first> in_time(const ksl::model &m, const state &s) { return moving(m, s, {.q = s.v, .v = s.a}); }

inline numbers<double> derivatives(const numbers<first> &x) {
  numbers<double> out;
  for (const first &y : x)
    out.push_back(y.derivative[0]);
  return out;
}

/// Derivatives of an algorithm's results by coordinate k of q (by: 0), of v (1), of a or tau (2).
template <class Algorithm>
numbers<double> derivatives_by(int by, std::size_t k, const ksl::model &m, const state &s, const request &asked) {
  const numbers<double> e = unit(static_cast<std::size_t>(m.nv()), k);
  const bool given = Algorithm::row.reads(ksl::input::tau);
  const state rates = by == 0 ? state{.q = e} : by == 1 ? state{.v = e} : given ? state{.tau = e} : state{.a = e};
  return derivatives(results<Algorithm>(m, moving(m, s, rates), asked));
}

/// What Derivatives computes, by q, v, and a or tau one after the other, is what dual numbers give of the last result of Algorithm.
template <class Algorithm, class Derivatives>
void check_derivatives(const ksl::model &m, const state &s, const request &asked = {}, double tolerance = 1e-13) {
  CAPTURE(Derivatives::row.name);
  const numbers<double> found = results<Derivatives>(m, s, asked);
  const std::size_t nv = static_cast<std::size_t>(m.nv()), kinds = static_cast<std::size_t>(Derivatives::row.results),
                    n = found.size() / (kinds * nv);
  numbers<double> expected(found.size());
  for (std::size_t by = 0; by < kinds; ++by)
    for (std::size_t k = 0; k < nv; ++k) {
      const numbers<double> column = derivatives_by<Algorithm>(static_cast<int>(by), k, m, s, asked);
      for (std::size_t i = 0; i < n; ++i)
        expected[(by * n + i) * nv + k] = column[column.size() - n + i];
    }
  CHECK(difference(found, expected) <= tolerance);
}

} // namespace robots
