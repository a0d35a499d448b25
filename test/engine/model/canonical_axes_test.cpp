// The choice of x in canonical frames: turns that compose to the placement, and as few of them as can be.
#include "ksl/dynamics.hpp"

#include "engine/model/canonical_axes.hpp"
#include "ksl/engine/algorithms/inverse/reactions.hpp"
#include "ksl/engine/model/joints.hpp"
#include "robot_files.hpp"

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

namespace {

/// Columns that are coordinate axes or their opposites: the 24 rotations of a cube.
std::vector<ksl::mat3x3<double>> rotations_of_cube() {
  std::vector<ksl::mat3x3<double>> found;
  for (int x = 0; x < 3; ++x)
    for (int y = 0; y < 3; ++y)
      for (int signs = 0; signs < 4; ++signs) {
        if (y == x)
          continue;
        double column[3][3] = {};
        column[0][x] = signs & 1 ? -1 : 1, column[1][y] = signs & 2 ? -1 : 1;
        for (int i = 0; i < 3; ++i) { // z = x × y
          const int j = (i + 1) % 3, k = (i + 2) % 3;
          column[2][i] = column[0][j] * column[1][k] - column[0][k] * column[1][j];
        }
        const auto &c = column;
        found.push_back({c[0][0], c[0][1], c[0][2], c[1][0], c[1][1], c[1][2], c[2][0], c[2][1], c[2][2]});
      }
  return found;
}

/// The link's pose and permutation after the choice of axes, on a body that carries no further joint: its axes stay as
/// they are.
ksl::link<double> link_turned(const ksl::mat3x3<double> &R, bool carried_by_moving_joint) {
  std::vector<ksl::body<double>> bodies = chain({ksl::identity.R});
  std::vector<ksl::link<double>> links(1);
  links[0].body = 1, links[0].carried_by_moving_joint = carried_by_moving_joint, links[0].axis_aligned = false,
  links[0].pose = {R, {0, 0, 0}};
  ksl::choose_canonical_axes(bodies, links);
  return links[0];
}

} // namespace

TEST_CASE("a link along whose axes its joint lies takes wrenches by a permutation: the numbers that the full rotation "
          "gives") {
  REQUIRE(rotations_of_cube().size() == 24);
  const double f[6] = {0.3, -1.1, 2.7, 5.2, -0.4, 7.9};
  for (const ksl::mat3x3<double> &aligned : rotations_of_cube())
    for (const double angle : {0.0, 0.7, 2.0, 4.0, 5.5}) {
      double dc[2] = {std::sin(angle), std::cos(angle)};
      ksl::mat3x3<double> R = ksl::identity.R;
      A::product_drdrz(&R, dc, &R);
      A::product_drdr(&R, &aligned, &R);
      const ksl::link<double> l = link_turned(R, true);
      REQUIRE(l.axis_aligned);
      double found[6];
      ksl::put_canonical<double>({{f[0], f[1], f[2]}, {f[3], f[4], f[5]}}, l, false, found);
      const double column[3][3] = {{R.m00, R.m10, R.m20}, {R.m01, R.m11, R.m21}, {R.m02, R.m12, R.m22}};
      for (int i = 0; i < 6; ++i) {
        const double *const of = f + i / 3 * 3, *const axis = column[i % 3];
        CHECK(found[i] == doctest::Approx(axis[0] * of[0] + axis[1] * of[1] + axis[2] * of[2]).epsilon(1e-14));
      }
      CHECK_FALSE(link_turned(R, false).axis_aligned);
    }
}

TEST_CASE("a link none of whose axes lies along the joint takes wrenches by the full rotation") {
  std::mt19937_64 random(9);
  CHECK_FALSE(link_turned(random_rotation(random), true).axis_aligned);
  for (const ksl::mat3x3<double> &aligned : rotations_of_cube()) { // each axis has a zero, along x or along y
    double dc[2] = {0.6, 0.8};
    for (const bool about_x : {false, true}) {
      ksl::mat3x3<double> R = ksl::identity.R;
      about_x ? A::product_drdrx(&R, dc, &R) : A::product_drdry(&R, dc, &R);
      A::product_drdr(&R, &aligned, &R);
      CHECK_FALSE(link_turned(R, true).axis_aligned);
    }
  }
}

TEST_CASE("axes along coordinates leave exact quarter turns") {
  const ksl::model m = ksl::load(robot_file("ur5"));
  const ksl::model_view<double> view = m.view();
  for (int l = 0; l < view.links; ++l)
    if (view.link[l].carried_by_moving_joint) {
      CHECK(view.link[l].axis_aligned);
      CHECK(std::fabs(view.link[l].permutation.sign) == 1);
    }
}
