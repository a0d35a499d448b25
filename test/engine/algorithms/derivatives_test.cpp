// Analytic derivatives against dual numbers through the very algorithms that they are the derivatives of, with every kind of joint,
// on random trees.
#include "derivatives_of.hpp"

#include "ksl/engine/algorithms/derivatives/inverse_dynamics_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/inverse_dynamics_gradient.hpp"
#include "ksl/engine/algorithms/derivatives/reactions_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/reactions_external_derivatives.hpp"

namespace {

using namespace derivatives;

void check_inverse_dynamics(const ksl::model &m, const state &s) {
  const auto tau = [&](const numbers<T> &q, const numbers<T> &v, const numbers<T> &a,
                       const ksl::external_wrenches<T> &external) {
    numbers<T> out(v.size());
    const ksl::owned_workspace<ksl::inverse_dynamics_workspace<T>> w(m.view());
    ksl::inverse_dynamics<T>(m.view(), *w, q.data(), v.data(), a.data(), external, out.data());
    return out;
  };
  const std::size_t n = s.v.size() * s.v.size();
  numbers<double> D(3 * n, NAN);
  const ksl::owned_workspace<ksl::inverse_dynamics_derivatives_workspace<double>> w(m.view());
  ksl::inverse_dynamics_derivatives(m.view(), *w, s.q.data(), s.v.data(), s.a.data(), s.external(), D.data(), &D[n],
                                    &D[2 * n]);
  check_derivatives(function<decltype(tau)>{m, s, tau}, D, 1e-13);
}

/// Weights of the efforts of a state: each another number.
template <class N> numbers<N> weights_of(const state &s) {
  numbers<N> weights;
  for (const double a : s.a)
    weights.push_back(N(0.5 - a * a));
  return weights;
}

/// The gradients are derivatives of the weighted sum; and those of the gradients, by dual numbers, are symmetric: by v and a of each other.
void check_gradient(const ksl::model &m, const state &s) {
  const auto sum = [&](const numbers<T> &q, const numbers<T> &v, const numbers<T> &a,
                       const ksl::external_wrenches<T> &) {
    numbers<T> tau(v.size());
    const ksl::owned_workspace<ksl::inverse_dynamics_workspace<T>> w(m.view());
    ksl::inverse_dynamics<T>(m.view(), *w, q.data(), v.data(), a.data(), {}, tau.data());
    const numbers<T> weights = weights_of<T>(s);
    T out(0.0);
    for (std::size_t i = 0; i < tau.size(); ++i)
      out = out + weights[i] * tau[i];
    return numbers<T>{out};
  };
  const std::size_t n = s.v.size();
  numbers<double> D(3 * n, NAN);
  const numbers<double> weights = weights_of<double>(s);
  const ksl::owned_workspace<ksl::inverse_dynamics_gradient_workspace<double>> w(m.view());
  ksl::inverse_dynamics_gradient(m.view(), *w, s.q.data(), s.v.data(), s.a.data(), weights.data(), D.data(), &D[n],
                                 &D[2 * n]);
  check_derivatives(function<decltype(sum)>{m, s, sum}, D, 1e-13);

  const auto gradient = [&](const numbers<T> &q, const numbers<T> &v, const numbers<T> &a,
                            const ksl::external_wrenches<T> &) {
    numbers<T> by_q(n), by_v(n), by_a(n);
    const ksl::owned_workspace<ksl::inverse_dynamics_gradient_workspace<T>> own(m.view());
    ksl::inverse_dynamics_gradient<T>(m.view(), *own, q.data(), v.data(), a.data(), weights_of<T>(s).data(),
                                      by_q.data(), by_v.data(), by_a.data());
    by_v.insert(by_v.end(), by_a.begin(), by_a.end());
    return by_v;
  };
  const function<decltype(gradient)> f{m, s, gradient};
  double error = 0, scale = 1;
  for (int k = 0; k < m.nv(); ++k) {
    const numbers<double> by_v = f.derivative(1, k), by_a = f.derivative(2, k);
    for (std::size_t i = 0; i < n; ++i) {
      const double other = f.derivative(1, static_cast<int>(i))[static_cast<std::size_t>(k)];
      error = std::fmax(error, std::fabs(by_v[i] - other)); // of v_i and v_k
      error = std::fmax(error, std::fabs(by_a[i]));         // efforts have no products of v and a
      error = std::fmax(error, std::fabs(by_a[n + i]));     // nor of two a
      scale = std::fmax(scale, std::fabs(other));
    }
  }
  CHECK(error <= 1e-13 * scale);
}

void check_reactions(const ksl::model &m, const state &s, ksl::reaction_request request) {
  numbers<int> links;
  for (int l = m.view().links - 1; l >= 0; --l)
    links.push_back(l);
  request.n = m.view().links;
  request.link = links.data();
  const std::size_t n = 6 * links.size(), size = n * s.v.size();
  const auto found = [&](const numbers<T> &q, const numbers<T> &v, const numbers<T> &a,
                         const ksl::external_wrenches<T> &external) {
    numbers<T> tau(v.size()), out(n);
    const ksl::owned_workspace<ksl::reactions_workspace<T>> w(m.view());
    ksl::inverse_dynamics_with_reactions<T>(m.view(), *w, q.data(), v.data(), a.data(), external, tau.data(), request,
                                            out.data());
    return out;
  };
  numbers<double> D(3 * size, NAN);
  const ksl::owned_workspace<ksl::reactions_derivatives_workspace<double>> w(m.view());
  ksl::reactions_derivatives(m.view(), *w, s.q.data(), s.v.data(), s.a.data(), request, s.external(), D.data(),
                             &D[size], &D[2 * size]);
  check_derivatives(function<decltype(found)>{m, s, found}, D, 1e-13);
}

/// By the wrench on each link, with the dual part in one of its components after the other.
void check_reactions_by_external(const ksl::model &m, const state &s, ksl::reaction_request request) {
  numbers<int> links;
  for (int l = 0; l < m.view().links; ++l)
    links.push_back(l);
  request.n = m.view().links;
  request.link = links.data();
  const std::size_t rows = 6 * links.size(), columns = 6 * links.size();
  const numbers<T> q(s.q.begin(), s.q.end()), v(s.v.begin(), s.v.end()), a(s.a.begin(), s.a.end());
  numbers<T> dual(rows * columns, T(NAN)), push(columns, T(0.5)), tau(v.size()), out(rows);
  numbers<double> D(rows * columns, NAN);
  using workspace = ksl::reactions_external_derivatives_workspace<double>;
  ksl::reactions_external_derivatives(m.view(), *ksl::owned_workspace<workspace>(m.view()), s.q.data(), request,
                                      D.data());
  const ksl::owned_workspace<ksl::reactions_external_derivatives_workspace<T>> own(m.view());
  ksl::reactions_external_derivatives<T>(m.view(), *own, q.data(), request, dual.data());
  const ksl::owned_workspace<ksl::reactions_workspace<T>> w(m.view());
  double error = 0;
  for (std::size_t c = 0; c < columns; ++c) {
    push[c].derivative[0] = 1;
    ksl::inverse_dynamics_with_reactions<T>(m.view(), *w, q.data(), v.data(), a.data(),
                                            {m.view().links, links.data(), push.data()}, tau.data(), request,
                                            out.data());
    push[c].derivative[0] = 0;
    for (std::size_t r = 0; r < rows; ++r) {
      error = std::fmax(error, std::fabs(out[r].derivative[0] - D[r * columns + c]));
      error = std::fmax(error, std::fabs(dual[r * columns + c].value - D[r * columns + c]));
    }
  }
  CHECK(error <= 1e-13 * largest(D));
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

TEST_CASE("gradient of inverse dynamics: every kind of joint, and random trees") {
  std::mt19937 random(11);
  const ksl::model m = ksl::load(KSL_EVERY_KIND);
  for (int turn = 0; turn < 5; ++turn)
    check_gradient(m, random_state(m, random));
  for (int turn = 0; turn < 40; ++turn) {
    CAPTURE(turn);
    const ksl::model tree = random_tree(2 + turn % 12, random);
    if (tree.nv() > 0)
      check_gradient(tree, random_state(tree, random));
  }
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
    check_reactions_by_external(m, random_state(m, random), request_of(turn, m.view().links));
  }
}
