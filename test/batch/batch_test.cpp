// Batches: tails, strides, threads, and one bad state among good ones.
#include "ksl/batch.hpp"
#include "robots.hpp"

#include "batch/threads.hpp"
#include "engine/kernels/forms.hpp"
#include "ksl/engine/algorithms/mass/mass_matrix.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace {

constexpr int reach = 40; ///< more than two blocks of any instruction set

/// A branched robot with every kind of joint.
ksl::model tree() { return ksl::load(every_kind_file); }

template <class S> struct states {
  std::vector<S> q, v, a;

  states(const ksl::model &m, std::size_t n)
      : q(n * static_cast<std::size_t>(m.nq())), v(n * static_cast<std::size_t>(m.nv())), a(v.size()) {
    std::mt19937 random(3);
    std::uniform_real_distribution<S> number(S(-2), S(2));
    for (std::vector<S> *x : {&q, &v, &a})
      for (S &value : *x)
        value = number(random);
    for (std::size_t k = 0; k < n; ++k)
      robots::normalize_quaternions(m, &q[k * static_cast<std::size_t>(m.nq())]);
  }

  ksl::batch_view<S> view(const ksl::model &m, std::size_t n, std::vector<S> &out, int width) {
    ksl::batch_view<S> b;
    out.assign(n * static_cast<std::size_t>(width), S(-7));
    b.n = n;
    b.q = {q.data(), m.nq()};
    b.v = {v.data(), m.nv()};
    b.a = b.tau = {a.data(), m.nv()};
    b.result[0] = {out.data(), width};
    return b;
  }
};

template <class S> void compare_with_one(const ksl::model &m, std::size_t n) {
  const int nv = m.nv();
  states<S> s(m, n);
  std::vector<S> tau, a, M, one;
  ksl::inverse_dynamics_batch(m, s.view(m, n, tau, nv));
  ksl::forward_dynamics_batch(m, s.view(m, n, a, nv));
  ksl::mass_matrix_batch(m, s.view(m, n, M, nv * nv));
  for (std::size_t k = 0; k < n; ++k) {
    ksl::batch_view<S> b = s.view(m, 1, one, nv * nv);
    b.q = rows_from(b.q, k), b.v = rows_from(b.v, k), b.a = rows_from(b.a, k), b.tau = rows_from(b.tau, k);
    CAPTURE(n);
    CAPTURE(k);
    ksl::inverse_dynamics_batch(m, b);
    CHECK(std::equal(one.begin(), one.begin() + nv, tau.begin() + static_cast<long>(k) * nv));
    ksl::forward_dynamics_batch(m, b);
    CHECK(std::equal(one.begin(), one.begin() + nv, a.begin() + static_cast<long>(k) * nv));
    ksl::mass_matrix_batch(m, b);
    CHECK(std::equal(one.begin(), one.end(), M.begin() + static_cast<long>(k) * nv * nv));
  }
}

/// Not in order; the one that is welded, and one twice.
const std::vector<int> some_links = {4, 9, 0, 2, 4};
constexpr int pose_numbers = 5 * 16;
const int pushed = 4; ///< a link with an external wrench

/// Poses (n, links, 4, 4), kinetic and potential energies and powers of external wrenches (n each) of a batch.
template <class S> struct positions_and_energies {
  std::vector<S> poses, kinetic, potential, power;
  bool operator==(const positions_and_energies &) const = default;
};

/// The part of a batch that has the states [k, k + n).
template <class S> positions_and_energies<S> found_in(const ksl::model &m, states<S> &s, std::size_t k, std::size_t n,
                                                      int threads) {
  positions_and_energies<S> r;
  r.kinetic.assign(n, S(-7)), r.potential = r.kinetic;
  ksl::batch_view<S> b = s.view(m, n, r.poses, pose_numbers);
  b.q = rows_from(b.q, k), b.v = rows_from(b.v, k);
  b.links = {static_cast<int>(some_links.size()), some_links.data()};
  ksl::frame_poses_batch(m, b, threads);
  b.result[0] = {r.kinetic.data(), 1}, b.result[1] = {r.potential.data(), 1};
  ksl::energy_batch(m, b, threads);
  r.power.assign(n, S(-7));
  b.result[0] = {r.power.data(), 1};
  const ksl::external_rows<S> push = {pushed, b.q}; // any six numbers of each state
  b.external_n = 1, b.external = &push;
  ksl::external_power_batch(m, b, threads);
  return r;
}

