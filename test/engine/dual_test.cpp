// Dual numbers through every algorithm and every kind of joint: against identities that need no difference quotient, and
// against central differences.
#include "moved.hpp"
#include "robots.hpp"

#include "ksl/dual.hpp"
#include "ksl/engine/algorithms/derivatives/inverse_dynamics_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/reactions_derivatives.hpp"
#include "ksl/engine/algorithms/energy/energy.hpp"
#include "ksl/engine/algorithms/forward/forward_dynamics.hpp"
#include "ksl/engine/algorithms/kinematics/frame_jacobian.hpp"
#include "ksl/engine/algorithms/manifold/manifold.hpp"
#include "ksl/engine/algorithms/mass/mass_matrix.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

namespace {

using first = ksl::dual<1>;
using second = ksl::second_order_dual<2>;
template <class T> using numbers = std::vector<T>;
using robots::moved;

const ksl::model &robot() {
  static const ksl::model m = ksl::load(KSL_EVERY_KIND);
  return m;
}

/// Where a state is, how it moves, and what pushes: two wrenches.
template <class T> struct state { numbers<T> q, v, a, push; };

constexpr int pushed_links[2] = {4, 7};

template <class T> ksl::external_wrenches<T> pushes(const numbers<T> &push) { return {2, pushed_links, push.data()}; }

numbers<double> random_numbers(std::size_t n, std::mt19937 &random) {
  std::normal_distribution<double> normal;
  numbers<double> x(n);
  for (double &y : x)
    y = normal(random);
  return x;
}

state<double> random_state(const ksl::model &m, std::mt19937 &random) {
  const std::size_t nq = static_cast<std::size_t>(m.nq()), nv = static_cast<std::size_t>(m.nv());
  state<double> s = {random_numbers(nq, random), random_numbers(nv, random), random_numbers(nv, random),
                     random_numbers(12, random)};
  robots::normalize_quaternions(m, s.q.data());
  return s;
}

template <class T> numbers<T> constants(const numbers<double> &x) { return numbers<T>(x.begin(), x.end()); }

/// x with derivatives `rate` in direction 0.
numbers<first> along(const numbers<double> &x, const numbers<double> &rate) {
  numbers<first> out = constants<first>(x);
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i].derivative[0] = rate[i];
  return out;
}

numbers<double> unit(std::size_t n, std::size_t i) {
  numbers<double> x(n, 0.0);
  x[i] = 1;
  return x;
}

template <class T> numbers<T> efforts(const ksl::model &m, const state<T> &s, bool pushed = true) {
  const ksl::owned_workspace<ksl::inverse_dynamics_workspace<T>> w(m.view());
  numbers<T> tau(s.v.size());
  ksl::inverse_dynamics<T>(m.view(), *w, s.q.data(), s.v.data(), s.a.data(),
                           pushed ? pushes(s.push) : ksl::external_wrenches<T>{}, tau.data());
  return tau;
}

/// Accelerations; s.a holds the efforts.
template <class T> numbers<T> accelerations(const ksl::model &m, const state<T> &s) {
  const ksl::owned_workspace<ksl::forward_dynamics_workspace<T>> w(m.view());
  numbers<T> a(s.v.size());
  ksl::forward_dynamics<T>(m.view(), *w, s.q.data(), s.v.data(), s.a.data(), pushes(s.push), a.data());
  return a;
}

template <class T> numbers<T> inertias(const ksl::model &m, const numbers<T> &q) {
  const ksl::owned_workspace<ksl::mass_matrix_workspace<T>> w(m.view());
  numbers<T> M(static_cast<std::size_t>(m.nv() * m.nv()));
  ksl::mass_matrix<T>(m.view(), *w, q.data(), M.data());
  return M;
}

