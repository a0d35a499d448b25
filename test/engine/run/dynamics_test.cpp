// The C++ calls against closed forms.
#include "robots.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstring>

using doctest::Approx;
using wrench = std::array<double, 6>;

namespace {

const double g = 9.81;

/// Efforts, leaving the motion in d.
std::vector<double> efforts(const ksl::model &m, ksl::data &d, std::vector<double> q, std::vector<double> v,
                            std::vector<double> a, const ksl::external_wrenches<double> &external = {}) {
  std::vector<double> tau(static_cast<std::size_t>(m.nv()));
  ksl::inverse_dynamics(m, d, q.data(), v.data(), a.data(), tau.data(), external);
  return tau;
}

/// The reaction through one joint.
wrench reaction(const ksl::model &m, ksl::data &d, const char *joint, ksl::reaction_request request = {},
                const ksl::external_wrenches<double> &external = {}) {
  const int link = m.joints()[static_cast<std::size_t>(m.find_joint(joint))].link;
  request.n = 1;
  request.link = &link;
  wrench w;
  ksl::reactions(m, d, request, w.data(), external);
  return w;
}

void check_close(const wrench &found, const wrench &expected) {
  for (std::size_t i = 0; i < 6; ++i) {
    CAPTURE(i);
    CHECK(found[i] == Approx(expected[i]).epsilon(1e-13));
  }
}

} // namespace

TEST_CASE("simple pendulum: effort and pin force") {
  const double m1 = 1.3, l = 0.7, th = 0.8, w = 2.1, dw = -1.7;
  const ksl::model m(robots::pendulum(m1, l));
  ksl::data d(m);
  CHECK(efforts(m, d, {th}, {w}, {dw})[0] == Approx(m1 * l * l * dw + m1 * g * l * std::sin(th)).epsilon(1e-14));
  const double pull = m1 * (g * std::cos(th) + l * w * w), across = m1 * (g * std::sin(th) + l * dw);
  check_close(reaction(m, d, "shoulder"), {-across, 0, pull, 0, l * across, 0});

  ksl::reaction_request world;
  world.axes = world.at = ksl::wrench_frame::world;
  const double c = std::cos(th), s = std::sin(th);
  check_close(reaction(m, d, "shoulder", world), {-across * c + pull * s, 0, across * s + pull * c, 0, l * across, 0});
  check_close(reaction(m, d, "base", world), reaction(m, d, "shoulder", world));

  double kinetic, potential;
  ksl::energy(m, d, &th, &w, &kinetic, &potential);
  CHECK(kinetic == Approx(m1 * l * l * w * w / 2).epsilon(1e-14));
  CHECK(potential == Approx(-m1 * g * l * c).epsilon(1e-14));
}

TEST_CASE("double pendulum: efforts of the textbook") {
  const double m1 = 1.3, l1 = 0.7, m2 = 0.9, l2 = 0.5;
  const double a1 = 0.8, a2 = -1.9, v1 = 2.1, v2 = -0.6, d1 = -1.7, d2 = 0.4;
  const ksl::model m(robots::double_pendulum(m1, l1, m2, l2));
  ksl::data d(m);
  const std::vector<double> tau = efforts(m, d, {a1, a2}, {v1, v2}, {d1, d2});
  // Lagrange's equations with the elbow's angle relative to the first rod
  const double c2 = std::cos(a2), s2 = std::sin(a2);
  const double elbow = m2 * (l2 * l2 + l1 * l2 * c2) * d1 + m2 * l2 * l2 * d2 + m2 * l1 * l2 * s2 * v1 * v1 +
                       m2 * g * l2 * std::sin(a1 + a2);
  const double shoulder = (m1 * l1 * l1 + m2 * (l1 * l1 + 2 * l1 * l2 * c2 + l2 * l2)) * d1 +
                          m2 * (l2 * l2 + l1 * l2 * c2) * d2 - m2 * l1 * l2 * s2 * (2 * v1 * v2 + v2 * v2) +
                          (m1 + m2) * g * l1 * std::sin(a1) + m2 * g * l2 * std::sin(a1 + a2);
  CHECK(tau[0] == Approx(shoulder).epsilon(1e-13));
  CHECK(tau[1] == Approx(elbow).epsilon(1e-13));
}

TEST_CASE("prismatic on a turntable: Coriolis force, guide and drive") {
  ksl::robot_description r;
  r.links = {robots::link("floor"), robots::link("table"), robots::link("slider", robots::solid(2, {0, 0, 0}))};
  r.joints = {robots::joint("turn", ksl::joint_kind::revolute, 0, 1, {0, 0, 0}, {0, 0, 1}),
              robots::joint("slide", ksl::joint_kind::prismatic, 1, 2, {0, 0, 0.3}, {1, 0, 0})};
  const ksl::model m(r);
  ksl::data d(m);
  const double x = 0.6, dx = 0.5, ddx = -0.4, w = 3, dw = 0.7;
  const std::vector<double> tau = efforts(m, d, {0.9, x}, {w, dx}, {dw, ddx});
  const double along = 2 * (ddx - w * w * x), across = 2 * (dw * x + 2 * w * dx);
  CHECK(tau[1] == Approx(along).epsilon(1e-14));
  CHECK(tau[0] == Approx(across * x).epsilon(1e-14));

  const double weight = 2 * g;
  check_close(reaction(m, d, "slide"), {along, across, weight, 0, 0, 0});
  ksl::reaction_request request;
  request.part = ksl::wrench_part::constraint;
  check_close(reaction(m, d, "slide", request), {0, across, weight, 0, 0, 0});
  request.part = ksl::wrench_part::actuation;
  check_close(reaction(m, d, "slide", request), {along, 0, 0, 0, 0, 0});
  request.part = ksl::wrench_part::constraint;
  check_close(reaction(m, d, "turn", request), {along, across, weight, -across * 0.3, along * 0.3 - weight * x, 0});
}

