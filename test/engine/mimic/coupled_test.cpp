// Robots with mimic joints: what follows from their mass matrix, and the expansion of scalars of any kind.
#include "engine/kernels/algorithm_rows.hpp"
#include "engine/mimic/algorithms.hpp"
#include "robots.hpp"

#include "batch/compute_batch.hpp"
#include "ksl/batch.hpp"
#include "ksl/dual.hpp"
#include "ksl/engine/algorithms/energy/energy.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

namespace {

const ksl::model &robot() {
  static const ksl::model m = ksl::load(coupled_file);
  return m;
}

struct states {
  std::size_t n, nq, nv;
  std::vector<double> q, x;
  explicit states(std::size_t count)
      : n(count), nq(static_cast<std::size_t>(robot().nq())), nv(static_cast<std::size_t>(robot().nv())), q(n * nq),
        x(n * nv) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (double &y : q)
      y = normal(random);
    for (double &y : x)
      y = normal(random);
    for (std::size_t k = 0; k < n; ++k)
      robots::normalize_quaternions(robot(), &q[k * nq]);
  }

  /// Result number `which` of a row for all states, `width` numbers each; the other results are not asked for.  v, a
  /// and tau are x.
  std::vector<double> results(const ksl::algorithm_row &row, std::size_t width, double before = 0,
                              int which = 0) const {
    std::vector<double> out(n * width, before);
    ksl::batch_view<double> batch;
    batch.n = n;
    batch.q = {q.data(), static_cast<std::ptrdiff_t>(nq)},
    batch.v = batch.a = batch.tau = {x.data(), static_cast<std::ptrdiff_t>(nv)};
    batch.result[which] = {out.data(), static_cast<std::ptrdiff_t>(width)};
    ksl::compute_batch(row, robot(), batch, 1);
    for (std::size_t k = 0; k < n; ++k) { // one state has the same bits
      std::vector<double> alone(width, before);
      batch.n = 1;
      batch.q.first = &q[k * nq], batch.v.first = batch.a.first = batch.tau.first = &x[k * nv],
      batch.result[which].first = alone.data();
      ksl::compute_batch(row, robot(), batch, 1);
      CHECK(alone == std::vector<double>(out.begin() + static_cast<std::ptrdiff_t>(k * width),
                                         out.begin() + static_cast<std::ptrdiff_t>((k + 1) * width)));
    }
    return out;
  }
};

} // namespace

TEST_CASE("coupled: accelerations of each state of a batch solve its own equations of motion") {
  const states s(70);
  const std::size_t nv = s.nv;
  const std::vector<double> M = s.results(ksl::rows::mass_matrix, nv * nv), bias = s.results(ksl::rows::bias, nv);
  const std::vector<double> a = s.results(ksl::rows::forward_dynamics, nv); // the efforts are x
  for (std::size_t k = 0; k < s.n; ++k)
    for (std::size_t i = 0; i < nv; ++i) {
      double missing = s.x[k * nv + i] - bias[k * nv + i],
             size = std::fabs(s.x[k * nv + i]) + std::fabs(bias[k * nv + i]);
      for (std::size_t j = 0; j < nv; ++j) {
        const double term = M[(k * nv + i) * nv + j] * a[k * nv + j];
        missing -= term, size += std::fabs(term);
      }
      CHECK(std::fabs(missing) < 1e-12 * size);
    }
}

TEST_CASE("coupled: a batch may ask for one of several results, reduced or not") {
  const ksl::model &m = robot();
  const states s(70);
  const std::size_t nv = s.nv;
  ksl::data d(m);
  const std::vector<double> kinetic = s.results(ksl::rows::energy, 1),
                            potential = s.results(ksl::rows::energy, 1, 0, 1);
  const std::vector<double> by_q = s.results(ksl::rows::inverse_dynamics_derivatives, nv * nv),
                            by_v = s.results(ksl::rows::inverse_dynamics_derivatives, nv * nv, 0, 1);
  std::vector<double> both[3] = {std::vector<double>(nv * nv), std::vector<double>(nv * nv),
                                 std::vector<double>(nv * nv)};
  for (std::size_t k = 0; k < s.n; ++k) {
    double one_kinetic, one_potential;
    ksl::energy(m, d, &s.q[k * s.nq], &s.x[k * nv], &one_kinetic, &one_potential);
    CHECK(kinetic[k] == one_kinetic);
    CHECK(potential[k] == one_potential);
    const double *const x = &s.x[k * nv];
    ksl::inverse_dynamics_derivatives(m, d, &s.q[k * s.nq], x, x, both[0].data(), both[1].data(), both[2].data());
    CHECK(std::equal(both[0].begin(), both[0].end(), &by_q[k * nv * nv]));
    CHECK(std::equal(both[1].begin(), both[1].end(), &by_v[k * nv * nv]));
  }
}

