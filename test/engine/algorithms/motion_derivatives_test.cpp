// Analytic derivatives of motions, energies and momentum against dual numbers through the very algorithms that they are the derivatives
// of, with every kind of joint, on random trees.
#include "derivatives_of.hpp"

#include "ksl/engine/algorithms/derivatives/centroidal_momentum_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/energy_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/frame_motion_derivatives.hpp"
#include "ksl/engine/algorithms/energy/energy.hpp"
#include "ksl/engine/algorithms/kinematics/frame_motion.hpp"
#include "ksl/engine/algorithms/whole_body/centroidal_momentum.hpp"

namespace {

constexpr ksl::component_order order = ksl::component_order::linear_first;

using namespace derivatives;

/// All links, the last first; other axes, points, orders and kinds for every turn.
struct frames_of {
  numbers<int> links;
  ksl::frame_options how;

  frames_of(const ksl::model &m, int turn) {
    for (int l = m.view().links - 1; l >= 0; --l)
      links.push_back(l);
    how.axes = static_cast<ksl::expressed_in>(turn % 2);
    how.at = static_cast<ksl::expressed_in>(turn / 2 % 2);
    how.kind = static_cast<ksl::acceleration_kind>(turn % 3);
    how.angular_first = turn % 5 == 2;
    if (turn % 4 != 1)
      how.offset[0] = 0.3, how.offset[1] = -0.2, how.offset[2] = 0.7;
  }
  int n() const { return static_cast<int>(links.size()); }
};

template <class N> using velocities_workspace = ksl::owned_workspace<ksl::frame_velocities_workspace<N>>;

void check_velocities(const ksl::model &m, const state &s, int turn) {
  const frames_of f(m, turn);
  const std::size_t n = 6 * f.links.size(), size = n * s.v.size();
  const auto twists = [&](const numbers<T> &q, const numbers<T> &v, const numbers<T> &,
                          const ksl::external_wrenches<T> &) {
    numbers<T> out(n);
    ksl::frame_velocities<T>(m.view(), *velocities_workspace<T>(m.view()), q.data(), v.data(), f.n(), f.links.data(),
                             f.how, out.data());
    return out;
  };
  numbers<double> D(3 * size, 0);
  const ksl::owned_workspace<ksl::frame_velocities_derivatives_workspace<double>> w(m.view());
  std::fill_n(D.begin(), 2 * size, NAN);
  ksl::frame_velocities_derivatives(m.view(), *w, s.q.data(), s.v.data(), f.n(), f.links.data(), f.how, D.data(),
                                    &D[size]);
  check_derivatives(function<decltype(twists)>{m, s, twists}, D, 1e-13);
}

void check_accelerations(const ksl::model &m, const state &s, int turn) {
  const frames_of f(m, turn);
  const std::size_t n = 6 * f.links.size(), size = n * s.v.size();
  const auto found = [&](const numbers<T> &q, const numbers<T> &v, const numbers<T> &a,
                         const ksl::external_wrenches<T> &) {
    numbers<T> out(n);
    const ksl::owned_workspace<ksl::frame_accelerations_workspace<T>> w(m.view());
    ksl::frame_accelerations<T>(m.view(), *w, q.data(), v.data(), a.data(), f.n(), f.links.data(), f.how, out.data());
    return out;
  };
  numbers<double> D(3 * size, NAN);
  const ksl::owned_workspace<ksl::frame_accelerations_derivatives_workspace<double>> w(m.view());
  ksl::frame_accelerations_derivatives(m.view(), *w, s.q.data(), s.v.data(), s.a.data(), f.n(), f.links.data(), f.how,
                                       D.data(), &D[size], &D[2 * size]);
  check_derivatives(function<decltype(found)>{m, s, found}, D, 1e-13);
}

void check_momentum(const ksl::model &m, const state &s) {
  const std::size_t size = 6 * s.v.size();
  const auto momentum = [&](const numbers<T> &q, const numbers<T> &v, const numbers<T> &,
                            const ksl::external_wrenches<T> &) {
    numbers<T> out(6);
    const ksl::owned_workspace<ksl::centroidal_momentum_workspace<T>> w(m.view());
    ksl::centroidal_momentum<T>(m.view(), *w, q.data(), v.data(), order, out.data());
    return out;
  };
  numbers<double> D(3 * size, 0);
  std::fill_n(D.begin(), 2 * size, NAN);
  const ksl::owned_workspace<ksl::centroidal_momentum_derivatives_workspace<double>> w(m.view());
  ksl::centroidal_momentum_derivatives(m.view(), *w, s.q.data(), s.v.data(), order, D.data(), &D[size]);
  check_derivatives(function<decltype(momentum)>{m, s, momentum}, D, 1e-13);
}

void check_momentum_rate(const ksl::model &m, const state &s) {
  const std::size_t size = 6 * s.v.size();
  const auto rate = [&](const numbers<T> &q, const numbers<T> &v, const numbers<T> &a,
                        const ksl::external_wrenches<T> &) {
    numbers<T> out(6);
    const ksl::owned_workspace<ksl::centroidal_momentum_rate_workspace<T>> w(m.view());
    ksl::centroidal_momentum_rate<T>(m.view(), *w, q.data(), v.data(), a.data(), order, out.data());
    return out;
  };
  numbers<double> D(3 * size, NAN);
  const ksl::owned_workspace<ksl::centroidal_momentum_rate_derivatives_workspace<double>> w(m.view());
  ksl::centroidal_momentum_rate_derivatives(m.view(), *w, s.q.data(), s.v.data(), s.a.data(), order, D.data(), &D[size],
                                            &D[2 * size]);
  check_derivatives(function<decltype(rate)>{m, s, rate}, D, 1e-13);
}

void check_energy(const ksl::model &m, const state &s) {
  const auto energies = [&](const numbers<T> &q, const numbers<T> &v, const numbers<T> &,
                            const ksl::external_wrenches<T> &) {
    numbers<T> out(2);
    const ksl::owned_workspace<ksl::energy_workspace<T>> w(m.view());
    ksl::energy<T>(m.view(), *w, q.data(), v.data(), &out[0], &out[1]);
    return out;
  };
  const std::size_t n = s.v.size(); // D: of both energies by q, by v, by a
  numbers<double> D(6 * n, 0);
  std::fill_n(D.begin(), 3 * n, NAN);
  const ksl::owned_workspace<ksl::energy_derivatives_workspace<double>> w(m.view());
  ksl::energy_derivatives(m.view(), *w, s.q.data(), s.v.data(), D.data(), &D[2 * n], &D[n]);
  check_derivatives(function<decltype(energies)>{m, s, energies}, D, 1e-13);
}

void check_all(const ksl::model &m, const state &s, int turn) {
  CAPTURE(turn);
  check_velocities(m, s, turn);
  check_accelerations(m, s, turn);
  check_momentum(m, s);
  check_momentum_rate(m, s);
  check_energy(m, s);
}

/// They are templates over any scalar, too: here their own second derivatives exist, and their values are those of plain numbers.
void check_duals(const ksl::model &m, const state &s) {
  const frames_of f(m, 7);
  const std::size_t n = 6 * f.links.size() * s.v.size(), one = 6 * s.v.size(), nv = s.v.size();
  const numbers<T> q(s.q.begin(), s.q.end()), v(s.v.begin(), s.v.end()), a(s.a.begin(), s.a.end());
  numbers<T> dual(5 * n + 5 * one + 3 * nv);
  numbers<double> plain(dual.size());
  const auto fill = [&]<class S>(S *x, const S *p, const S *r, const S *t) {
    const ksl::owned_workspace<ksl::frame_velocities_derivatives_workspace<S>> frames(m.view());
    const ksl::owned_workspace<ksl::centroidal_momentum_derivatives_workspace<S>> momentum(m.view());
    const ksl::owned_workspace<ksl::centroidal_momentum_rate_derivatives_workspace<S>> rate(m.view());
    const ksl::owned_workspace<ksl::energy_derivatives_workspace<S>> energy(m.view());
    using T = S;
    ksl::frame_velocities_derivatives<T>(m.view(), *frames, p, r, f.n(), f.links.data(), f.how, x, x + n);
    ksl::frame_accelerations_derivatives<T>(m.view(), *frames, p, r, t, f.n(), f.links.data(), f.how, x + 2 * n,
                                            x + 3 * n, x + 4 * n);
    x += 5 * n;
    ksl::centroidal_momentum_derivatives<T>(m.view(), *momentum, p, r, order, x, x + one);
    ksl::centroidal_momentum_rate_derivatives<T>(m.view(), *rate, p, r, t, order, x + 2 * one, x + 3 * one,
                                                 x + 4 * one);
    x += 5 * one;
    ksl::energy_derivatives<T>(m.view(), *energy, p, r, x, x + nv, x + 2 * nv);
  };
  fill(dual.data(), q.data(), v.data(), a.data());
  fill(plain.data(), s.q.data(), s.v.data(), s.a.data());
  double error = 0;
  for (std::size_t i = 0; i < dual.size(); ++i)
    error = std::fmax(error, std::fabs(dual[i].value - plain[i]));
  CHECK(error <= 1e-13 * largest(plain));
}

} // namespace

TEST_CASE("derivatives of motions, momentum and energy: every kind of joint") {
  std::mt19937 random(5);
  const ksl::model m = ksl::load(KSL_EVERY_KIND);
  for (int turn = 0; turn < 12; ++turn)
    check_all(m, random_state(m, random), turn);
  check_duals(m, random_state(m, random));
}

TEST_CASE("derivatives of motions, momentum and energy: random trees") {
  std::mt19937 random(6);
  for (int turn = 0; turn < 48; ++turn) {
    const ksl::model m = random_tree(2 + turn % 13, random);
    if (m.nv() > 0)
      check_all(m, random_state(m, random), turn);
  }
}
