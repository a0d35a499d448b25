// The choice of x in canonical frames: turns that compose to the placement, and as few of them as can be.
#include "ksl/dynamics.hpp"

#include "engine/canonical_axes.hpp"
#include "ksl/engine/joints.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace {

using A = ksl::algebra<double>;

double distance(const ksl::mat3x3<double> &a, const ksl::mat3x3<double> &b) {
  const double *x = &a.m00, *y = &b.m00;
  double worst = 0;
  for (int i = 0; i < 9; ++i)
    worst = std::max(worst, std::fabs(x[i] - y[i]));
  return worst;
}

ksl::mat3x3<double> random_rotation(std::mt19937_64 &random) {
  std::normal_distribution<double> normal;
  double q[4] = {normal(random), normal(random), normal(random), normal(random)};
  return ksl::rotation_of(q);
}

/// A chain of bodies with these placements, each turned by nothing.
std::vector<ksl::body<double>> chain(const std::vector<ksl::mat3x3<double>> &placements) {
  std::vector<ksl::body<double>> bodies(1);
  bodies[0].kind = ksl::joint_kind::fixed, bodies[0].parent = -1;
  for (const ksl::mat3x3<double> &R : placements) {
    ksl::body<double> b{};
    b.kind = ksl::joint_kind::revolute;
    b.parent = static_cast<int>(bodies.size()) - 1;
    b.placement = {R, {1, 2, 3}};
    bodies.push_back(b);
  }
  return bodies;
}

/// Rz(offset) Rx(alpha) Rz(theta0) of a body.
ksl::mat3x3<double> composed(const ksl::body<double> &b) {
  ksl::mat3x3<double> R = ksl::identity.R;
  double offset[2] = {b.offset.sine, b.offset.cosine}, alpha[2] = {b.alpha.sine, b.alpha.cosine};
  double theta0[2] = {b.theta0.sine, b.theta0.cosine};
  A::product_drdrz(&R, offset, &R);
  A::product_drdrx(&R, alpha, &R);
  A::product_drdrz(&R, theta0, &R);
  return R;
}

} // namespace

TEST_CASE("rotations compose to where a body lies, and within a chain there is no offset") {
  std::mt19937_64 random(3);
  for (int round = 0; round < 200; ++round) {
    std::vector<ksl::mat3x3<double>> placements;
    ksl::mat3x3<double> expected = ksl::identity.R, found = ksl::identity.R;
    for (int i = 0; i < 5; ++i) {
      placements.push_back(random_rotation(random));
      A::product_drdr(&expected, &placements.back(), &expected);
    }
    std::vector<ksl::body<double>> bodies = chain(placements);
    std::vector<ksl::link<double>> links(bodies.size());
    for (std::size_t i = 0; i < links.size(); ++i)
      links[i].body = static_cast<int>(i), links[i].carried_by_moving_joint = true, links[i].pose = ksl::identity;
    ksl::choose_canonical_axes(bodies, links);
    for (std::size_t i = 1; i < bodies.size(); ++i) {
      const ksl::mat3x3<double> R = composed(bodies[i]);
      A::product_drdr(&found, &R, &found);
      CHECK(bodies[i].no_offset == (i > 1)); // on the ground, x can't be chosen
    }
    A::product_drdr(&found, &links.back().pose.R, &found); // back to the axes that the last body had
    CHECK(distance(found, expected) < 2e-15);
  }
}

TEST_CASE("axes that are parallel, or opposite, need no offset, whatever else is on the body") {
  const ksl::mat3x3<double> parallel = {1, 0, 0, 0, 1, 0, 0, 0, 1}, opposite = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  for (const ksl::mat3x3<double> &last : {parallel, opposite}) {
    std::mt19937_64 random(5);
    std::vector<ksl::body<double>> bodies = chain({parallel, random_rotation(random), last});
    bodies[3].parent = 1; // beside body 2
    std::vector<ksl::link<double>> none;
    ksl::choose_canonical_axes(bodies, none);
    CHECK(bodies[2].no_offset);
    CHECK(bodies[3].no_offset);
    CHECK(std::fabs(bodies[3].alpha.sine) < 1e-15);
  }
}

TEST_CASE("axes along coordinates leave exact quarter turns") {
  const ksl::model m = ksl::load(KSL_EXAMPLES "/robots/ur5.urdf");
  const ksl::model_view<double> view = m.view();
  for (int l = 0; l < view.links; ++l)
    if (view.link[l].carried_by_moving_joint) {
      CHECK(view.link[l].axis_aligned);
      CHECK(std::fabs(view.link[l].permutation.sign) == 1);
    }
}