TEST_CASE("coupled: what is not available is refused in words") {
  ksl::algorithm_row row = ksl::rows::mass_matrix;
  row.name = "trial", row.mimic = ksl::mimic_by::refusal;
  ksl::batch_view<double> batch;
  batch.n = 5;
  CHECK_THROWS_WITH_AS(ksl::compute_batch(row, robot(), batch, 1),
                       doctest::Contains("trial is not available for robots with mimic joints"), std::invalid_argument);
}

TEST_CASE("coupled: efforts that hold the mechanism are the gradient of its potential energy") {
  using dual = ksl::dual<1>;
  const ksl::model &m = robot();
  REQUIRE(m.followers() == 3);
  const states s(1);
  const ksl::owned_workspace<ksl::energy_workspace<dual>> w(m.view());
  ksl::data d(m);
  std::vector<double> tau(s.nv);
  ksl::gravity_torque(m, d, s.q.data(), tau.data());
  const ksl::coupling_view<double> c = m.coupling_in<double>();
  for (int i = 0; i < m.moving_joints(); ++i) {
    const ksl::joint_row &joint = m.joints()[static_cast<std::size_t>(i)];
    if (!ksl::row_of(joint.kind).has_limits && joint.kind != ksl::joint_kind::continuous)
      continue; // joints with one coordinate, whose position is a number
    std::vector<dual> q(s.q.begin(), s.q.end()), all(static_cast<std::size_t>(m.view().nq)),
        rest(static_cast<std::size_t>(m.view().nv), dual(0));
    q[static_cast<std::size_t>(joint.q_index)].derivative[0] = 1;
    ksl::expand_position(c, q.data(), all.data());
    dual kinetic, potential;
    ksl::energy<dual>(m.view(), *w, all.data(), rest.data(), &kinetic, &potential);
    CHECK(potential.derivative[0] == doctest::Approx(tau[static_cast<std::size_t>(joint.v_index)]).epsilon(1e-12));
  }
}

TEST_CASE("batches of any size refuse what mimic joints don't have") {
  const ksl::model &m = robot();
  std::vector<double> q(2 * static_cast<std::size_t>(m.nq())), out(2 * static_cast<std::size_t>(m.nv() * m.nv()));
  for (std::size_t n : {1u, 2u}) {
    ksl::batch_view<double> b;
    b.n = n, b.q = {q.data(), m.nq()}, b.result[0] = {out.data(), m.nv() * m.nv()};
    CHECK_THROWS_AS(ksl::mass_matrix_tree_batch(m, b, 1), std::exception);
    CHECK_THROWS_AS(ksl::mass_matrix_factor_batch(m, b, 1), std::exception);
  }
}

TEST_CASE("a call may ask for a link more often than the workspace has room for") {
  const ksl::model &m = robot();
  const states s(1);
  ksl::data d(m);
  const std::size_t n = 500, width = 6 * s.nv;
  const int last = m.view().links - 1;
  const std::vector<int> links(n, last);
  std::vector<double> by_q(n * width), by_v(n * width), one_q(width), one_v(width);
  ksl::frame_velocities_derivatives(m, d, s.q.data(), s.x.data(), static_cast<int>(n), links.data(), {}, by_q.data(),
                                    by_v.data());
  ksl::frame_velocities_derivatives(m, d, s.q.data(), s.x.data(), 1, &last, {}, one_q.data(), one_v.data());
  for (std::size_t k = 0; k < n; ++k) {
    REQUIRE(std::equal(one_q.begin(), one_q.end(), by_q.begin() + static_cast<long>(k * width)));
    REQUIRE(std::equal(one_v.begin(), one_v.end(), by_v.begin() + static_cast<long>(k * width)));
  }
}