template <class S> void compare_positions_and_energies_with_one(const ksl::model &m, std::size_t n) {
  states<S> s(m, n);
  const positions_and_energies<S> all = found_in(m, s, 0, n, 0);
  for (std::size_t k = 0; k < n; ++k) {
    CAPTURE(n);
    CAPTURE(k);
    const positions_and_energies<S> one = found_in(m, s, k, 1, 0);
    CHECK(std::equal(one.poses.begin(), one.poses.end(), all.poses.begin() + static_cast<long>(k) * pose_numbers));
    CHECK(one.kinetic[0] == all.kinetic[k]);
    CHECK(one.potential[0] == all.potential[k]);
    CHECK(one.power[0] == all.power[k]);
  }
}

} // namespace

TEST_CASE("any number of states gives the bits of each alone, double and float") {
  const ksl::model m = tree();
  for (std::size_t n = 0; n <= reach; ++n) {
    compare_with_one<double>(m, n);
    compare_with_one<float>(m, n);
    compare_positions_and_energies_with_one<double>(m, n);
    compare_positions_and_energies_with_one<float>(m, n);
  }
}

TEST_CASE("poses, energies and powers of a batch are those of dynamics.hpp") {
  const ksl::model m = tree();
  ksl::data d(m);
  const std::size_t n = 11, nq = static_cast<std::size_t>(m.nq()), nv = static_cast<std::size_t>(m.nv());
  states<double> s(m, n);
  const positions_and_energies<double> all = found_in(m, s, 0, n, 1);
  for (std::size_t k = 0; k < n; ++k) {
    const double *q = &s.q[k * nq], *v = &s.v[k * nv], *poses = &all.poses[k * pose_numbers];
    double alone[pose_numbers], kinetic, potential;
    ksl::frame_poses(m, d, q, static_cast<int>(some_links.size()), some_links.data(), alone);
    CHECK(std::equal(alone, alone + pose_numbers, poses));
    ksl::energy(m, d, q, v, &kinetic, &potential);
    CHECK(kinetic == all.kinetic[k]);
    CHECK(potential == all.potential[k]);
    double power;
    ksl::external_power(m, d, q, v, &power, {1, &pushed, q});
    CHECK(power == all.power[k]);
    for (std::size_t i = 0; i < some_links.size(); ++i) {
      const ksl::SE3<double> D = ksl::frame_pose(m, d, q, some_links[i]);
      const double rows[16] = {D.R.m00, D.R.m01, D.R.m02, D.t.x, D.R.m10, D.R.m11, D.R.m12, D.t.y,
                               D.R.m20, D.R.m21, D.R.m22, D.t.z, 0,       0,       0,       1};
      CHECK(std::equal(rows, rows + 16, poses + 16 * i));
    }
  }
}

TEST_CASE("the number of threads changes nothing") {
  ksl::assume_cores(7);
  const ksl::model m = tree();
  const std::size_t n = 5000;
  states<double> s(m, n);
  std::vector<double> alone, shared;
  ksl::inverse_dynamics_batch(m, s.view(m, n, alone, m.nv()), 1);
  for (int threads : {0, 2, 3, 7}) {
    ksl::inverse_dynamics_batch(m, s.view(m, n, shared, m.nv()), threads);
    CHECK(shared == alone);
  }
  states<float> single(m, n);
  const auto double_alone = found_in(m, s, 0, n, 1);
  const auto single_alone = found_in(m, single, 0, n, 1);
  for (int threads : {0, 2, 3, 7}) {
    CHECK(found_in(m, s, 0, n, threads) == double_alone);
    CHECK(found_in(m, single, 0, n, threads) == single_alone);
  }
}