/// Derivatives of the efforts by q, v and a.
template <class T> numbers<T> derivatives_of_efforts(const ksl::model &m, const state<T> &s) {
  const ksl::owned_workspace<ksl::inverse_dynamics_derivatives_workspace<T>> w(m.view());
  const std::size_t n = s.v.size() * s.v.size();
  numbers<T> D(3 * n);
  ksl::inverse_dynamics_derivatives<T>(m.view(), *w, s.q.data(), s.v.data(), s.a.data(), pushes(s.push), &D[0], &D[n],
                                       &D[2 * n]);
  return D;
}

numbers<int> all_links(const ksl::model &m) {
  numbers<int> links;
  for (int l = 0; l < m.view().links; ++l)
    links.push_back(l);
  return links;
}

/// Derivatives of all reactions by q, v and a.
template <class T> numbers<T> derivatives_of_reactions(const ksl::model &m, const state<T> &s) {
  const ksl::owned_workspace<ksl::reactions_derivatives_workspace<T>> w(m.view());
  const numbers<int> links = all_links(m);
  ksl::reaction_request request;
  request.n = m.view().links;
  request.link = links.data();
  const std::size_t n = 6 * links.size() * s.v.size();
  numbers<T> D(3 * n);
  ksl::reactions_derivatives<T>(m.view(), *w, s.q.data(), s.v.data(), s.a.data(), request, pushes(s.push), &D[0], &D[n],
                                &D[2 * n]);
  return D;
}

template <class T> struct energies { T kinetic, potential; };

template <class T> energies<T> energy_of(const ksl::model &m, const numbers<T> &q, const numbers<T> &v) {
  const ksl::owned_workspace<ksl::energy_workspace<T>> w(m.view());
  energies<T> e;
  ksl::energy<T>(m.view(), *w, q.data(), v.data(), &e.kinetic, &e.potential);
  return e;
}

template <class T> T power(const ksl::model &m, const state<T> &s) {
  const ksl::owned_workspace<ksl::external_power_workspace<T>> w(m.view());
  T power;
  ksl::external_power<T>(m.view(), *w, s.q.data(), s.v.data(), pushes(s.push), &power);
  return power;
}

/// Poses of all links, 16 numbers each.
template <class T> numbers<T> poses(const ksl::model &m, const numbers<T> &q) {
  const ksl::owned_workspace<ksl::forward_kinematics_workspace<T>> w(m.view());
  const numbers<int> links = all_links(m);
  numbers<T> out(16 * links.size());
  ksl::frame_poses<T>(m.view(), *w, q.data(), m.view().links, links.data(), out.data());
  return out;
}

/// The Jacobian of a link's frame, 6 × nv numbers.
template <class T> numbers<T> jacobian_of(const ksl::model &m, const numbers<T> &q, int link,
                                          const ksl::frame_options &how = {}) {
  const ksl::owned_workspace<ksl::jacobian_workspace<T>> w(m.view());
  numbers<T> J(6 * static_cast<std::size_t>(m.nv()));
  ksl::jacobian<T>(m.view(), *w, q.data(), link, how, J.data());
  return J;
}

/// Reactions of all links' joints, as they are in the joints' frames and at the world's origin.
template <class T> numbers<T> reactions_of(const ksl::model &m, const state<T> &s) {
  const ksl::owned_workspace<ksl::reactions_workspace<T>> w(m.view());
  numbers<T> tau(s.v.size()), out;
  ksl::inverse_dynamics<T>(m.view(), w->dynamics, s.q.data(), s.v.data(), s.a.data(), pushes(s.push), tau.data());
  const numbers<int> links = all_links(m);
  ksl::reaction_request request;
  request.n = m.view().links;
  request.link = links.data();
  for (ksl::wrench_frame frame : {ksl::wrench_frame::joint, ksl::wrench_frame::world}) {
    request.at = request.axes = frame;
    numbers<T> wrenches(6 * links.size());
    ksl::reactions<T>(m.view(), *w, pushes(s.push), request, wrenches.data());
    out.insert(out.end(), wrenches.begin(), wrenches.end());
  }
  return out;
}

