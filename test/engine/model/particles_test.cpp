// Results of algorithms that follow from the motion of particles: links are made of point masses, whose Jacobians say
// all.
#include "matrices.hpp"
#include "random_trees.hpp"

#include "ksl/dynamics.hpp"
#include "ksl/engine/model/quaternion_tolerance.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace {

using matrices::difference, matrices::numbers, matrices::product, matrices::transposed;
constexpr double unwritten = std::numeric_limits<double>::quiet_NaN();

struct particle {
  int link;
  double mass, at[3]; // in the link's frame
};

/// Six point masses with a link's inertia, on the principal axes, which are parallel to the link's.
void add_particles(const ksl::model &m, int link, std::vector<particle> &particles) {
  const ksl::spatial_inertia<double> &I = m.links()[static_cast<std::size_t>(link)].inertia;
  if (!(I.m > 0))
    return;
  const double c[3] = {I.h.x / I.m, I.h.y / I.m, I.h.z / I.m}, cc = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
  const double own[3] = {I.Ixx - I.m * (cc - c[0] * c[0]), I.Iyy - I.m * (cc - c[1] * c[1]),
                         I.Izz - I.m * (cc - c[2] * c[2])};
  for (int k = 0; k < 3; ++k) {
    const double square = 1.5 * (own[0] + own[1] + own[2] - 2 * own[k]) / I.m;
    REQUIRE(square >= 0);
    for (const double side : {-1.0, 1.0}) {
      particles.push_back({link, I.m / 6, {c[0], c[1], c[2]}});
      particles.back().at[k] += side * std::sqrt(square);
    }
  }
}

struct mechanism {
  ksl::model m;
  ksl::data d;
  robots::state s;
  std::size_t nv;
  mechanism(int bodies, std::mt19937 &random)
      : m(robots::random_tree(bodies, random)), d(m), s(robots::random_state(m, random)),
        nv(static_cast<std::size_t>(m.nv())) {}
};

} // namespace

TEST_CASE("mass matrix and Coriolis matrix are the sums over particles of Jᵀ J dm and Jᵀ J̇ dm") {
  std::mt19937 random(5);
  for (int k = 0; k < 4; ++k) {
    mechanism x(5, random);
    const ksl::model &m = x.m;
    std::vector<particle> particles;
    for (int l = 0; l < m.view().links; ++l)
      add_particles(m, l, particles);
    numbers M(x.nv * x.nv), C(M), found(M.size(), unwritten), J(6 * x.nv), rate(J);
    for (const particle &p : particles) {
      ksl::frame_options how;
      how.axes = ksl::expressed_in::world;
      for (int i = 0; i < 3; ++i)
        how.offset[i] = p.at[i];
      ksl::jacobian(m, x.d, x.s.q.data(), p.link, how, J.data());
      ksl::jacobian_rate(m, x.d, x.s.q.data(), x.s.v.data(), p.link, how, rate.data());
      for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t i = 0; i < x.nv; ++i)
          for (std::size_t j = 0; j < x.nv; ++j) {
            M[i * x.nv + j] += p.mass * J[r * x.nv + i] * J[r * x.nv + j];
            C[i * x.nv + j] += p.mass * J[r * x.nv + i] * rate[r * x.nv + j];
          }
    }
    ksl::mass_matrix(m, x.d, x.s.q.data(), found.data());
    CHECK(difference(found, M) < 1e-12);
    found.assign(found.size(), unwritten);
    ksl::coriolis_matrix(m, x.d, x.s.q.data(), x.s.v.data(), found.data());
    CHECK(difference(found, C) < 1e-12);
  }
}