TEST_CASE("a NaN poisons its own state only") {
  const ksl::model m = tree();
  const std::size_t n = 19, bad = 9;
  states<double> s(m, n);
  std::vector<double> clean, poisoned;
  ksl::forward_dynamics_batch(m, s.view(m, n, clean, m.nv()));
  const auto whole = found_in(m, s, 0, n, 1);
  s.q[bad * static_cast<std::size_t>(m.nq()) + 3] = NAN; // turns all that moves
  ksl::forward_dynamics_batch(m, s.view(m, n, poisoned, m.nv()));
  for (std::size_t k = 0; k < n; ++k)
    for (int i = 0; i < m.nv(); ++i) {
      const std::size_t at = k * static_cast<std::size_t>(m.nv()) + static_cast<std::size_t>(i);
      if (k != bad)
        CHECK(poisoned[at] == clean[at]);
    }
  CHECK(std::isnan(poisoned[bad * static_cast<std::size_t>(m.nv())]));

  const auto spoilt = found_in(m, s, 0, n, 1);
  for (std::size_t k = 0; k < n; ++k) {
    const auto row = [&](const auto &r) { return r.poses.begin() + static_cast<long>(k) * pose_numbers; };
    const bool kept = std::equal(row(spoilt), row(spoilt) + pose_numbers, row(whole));
    CHECK(kept == (k != bad));
    CHECK(std::isnan(spoilt.kinetic[k]) == (k == bad));
    CHECK(std::isnan(spoilt.potential[k]) == (k == bad));
    CHECK(std::isnan(spoilt.power[k]) == (k == bad));
    CHECK((spoilt.kinetic[k] == whole.kinetic[k] && spoilt.power[k] == whole.power[k]) == (k != bad));
  }
}

TEST_CASE("rows may run backwards and lie apart; nothing is written between them") {
  const ksl::model m = tree();
  const std::size_t n = 21, nv = static_cast<std::size_t>(m.nv()), apart = nv + 3;
  states<double> s(m, n);
  std::vector<double> straight, spread(n * apart, -7.0);
  ksl::inverse_dynamics_batch(m, s.view(m, n, straight, m.nv()));
  ksl::batch_view<double> b = s.view(m, n, straight, m.nv());
  b.result[0] = {spread.data() + (n - 1) * apart, -static_cast<std::ptrdiff_t>(apart)};
  std::vector<double> wanted;
  ksl::inverse_dynamics_batch(m, s.view(m, n, wanted, m.nv()));
  ksl::inverse_dynamics_batch(m, b);
  for (std::size_t k = 0; k < n; ++k) {
    const double *row = &spread[(n - 1 - k) * apart];
    CHECK(std::equal(row, row + nv, &wanted[k * nv]));
    for (std::size_t i = nv; i < apart; ++i)
      CHECK(row[i] == -7.0);
  }
}

TEST_CASE("poses and energies too") {
  const ksl::model m = tree();
  constexpr std::size_t n = 21, apart = pose_numbers + 5;
  states<float> s(m, n);
  const positions_and_energies<float> wanted = found_in(m, s, 0, n, 1);
  std::vector<float> poses(n * apart, -7.0f), energies(3 * n, -7.0f), unused;
  ksl::batch_view<float> b = s.view(m, n, unused, 0);
  b.q = {row(b.q, n - 1), -b.q.stride}, b.v = {row(b.v, n - 1), -b.v.stride};
  b.result[0] = {poses.data(), apart};
  b.links = {static_cast<int>(some_links.size()), some_links.data()};
  ksl::frame_poses_batch(m, b);
  b.result[0] = {energies.data() + 3 * (n - 1), -3}, b.result[1] = {energies.data() + 1, 3};
  ksl::energy_batch(m, b);
  for (std::size_t k = 0; k < n; ++k) {
    const float *found = &poses[(n - 1 - k) * apart];
    CHECK(std::equal(found, found + pose_numbers, &wanted.poses[k * pose_numbers]));
    CHECK(std::count(found + pose_numbers, found + apart, -7.0f) == apart - pose_numbers);
    CHECK(energies[3 * k] == wanted.kinetic[k]);
    CHECK(energies[3 * (n - 1 - k) + 1] == wanted.potential[k]);
    CHECK(energies[3 * k + 2] == -7.0f);
  }
}

TEST_CASE("no links, no poses and no Jacobians") {
  const ksl::model m = tree();
  for (std::size_t n : {std::size_t(1), std::size_t(3), static_cast<std::size_t>(reach)}) {
    states<double> s(m, n);
    std::vector<double> untouched;
    const std::size_t size = 6 * static_cast<std::size_t>(m.nv());
    ksl::frame_poses_batch(m, s.view(m, n, untouched, static_cast<int>(size)));
    CHECK(untouched == std::vector<double>(n * size, -7.0));
    ksl::jacobian_batch(m, s.view(m, n, untouched, static_cast<int>(size)));
    CHECK(untouched == std::vector<double>(n * size, -7.0));
  }
}