/// Efforts and reactions in one pass.
template <class T> numbers<T> efforts_with_reactions(const ksl::model &m, const state<T> &s) {
  const ksl::owned_workspace<ksl::reactions_workspace<T>> w(m.view());
  const numbers<int> links = all_links(m);
  ksl::reaction_request request;
  request.n = m.view().links;
  request.link = links.data();
  numbers<T> out(s.v.size() + 6 * links.size());
  ksl::inverse_dynamics_with_reactions<T>(m.view(), *w, s.q.data(), s.v.data(), s.a.data(), pushes(s.push), out.data(),
                                          request, out.data() + s.v.size());
  return out;
}

/// Positions from q along v, and between q and another position, and the derivatives of both.
template <class T> numbers<T> manifold_of(const ksl::model &m, const state<T> &s) {
  const std::size_t nq = s.q.size(), nv = s.v.size();
  const numbers<T> other(nq, T(0.3));
  const T fraction = T(0.4);
  numbers<T> out(2 * nq + nv + 4 * nv * nv);
  T *const moved = out.data(), *const between = moved + nq, *const dv = between + nq, *const J = dv + nv;
  ksl::integrate<T>(m.view(), {}, s.q.data(), s.v.data(), moved);
  ksl::interpolate<T>(m.view(), {}, s.q.data(), other.data(), &fraction, between);
  ksl::difference<T>(m.view(), {}, s.q.data(), other.data(), dv);
  ksl::integrate_jacobians<T>(m.view(), {}, s.q.data(), s.v.data(), J, J + nv * nv);
  ksl::difference_jacobians<T>(m.view(), {}, s.q.data(), other.data(), J + 2 * nv * nv, J + 3 * nv * nv);
  return out;
}

/// The results of every algorithm.
template <class T> numbers<T> everything(const ksl::model &m, const state<T> &s) {
  numbers<T> all;
  const auto add = [&](const numbers<T> &part) { all.insert(all.end(), part.begin(), part.end()); };
  add(efforts(m, s));
  add(reactions_of(m, s));
  add(efforts_with_reactions(m, s));
  add(accelerations(m, s));
  add(inertias(m, s.q));
  add(derivatives_of_efforts(m, s));
  add(derivatives_of_reactions(m, s));
  add(poses(m, s.q));
  add(manifold_of(m, s));
  const energies<T> e = energy_of(m, s.q, s.v);
  add({e.kinetic, e.potential, power(m, s)});
  for (int link : pushed_links)
    for (ksl::expressed_in at : {ksl::expressed_in::frame, ksl::expressed_in::world})
      add(jacobian_of(m, s.q, link, {ksl::expressed_in::frame, at, false}));
  return all;
}

double largest(const numbers<double> &x) {
  double out = 1;
  for (double y : x)
    out = std::fmax(out, std::fabs(y));
  return out;
}

numbers<double> derivatives(const numbers<first> &x) {
  numbers<double> out;
  for (const first &y : x)
    out.push_back(y.derivative[0]);
  return out;
}

void check_close(const numbers<double> &found, const numbers<double> &expected, double tolerance) {
  REQUIRE(found.size() == expected.size());
  const double scale = largest(expected);
  for (std::size_t i = 0; i < found.size(); ++i) {
    CAPTURE(i);
    CHECK(std::fabs(found[i] - expected[i]) <= tolerance * scale);
  }
}

} // namespace

TEST_CASE("dual numbers have the values of plain ones, to the bit") {
  std::mt19937 random(1);
  const state<double> s = random_state(robot(), random);
  const state<first> d = {constants<first>(s.q), constants<first>(s.v), constants<first>(s.a),
                          constants<first>(s.push)};
  const numbers<double> plain = everything(robot(), s);
  const numbers<first> dual = everything(robot(), d);
  REQUIRE(plain.size() == dual.size());
  for (std::size_t i = 0; i < plain.size(); ++i) {
    CAPTURE(i);
    CHECK(dual[i].value == plain[i]);
    CHECK(dual[i].derivative[0] == 0);
  }
}