TEST_CASE("external wrench on a welded link is carried by its weld") {
  ksl::robot_description r = robots::pendulum(1, 1);
  r.links.push_back(robots::link("hand"));
  r.joints.push_back(robots::joint("weld", ksl::joint_kind::fixed, 1, 2, {0, 0, -1}, {1, 0, 0}));
  const ksl::model m(r);
  ksl::data d(m);
  const int hand = m.find_link("hand");
  const double push[6] = {1, 2, 3, 4, 5, 6};
  const ksl::external_wrenches<double> external = {1, &hand, push};
  const double tau = efforts(m, d, {0}, {0}, {0}, external)[0];
  CHECK(tau == Approx(-(5 + -1 * 1.0)).epsilon(1e-14)); // moment about y: 5 + z × fx
  check_close(reaction(m, d, "weld", {}, external), {-1, -2, -3, -4, -5, -6});
  const double q = 0, v = 2;
  double power;
  ksl::external_power(m, d, &q, &v, &power, external);
  CHECK(power == Approx(v * (5 - 1.0)).epsilon(1e-14));
}

TEST_CASE("a floating body: force is mass times acceleration minus gravity, in its own axes") {
  ksl::robot_description r;
  r.links = {robots::link("stone", robots::solid(3, {0, 0, 0}, 1, 2, 3))};
  ksl::model_options options;
  options.floating_base = true;
  const ksl::model m(r, options);
  CHECK((m.nq() == 7 && m.nv() == 6 && m.joints().size() == 1 && m.joints()[0].name == "floating_base"));
  ksl::data d(m);
  const double h = std::sqrt(0.5); // a quarter turn about x: the body's −y points along the world's −z
  const std::vector<double> tau = efforts(m, d, {1, 2, 3, h, 0, 0, h}, {1, 0, 0, 0, 0, 2}, {0.5, 0, 0, 0, 0, 0.1});
  const wrench expected = {3 * 0.5, 3 * (2.0 + g), 0, 0, 0, 3 * 0.1};
  for (std::size_t i = 0; i < 6; ++i) {
    CAPTURE(i);
    CHECK(tau[i] == Approx(expected[i]).epsilon(1e-13));
  }
}

TEST_CASE("euler's equations: a spinning asymmetric body needs a moment") {
  ksl::robot_description r;
  r.links = {robots::link("top", robots::solid(1, {0, 0, 0}, 1, 2, 4))};
  ksl::model_options options;
  options.floating_base = true;
  options.gravity = {0, 0, 0};
  const ksl::model m(r, options);
  ksl::data d(m);
  const std::vector<double> tau = efforts(m, d, {0, 0, 0, 0, 0, 0, 1}, {0, 0, 0, 1, 2, 3}, {0, 0, 0, 0.1, 0.2, 0.3});
  CHECK(tau[3] == Approx(1 * 0.1 + (4 - 2) * 2 * 3).epsilon(1e-14));
  CHECK(tau[4] == Approx(2 * 0.2 + (1 - 4) * 3 * 1).epsilon(1e-14));
  CHECK(tau[5] == Approx(4 * 0.3 + (2 - 1) * 1 * 2).epsilon(1e-14));
}

TEST_CASE("frame_pose of a double pendulum") {
  const ksl::model m(robots::double_pendulum(1, 0.7, 1, 0.5));
  ksl::data d(m);
  const double q[2] = {0.4, 0.3};
  const ksl::SE3<double> D = ksl::frame_pose(m, d, q, m.find_link("second"));
  CHECK(D.t.x == Approx(-0.7 * std::sin(0.4)).epsilon(1e-14));
  CHECK(D.t.z == Approx(-0.7 * std::cos(0.4)).epsilon(1e-14));
  CHECK(D.R.m00 == Approx(std::cos(0.7)).epsilon(1e-14));
  CHECK(D.R.m02 == Approx(std::sin(0.7)).epsilon(1e-14));
  const int links[2] = {m.find_link("second"), 0};
  double poses[32];
  ksl::frame_poses(m, d, q, 2, links, poses);
  for (int i = 0; i < 16; ++i) {
    const double s = std::sin(0.7), c = std::cos(0.7);
    const double expected[16] = {c, 0, s, -0.7 * std::sin(0.4), 0, 1, 0, 0, -s, 0, c, -0.7 * std::cos(0.4), 0, 0, 0, 1};
    CHECK(poses[i] == Approx(expected[i]).epsilon(1e-14));
    CHECK(poses[16 + i] == (i % 5 == 0 ? 1 : 0)); // the root, at the origin
  }
}

TEST_CASE("results in place: angular first, on the parent") {
  const ksl::model m(robots::pendulum(1.3, 0.7));
  ksl::data d(m);
  efforts(m, d, {0.8}, {2.1}, {-1.7});
  const wrench w = reaction(m, d, "shoulder");
  ksl::reaction_request request;
  request.angular_first = true;
  request.on = ksl::wrench_side::parent;
  const wrench turned = reaction(m, d, "shoulder", request);
  for (std::size_t i = 0; i < 6; ++i)
    CHECK(turned[i] == -w[(i + 3) % 6]);
}

TEST_CASE("the sample robot loads and its instruction set has a name") {
  const ksl::model m = ksl::load(robot_file("ur5"));
  CHECK(m.nv() == 6);
  CHECK(std::strlen(ksl::instruction_set()) > 4);
}