TEST_CASE("more frames than the model has links: nothing is computed in operational space") {
  const ksl::model m = tree();
  const std::vector<int> links(m.links().size() + 1, 1);
  for (std::size_t n : {std::size_t(1), std::size_t(3)})
    for (const std::size_t frames : {links.size(), links.size() - 1}) {
      states<double> s(m, n);
      std::vector<double> found;
      const std::size_t width = 36 * frames * frames;
      ksl::batch_view<double> b = s.view(m, n, found, static_cast<int>(width));
      b.links = {static_cast<int>(frames), links.data()};
      ksl::operational_space_inertia_inverse_batch(m, b);
      CHECK(std::count(found.begin(), found.end(), -7.0) == static_cast<long>(frames == links.size() ? n * width : 0));
    }
}

namespace {

/// Every algorithm on n states, with rows for some of its results: these are what they are where all have rows.
template <class S> void leave_out_results(const ksl::model &m, std::size_t n) {
  states<S> s(m, n);
  const int wide = m.nv() * m.nv() + pose_numbers;
  const ksl::reaction_request request{.n = static_cast<int>(some_links.size()), .link = some_links.data()};
  const auto found = [&](auto call, bool first, bool second, bool wrenches) {
    std::vector<S> one;
    ksl::batch_view<S> b = s.view(m, n, one, wide);
    std::vector<S> two(n, S(-7)), three(n * 6 * some_links.size(), S(-7));
    b.links = {static_cast<int>(some_links.size()), some_links.data()};
    ksl::reaction_rows<S> wanted{request, {wrenches ? three.data() : nullptr, 6 * request.n}};
    b.reactions_n = 1, b.reactions = &wanted;
    b.result[0].first = first ? one.data() : nullptr;
    b.result[1] = {second ? two.data() : nullptr, 1};
    call(b);
    return std::array<std::vector<S>, 3>{one, two, three};
  };
  const auto check = [&](auto call) {
    const auto whole = found(call, true, true, true);
    for (bool first : {false, true})
      for (bool second : {false, true})
        for (bool wrenches : {false, true}) {
          const auto part = found(call, first, second, wrenches);
          const std::array<bool, 3> given = {first, second, wrenches};
          for (std::size_t i = 0; i < 3; ++i)
            CHECK(part[i] == (given[i] ? whole[i] : std::vector<S>(whole[i].size(), S(-7))));
        }
  };
  check([&](const auto &b) { ksl::inverse_dynamics_batch(m, b); });
  check([&](const auto &b) { ksl::inverse_dynamics_with_reactions_batch(m, b); });
  check([&](const auto &b) { ksl::reactions_batch(m, b); });
  check([&](const auto &b) { ksl::forward_dynamics_batch(m, b); });
  check([&](const auto &b) { ksl::mass_matrix_batch(m, b); });
  check([&](const auto &b) { ksl::mass_matrix_upper_batch(m, b); });
  check([&](const auto &b) { ksl::bias_batch(m, b); });
  check([&](const auto &b) { ksl::gravity_torque_batch(m, b); });
  check([&](const auto &b) { ksl::frame_poses_batch(m, b); });
  check([&](const auto &b) { ksl::energy_batch(m, b); });
  check([&](const auto &b) { ksl::external_power_batch(m, b); });
  check([&](const auto &b) { ksl::jacobian_batch(m, b); });
}

} // namespace