TEST_CASE("derivatives of every algorithm are the limits of difference quotients") {
  std::mt19937 random(2);
  const ksl::model &m = robot();
  const state<double> s = random_state(m, random);
  for (int turn = 0; turn < 4; ++turn) {
    const numbers<double> x = random_numbers(s.v.size(), random), dv = random_numbers(s.v.size(), random),
                          da = random_numbers(s.v.size(), random), df = random_numbers(12, random);
    const auto at = [&](double h) {
      const auto shifted = [h](numbers<double> y, const numbers<double> &rate) {
        for (std::size_t i = 0; i < y.size(); ++i)
          y[i] += h * rate[i];
        return y;
      };
      const numbers<double> zero(x.size(), 0.0);
      return everything<double>(
          m, {moved(m, s.q, shifted(zero, x)), shifted(s.v, dv), shifted(s.a, da), shifted(s.push, df)});
    };
    const double h = 1e-3; // central differences, extrapolated: the error is h⁴
    const numbers<double> p1 = at(h), m1 = at(-h), p2 = at(2 * h), m2 = at(-2 * h);
    numbers<double> expected;
    for (std::size_t i = 0; i < p1.size(); ++i)
      expected.push_back((8 * (p1[i] - m1[i]) - (p2[i] - m2[i])) / (12 * h));
    const numbers<first> tangent = along(numbers<double>(x.size(), 0.0), x);
    const state<first> moving = {moved(m, s.q, tangent), along(s.v, dv), along(s.a, da), along(s.push, df)};
    check_close(derivatives(everything(m, moving)), expected, 1e-8);
  }
}

TEST_CASE("the derivative of efforts by accelerations is the mass matrix") {
  std::mt19937 random(3);
  const ksl::model &m = robot();
  const state<double> s = random_state(m, random);
  const numbers<double> M = inertias(m, s.q);
  const std::size_t nv = s.v.size();
  for (std::size_t i = 0; i < nv; ++i) {
    const state<first> moving = {constants<first>(s.q), constants<first>(s.v), along(s.a, unit(nv, i)),
                                 constants<first>(s.push)};
    const auto row = M.begin() + static_cast<std::ptrdiff_t>(i * nv);
    check_close(derivatives(efforts(m, moving)), numbers<double>(row, row + static_cast<std::ptrdiff_t>(nv)), 1e-13);
  }
}

TEST_CASE("the rate of the energy is the power of the joints and of the environment") {
  std::mt19937 random(4);
  const ksl::model &m = robot();
  for (int turn = 0; turn < 10; ++turn) {
    const state<double> s = random_state(m, random);
    const numbers<first> tangent = along(numbers<double>(s.v.size(), 0.0), s.v);
    const energies<first> e = energy_of(m, moved(m, s.q, tangent), along(s.v, s.a));
    const numbers<double> tau = efforts(m, s);
    double joints = 0, size = 0;
    for (std::size_t i = 0; i < tau.size(); ++i)
      joints += tau[i] * s.v[i], size += std::fabs(tau[i] * s.v[i]);
    CHECK(std::fabs((e.kinetic + e.potential).derivative[0] - (joints + power(m, s))) <= 1e-13 * size);
  }
}

TEST_CASE("the gradient of the potential energy is the effort that holds the mechanism at rest") {
  std::mt19937 random(5);
  const ksl::model &m = robot();
  state<double> s = random_state(m, random);
  s.v.assign(s.v.size(), 0.0), s.a = s.v;
  numbers<double> gradient;
  for (std::size_t i = 0; i < s.v.size(); ++i)
    gradient.push_back(
        energy_of(m, moved(m, s.q, along(s.v, unit(s.v.size(), i))), constants<first>(s.v)).potential.derivative[0]);
  check_close(gradient, efforts(m, s, false), 1e-13);
}

TEST_CASE("the power of external wrenches depends on velocities by the efforts they take off the joints") {
  std::mt19937 random(6);
  const ksl::model &m = robot();
  const state<double> s = random_state(m, random);
  const numbers<double> without = efforts(m, s, false), with = efforts(m, s);
  numbers<double> taken, slopes;
  for (std::size_t i = 0; i < s.v.size(); ++i) {
    taken.push_back(without[i] - with[i]);
    const state<first> moving = {constants<first>(s.q), along(s.v, unit(s.v.size(), i)), constants<first>(s.a),
                                 constants<first>(s.push)};
    slopes.push_back(power(m, moving).derivative[0]);
  }
  check_close(slopes, taken, 1e-12);
}