TEST_CASE("operational space: J W Jᵀ and W Jᵀ Λ of several frames, however they are expressed") {
  std::mt19937 random(7);
  for (int k = 0; k < 6; ++k) {
    mechanism x(6, random);
    const int last = x.m.view().links - 1, links[2] = {last, last / 2};
    ksl::frame_options how;
    how.axes = static_cast<ksl::expressed_in>(k % 2);
    how.at = static_cast<ksl::expressed_in>(k / 2 % 2);
    how.angular_first = k >= 3;
    for (const int n : {1, 2}) {
      const std::size_t rows = 6 * static_cast<std::size_t>(n);
      numbers J, W(x.nv * x.nv), inverse(rows * rows, unwritten), inertia(inverse), bias(rows),
          pseudo(x.nv * rows, unwritten), one(6 * x.nv, unwritten);
      for (int f = 0; f < n; ++f) {
        ksl::jacobian(x.m, x.d, x.s.q.data(), links[f], how, one.data());
        J.insert(J.end(), one.begin(), one.end());
      }
      ksl::mass_matrix_inverse(x.m, x.d, x.s.q.data(), W.data());
      const numbers WJ = product(W, transposed(J, rows), x.nv);
      ksl::operational_space_inertia_inverse(x.m, x.d, x.s.q.data(), n, links, how, inverse.data());
      CHECK(difference(inverse, product(J, WJ, x.nv)) < 1e-9);
      double rank = unwritten;
      ksl::operational_space(x.m, x.d, x.s.q.data(), x.s.v.data(), n, links, how, inertia.data(), bias.data(),
                             pseudo.data(), &rank);
      CHECK(difference(pseudo, product(WJ, inertia, rows)) < 1e-6);
    }
  }
}

TEST_CASE("at rest every joint, fixed ones too, carries the weight of what is beyond it") {
  std::mt19937 random(9);
  for (int k = 0; k < 4; ++k) {
    const mechanism x(7, random);
    ksl::data d(x.m);
    const numbers zero(x.nv);
    numbers tau(x.nv);
    ksl::inverse_dynamics(x.m, d, x.s.q.data(), zero.data(), zero.data(), tau.data());
    numbers carried(static_cast<std::size_t>(x.m.view().links));
    for (std::size_t l = 0; l < carried.size(); ++l)
      carried[l] = x.m.links()[l].inertia.m;
    std::vector<int> above(carried.size(), -1);
    for (const ksl::joint_row &j : x.m.joints())
      above[static_cast<std::size_t>(j.link)] = j.parent_link;
    for (std::size_t l = carried.size(); l-- > 0;)
      if (above[l] >= 0)
        carried[static_cast<std::size_t>(above[l])] += carried[l];
    for (const ksl::joint_row &j : x.m.joints()) {
      ksl::reaction_request request;
      request.n = 1, request.link = &j.link, request.axes = ksl::wrench_frame::world;
      double f[6];
      ksl::reactions(x.m, d, request, f);
      CAPTURE(j.name);
      CHECK(std::fabs(f[0]) + std::fabs(f[1]) < 1e-11);
      CHECK(f[2] == doctest::Approx(-x.m.view().gravity.z * carried[static_cast<std::size_t>(j.link)]).epsilon(1e-12));
    }
  }
}

TEST_CASE("matrices with zeros are written completely, and angular parts come first where that is asked for") {
  std::mt19937 random(11);
  mechanism x(6, random);
  const int links[3] = {4, 0, 2};
  const std::size_t nv = x.nv;
  numbers once(nv * 30), twice(once.size(), unwritten);
  ksl::inverse_dynamics_regressor(x.m, x.d, x.s.q.data(), x.s.v.data(), x.s.a.data(), 3, links, once.data());
  ksl::inverse_dynamics_regressor(x.m, x.d, x.s.q.data(), x.s.v.data(), x.s.a.data(), 3, links, twice.data());
  CHECK(once == twice);
  numbers linear(6 * nv, unwritten), angular(6 * nv, unwritten);
  ksl::centroidal_momentum_matrix(x.m, x.d, x.s.q.data(), ksl::component_order::linear_first, linear.data());
  ksl::centroidal_momentum_matrix(x.m, x.d, x.s.q.data(), ksl::component_order::angular_first, angular.data());
  for (std::size_t i = 0; i < 6 * nv; ++i)
    CHECK(linear[i] == angular[(i + 3 * nv) % (6 * nv)]);
}

TEST_CASE("the length of a quaternion is that of all its numbers") {
  const double q[4] = {1, 2, 4, 8};
  CHECK(ksl::quaternion_length(q) == std::sqrt(85.0));
}