TEST_CASE("coupled: a batch with wrenches, reactions and several results has the bits of each state") {
  const ksl::model &m = robot();
  const states first(70);
  const std::size_t n = first.n, nq = first.nq, nv = first.nv;
  std::vector<double> v = first.x, a = first.x, push[2] = {std::vector<double>(6 * n), std::vector<double>(6 * n)};
  for (std::size_t i = 0; i < a.size(); ++i)
    a[i] = 3 * std::sin(2.0 + 1.3 * static_cast<double>(i));
  for (std::size_t i = 0; i < 6 * n; ++i)
    push[0][i] = 5 * std::cos(static_cast<double>(i)), push[1][i] = 7 * std::sin(1.1 * static_cast<double>(i));
  const int links[2] = {m.find_link("tool"), m.find_link("sleeve")};
  const int joints[2][2] = {{links[0], m.find_link("ball")}, {m.find_link("upper"), links[1]}};
  const auto rows = [](std::vector<double> &numbers, std::size_t width) {
    return ksl::rows_view<double>{numbers.data(), static_cast<std::ptrdiff_t>(width)};
  };
  const auto given = [](const std::vector<double> &numbers, std::size_t width) {
    return ksl::rows_view<const double>{numbers.data(), static_cast<std::ptrdiff_t>(width)};
  };
  const std::vector<double> &q = first.q;
  std::vector<double> tau(n * nv), reactions[2] = {std::vector<double>(12 * n), std::vector<double>(12 * n)};
  std::vector<double> by[3];
  for (std::vector<double> &each : by)
    each.resize(n * nv * nv);
  ksl::external_rows<double> external[2];
  ksl::reaction_rows<double> wanted[2];
  for (std::size_t k = 0; k < 2; ++k) {
    external[k].link = links[k], external[k].wrench = given(push[k], 6);
    wanted[k].request.n = 2, wanted[k].request.link = joints[k], wanted[k].out = rows(reactions[k], 12);
  }
  wanted[1].request.angular_first = true;
  ksl::batch_view<double> b;
  b.n = n, b.q = given(q, nq), b.v = given(v, nv), b.a = given(a, nv);
  b.external_n = 2, b.external = external;
  for (std::size_t r = 0; r < 3; ++r)
    b.result[r] = rows(by[r], nv * nv);
  ksl::inverse_dynamics_derivatives_batch(m, b, 1);
  b.result[0] = rows(tau, nv), b.result[1] = b.result[2] = {};
  b.reactions_n = 2, b.reactions = wanted;
  ksl::inverse_dynamics_with_reactions_batch(m, b, 1);
  ksl::data d(m);
  std::vector<double> one(nv), out(12),
      one_by[3] = {std::vector<double>(nv * nv), std::vector<double>(nv * nv), std::vector<double>(nv * nv)};
  const auto same = [](const std::vector<double> &x, const std::vector<double> &all, std::size_t k) {
    return std::equal(x.begin(), x.end(), all.begin() + static_cast<std::ptrdiff_t>(k * x.size()));
  };
  for (std::size_t k = 0; k < n; ++k) {
    double wrenches[12];
    std::copy_n(&push[0][6 * k], 6, wrenches), std::copy_n(&push[1][6 * k], 6, wrenches + 6);
    const ksl::external_wrenches<double> pushes = {2, links, wrenches};
    ksl::inverse_dynamics(m, d, &q[k * nq], &v[k * nv], &a[k * nv], one.data(), pushes);
    CHECK(same(one, tau, k));
    for (std::size_t r = 0; r < 2; ++r) {
      ksl::reactions(m, d, wanted[r].request, out.data(), pushes);
      CHECK(same(out, reactions[r], k));
    }
    ksl::inverse_dynamics_derivatives(m, d, &q[k * nq], &v[k * nv], &a[k * nv], one_by[0].data(), one_by[1].data(),
                                      one_by[2].data(), pushes);
    for (std::size_t r = 0; r < 3; ++r)
      CHECK(same(one_by[r], by[r], k));
  }
}