TEST_CASE("forward dynamics of the efforts gives back the accelerations, and so do all derivatives") {
  std::mt19937 random(7);
  const ksl::model &m = robot();
  for (int turn = 0; turn < 4; ++turn) {
    const state<double> s = random_state(m, random);
    const numbers<double> x = random_numbers(s.v.size(), random), dv = random_numbers(s.v.size(), random),
                          da = random_numbers(s.v.size(), random), df = random_numbers(12, random);
    const numbers<first> tangent = along(numbers<double>(x.size(), 0.0), x);
    state<first> moving = {moved(m, s.q, tangent), along(s.v, dv), along(s.a, da), along(s.push, df)};
    moving.a = efforts(m, moving);
    const numbers<first> a = accelerations(m, moving);
    check_close(derivatives(a), da, 1e-9);
  }
}

TEST_CASE("links move as the derivative of their poses says") {
  std::mt19937 random(8);
  const ksl::model &m = robot();
  const state<double> s = random_state(m, random);
  const numbers<first> D = poses(m, moved(m, s.q, along(numbers<double>(s.v.size(), 0.0), s.v)));
  for (int link : pushed_links) {
    const first *const R = &D[16 * static_cast<std::size_t>(link)]; // row-major, with the position in the last column
    numbers<double> twist(6, 0.0);                                  // Rᵀ ṗ, and Rᵀ Ṙ = ω̃
    for (int k = 0; k < 3; ++k)
      for (int r = 0; r < 3; ++r) {
        twist[static_cast<std::size_t>(k)] += R[4 * r + k].value * R[4 * r + 3].derivative[0];
        twist[static_cast<std::size_t>(3 + k)] += R[4 * r + (k + 2) % 3].value * R[4 * r + (k + 1) % 3].derivative[0];
      }
    const numbers<double> J = jacobian_of(m, s.q, link);
    for (std::size_t c = 0; c < 6; ++c) {
      double rate = 0;
      for (std::size_t i = 0; i < s.v.size(); ++i)
        rate += J[c * s.v.size() + i] * s.v[i];
      CHECK(rate == doctest::Approx(twist[c]).epsilon(1e-12));
    }
    for (std::size_t c = 0; c < 6; ++c) { // a wrench of one has the power of one component
      state<double> one = s;
      one.push = unit(12, link == pushed_links[0] ? c : 6 + c);
      CHECK(power(m, one) == doctest::Approx(twist[c]).epsilon(1e-12));
    }
  }
}

TEST_CASE("the second derivative of the kinetic energy by velocities is the mass matrix, and symmetric") {
  std::mt19937 random(9);
  const ksl::model &m = robot();
  const state<double> s = random_state(m, random);
  const numbers<double> M = inertias(m, s.q);
  const numbers<second> q = constants<second>(s.q);
  for (std::size_t i = 0; i < s.v.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      numbers<second> v = constants<second>(s.v);
      v[i] = ksl::second_order_variable<2>(s.v[i], 0), v[j] = ksl::second_order_variable<2>(s.v[j], 1);
      const second kinetic = energy_of(m, q, v).kinetic;
      CHECK(std::fabs(kinetic.derivative[0].derivative[1] - M[i * s.v.size() + j]) <= 1e-13 * largest(M));
      CHECK(kinetic.derivative[0].derivative[1] == doctest::Approx(kinetic.derivative[1].derivative[0]).epsilon(1e-12));
      CHECK(std::fabs(kinetic.derivative[0].derivative[0] - M[i * s.v.size() + i]) <= 1e-13 * largest(M));
    }
}