TEST_CASE("derivatives of a part of each reaction: a batch has the bits of each state, and parts add up to the whole") {
  const ksl::model m = tree();
  const std::size_t n = 5;
  std::vector<int> links;
  for (int j = 0; j < m.moving_joints(); ++j)
    links.push_back(m.joints()[static_cast<std::size_t>(j)].link);
  ksl::reaction_request request;
  request.n = static_cast<int>(links.size()), request.link = links.data();
  const std::size_t width = 6 * links.size() * static_cast<std::size_t>(m.nv());
  states<double> s(m, n);
  const auto derivatives = [&](ksl::wrench_part part, std::size_t first, std::size_t count) {
    request.part = part;
    std::array<std::vector<double>, 3> out;
    ksl::batch_view<double> b = s.view(m, count, out[0], static_cast<int>(width));
    out[1] = out[2] = out[0];
    for (std::size_t r = 0; r < 3; ++r)
      b.result[r] = {out[r].data(), static_cast<std::ptrdiff_t>(width)};
    b.q = rows_from(b.q, first), b.v = rows_from(b.v, first), b.a = rows_from(b.a, first);
    b.joints = &request;
    ksl::reactions_derivatives_batch(m, b);
    return out;
  };
  const auto whole = derivatives(ksl::wrench_part::total, 0, n), held = derivatives(ksl::wrench_part::constraint, 0, n),
             driven = derivatives(ksl::wrench_part::actuation, 0, n);
  for (std::size_t r = 0; r < 3; ++r) {
    double error = 0, most = 1;
    for (std::size_t i = 0; i < n * width; ++i)
      error = std::fmax(error, std::fabs(held[r][i] + driven[r][i] - whole[r][i])),
      most = std::fmax(most, std::fabs(whole[r][i]));
    CHECK(error <= 1e-13 * most);
  }
  for (std::size_t k = 0; k < n; ++k)
    for (ksl::wrench_part part : {ksl::wrench_part::constraint, ksl::wrench_part::actuation}) {
      const auto one = derivatives(part, k, 1);
      for (std::size_t r = 0; r < 3; ++r)
        CHECK(std::equal(one[r].begin(), one[r].end(),
                         (part == ksl::wrench_part::constraint ? held : driven)[r].begin() +
                             static_cast<long>(k * width)));
    }
}

TEST_CASE("results without rows are not wanted") {
  const ksl::model m = tree();
  for (std::size_t n : {std::size_t(1), std::size_t(2), std::size_t(3), static_cast<std::size_t>(reach)}) {
    leave_out_results<double>(m, n);
    leave_out_results<float>(m, n);
  }
}

TEST_CASE("forward dynamics is the inverse of inverse dynamics, and M a + bias = tau") {
  const ksl::model m = tree();
  ksl::data d(m);
  const std::size_t nv = static_cast<std::size_t>(m.nv());
  for (std::size_t k = 0; k < 20; ++k) {
    states<double> s(m, k + 1);
    const double *q = &s.q[k * static_cast<std::size_t>(m.nq())], *v = &s.v[k * nv], *a = &s.a[k * nv];
    std::vector<double> tau(nv), back(nv), M(nv * nv), bias(nv);
    ksl::inverse_dynamics(m, d, q, v, a, tau.data());
    ksl::forward_dynamics(m, d, q, v, tau.data(), back.data());
    ksl::mass_matrix(m, d, q, M.data());
    ksl::bias(m, d, q, v, bias.data());
    for (std::size_t i = 0; i < nv; ++i) {
      double sum = bias[i];
      for (std::size_t j = 0; j < nv; ++j) {
        CHECK(M[i * nv + j] == M[j * nv + i]);
        sum += M[i * nv + j] * a[j];
      }
      CHECK(back[i] == doctest::Approx(a[i]).epsilon(1e-10));
      CHECK(sum == doctest::Approx(tau[i]).epsilon(1e-11).scale(100));
    }
  }
}

TEST_CASE("a mass matrix of other scalars than plain numbers has both triangles, and its zeros") {
  using P = ksl::native_pack<double>;
  const ksl::model m = tree();
  const int size = m.nv() * m.nv();
  const states<double> s(m, 1);
  using workspace = ksl::mass_matrix_workspace<P>;
  ksl::arena measure(nullptr);
  workspace().lay_out(measure, m.view());
  std::vector<P> q, result(static_cast<std::size_t>(size), P(-7.0));
  struct alignas(64) line { std::byte bytes[64]; };
  std::vector<line> memory(measure.used() / sizeof(line));
  std::vector<double> expected(static_cast<std::size_t>(size), -7.0);
  ksl::arena pieces(memory.data());
  workspace w;
  w.lay_out(pieces, m.view());
  for (double x : s.q)
    q.push_back(P(x));
  ksl::mass_matrix(m.view(), w, q.data(), result.data());
  ksl::data d(m);
  ksl::mass_matrix(m, d, s.q.data(), expected.data());
  for (int k = 0; k < size; ++k)
    CHECK(result[static_cast<std::size_t>(k)][0] == expected[static_cast<std::size_t>(k)]);
}