TEST_CASE("second derivatives of the energy along the manifold are symmetric, and those of its gradient") {
  std::mt19937 random(10);
  const ksl::model &m = robot();
  const state<double> s = random_state(m, random);
  const std::size_t nv = s.v.size();
  const numbers<second> v = constants<second>(s.v);
  for (std::size_t i = 0; i < nv; ++i) {
    const std::size_t j = (5 * i + 3) % nv;
    numbers<second> x(nv, second(0));
    x[i] = ksl::second_order_variable<2>(0.0, 0);
    x[j] = x[j] + ksl::second_order_variable<2>(0.0, 1);
    const energies<second> e = energy_of(m, moved(m, s.q, x), v);
    const second sum = e.kinetic + e.potential;
    CHECK(std::fabs(sum.derivative[0].derivative[1] - sum.derivative[1].derivative[0]) <=
          1e-12 * std::fabs(sum.value.value));
    const auto gradient = [&](double h) { // ∂/∂x_i at h in direction j
      numbers<first> y(nv, first(0));
      y[j] = first(h);
      y[i] = y[i] + first::variable(0.0, 0);
      const energies<first> f = energy_of(m, moved(m, s.q, y), constants<first>(s.v));
      return (f.kinetic + f.potential).derivative[0];
    };
    const double h = 1e-3;
    const double quotient = (8 * (gradient(h) - gradient(-h)) - (gradient(2 * h) - gradient(-2 * h))) / (12 * h);
    CHECK(std::fabs(sum.derivative[0].derivative[1] - quotient) <= 1e-8 * std::fabs(sum.value.value));
  }
}

TEST_CASE("inverse dynamics of an arm is Lagrange's equation of its energies") {
  const ksl::model m = ksl::load(KSL_EXAMPLES "/robots/panda.urdf"); // revolute and prismatic, on the ground
  std::mt19937 random(11);
  const state<double> s = random_state(m, random);
  const numbers<double> tau = efforts(m, s, false);
  numbers<double> lagrange;
  for (std::size_t i = 0; i < s.v.size();
       ++i) { // d/dt ∂L/∂v_i − ∂L/∂q_i: direction 0 is time, 1 the coordinate's velocity
    numbers<second> q = constants<second>(s.q), v = constants<second>(s.v);
    for (std::size_t k = 0; k < q.size(); ++k) {
      q[k].derivative[0] = ksl::dual<2>(s.v[k]), q[k].value.derivative[0] = s.v[k];
      v[k].derivative[0] = ksl::dual<2>(s.a[k]), v[k].value.derivative[0] = s.a[k];
    }
    v[i] = v[i] + ksl::second_order_variable<2>(0.0, 1);
    const energies<first> f = energy_of(m, along(s.q, unit(s.q.size(), i)), constants<first>(s.v));
    const energies<second> e = energy_of(m, q, v);
    lagrange.push_back((e.kinetic - e.potential).derivative[0].derivative[1] - (f.kinetic - f.potential).derivative[0]);
  }
  check_close(lagrange, tau, 1e-13);
}

TEST_CASE("states in lanes, with a derivative each") {
  using P = ksl::native_pack<double>;
  using T = ksl::dual<1, P>;
  std::mt19937 random(12);
  const ksl::model &m = robot();
  state<T> lanes;
  numbers<state<first>> one;
  for (int lane = 0; lane < ksl::native_lanes<double>; ++lane) {
    const state<double> s = random_state(m, random);
    const numbers<first> tangent = along(numbers<double>(s.v.size(), 0.0), random_numbers(s.v.size(), random));
    one.push_back({moved(m, s.q, tangent), constants<first>(s.v), constants<first>(s.a), constants<first>(s.push)});
  }
  const auto gather = [&](auto part) {
    numbers<T> out((one[0].*part).size(), T(0));
    for (std::size_t i = 0; i < out.size(); ++i)
      for (int lane = 0; lane < ksl::native_lanes<double>; ++lane) {
        const first &x = (one[static_cast<std::size_t>(lane)].*part)[i];
        out[i].value.set(lane, x.value), out[i].derivative[0].set(lane, x.derivative[0]);
      }
    return out;
  };
  lanes = {gather(&state<first>::q), gather(&state<first>::v), gather(&state<first>::a), gather(&state<first>::push)};
  const numbers<T> tau = efforts(m, lanes);
  for (int lane = 0; lane < ksl::native_lanes<double>; ++lane) {
    const numbers<first> expected = efforts(m, one[static_cast<std::size_t>(lane)]);
    for (std::size_t i = 0; i < tau.size(); ++i) {
      CHECK(tau[i].value[lane] == expected[i].value);
      CHECK(tau[i].derivative[0][lane] == expected[i].derivative[0]);
    }
  }
}

TEST_CASE("functions of a dual number") {
  using f = ksl::math<second>;
  const auto check = [](const second &y, double value, double slope, double curvature) {
    CHECK(y.value.value == doctest::Approx(value).epsilon(1e-15));
    CHECK(y.derivative[0].value == doctest::Approx(slope).epsilon(1e-14));
    CHECK(y.value.derivative[0] == doctest::Approx(slope).epsilon(1e-14));
    CHECK(y.derivative[0].derivative[0] == doctest::Approx(curvature).epsilon(1e-14));
    CHECK(y.derivative[1].value == 0);
  };
  for (double at : {0.7, 2.3}) {
    const second x = ksl::second_order_variable<2>(at, 0);
    const double s = std::sin(at), c = std::cos(at), squares = at * at + 9;
    check(f::sqrt(x), std::sqrt(at), 0.5 / std::sqrt(at), -0.25 * std::pow(at, -1.5));
    check(second(1) / x, 1 / at, -1 / (at * at), 2 / (at * at * at));
    check(x * x * x, at * at * at, 3 * at * at, 6 * at);
    check(f::sin(x), s, c, -s);
    check(f::cos(x), c, -s, -c);
    check(f::atan2(x, second(3)), std::atan2(at, 3), 3 / squares, -6 * at / (squares * squares));
    check(f::atan2(second(3), x), std::atan2(3, at), -3 / squares, 6 * at / (squares * squares));
    check(f::fabs(-x * x), at * at, 2 * at, 2);
    check(f::select(x < second(1), x, x * x), at < 1 ? at : at * at, at < 1 ? 1 : 2 * at, at < 1 ? 0 : 2);
    second sine, cosine;
    ksl::sine_cosine(x, sine, cosine);
    check(sine, s, c, -s);
    check(cosine, c, -s, -c);
  }
}

TEST_CASE("operations on many numbers, which are called instead of inlined, and comparisons") {
  using many = ksl::dual<20>;
  const many x = many::variable(0.7, 19), y = many::variable(2, 0);
  const many product = x * y, quotient = x / y;
  CHECK((product.value == 1.4 && product.derivative[19] == 2 && product.derivative[0] == 0.7 &&
         product.derivative[7] == 0));
  CHECK((quotient.value == 0.35 && quotient.derivative[19] == 0.5 &&
         quotient.derivative[0] == doctest::Approx(-0.175).epsilon(1e-15)));
  CHECK((y >= x && x >= x && !(x >= y))); // by the values alone
}

TEST_CASE("constants of double precision become those of a dual number in single precision") {
  const ksl::dual<2, float> x(0.1);
  CHECK((x.value == 0.1f && x.derivative[0] == 0 && x.derivative[1] == 0));
}

TEST_CASE("the exponential of a screw at zero has the screw as its derivative") {
  const ksl::screw<first> s = {{first::variable(0, 0), first(0), first(0)},
                               {first(0), first(0), 2.0 * first::variable(0, 0)}};
  ksl::SE3<first> D;
  ksl::algebra<first>::SE3_exp(&s, &D);
  CHECK(D.t.x.derivative[0] == 1);
  CHECK(D.R.m10.derivative[0] == 2);
  CHECK(D.R.m01.derivative[0] == -2);
  CHECK(D.R.m00.derivative[0] == 0);
  CHECK(D.R.m00.value == 1);
}
