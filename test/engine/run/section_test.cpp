// The wrench through a section of a link against the reaction of a weld: the same robot with the link sawn in two there, and its parts
// welded together by a fixed joint.
#include "ksl/section.hpp"
#include "robots.hpp"

#include <doctest/doctest.h>

#include <array>
#include <vector>

namespace {

using numbers = std::vector<double>;
using inertia = ksl::spatial_inertia<double>;

const ksl::vec3<double> cut = {0.05, -0.1, 0.4}, near_center = {0.02, 0.03, 0.1}, far_center = {0.08, -0.15, 0.7};
enum : int { ceiling, arm, hand, camera, far_part };
enum : int { shoulder, wrist, mount };

/// An arm that moves freely, with a hand beyond the cut and a camera before it.  In two parts the fifth link is what is beyond.
ksl::robot_description robot(double near_mass, double far_mass, bool sawn) {
  const auto near_part = [&](ksl::vec3<double> from) {
    return robots::solid(near_mass, {near_center.x - from.x, near_center.y - from.y, near_center.z - from.z},
                         0.02 * near_mass, 0.03 * near_mass, 0.01 * near_mass);
  };
  const auto beyond = [&](ksl::vec3<double> from) {
    return robots::solid(far_mass, {far_center.x - from.x, far_center.y - from.y, far_center.z - from.z},
                         0.05 * far_mass, 0.04 * far_mass, 0.02 * far_mass);
  };
  const inertia a = near_part({0, 0, 0}), b = beyond({0, 0, 0});
  const inertia whole = {a.m + b.m,     {a.h.x + b.h.x, a.h.y + b.h.y, a.h.z + b.h.z},
                         a.Ixx + b.Ixx, a.Iyy + b.Iyy,
                         a.Izz + b.Izz, a.Ixy + b.Ixy,
                         a.Iyz + b.Iyz, a.Izx + b.Izx};
  ksl::robot_description r;
  r.links = {robots::link("ceiling"), robots::link("arm", sawn ? a : whole),
             robots::link("hand", robots::solid(0.8, {0.1, 0.05, 0.2}, 0.01, 0.02, 0.015)),
             robots::link("camera", robots::solid(0.3, {0.04, 0, 0.02}, 0.001, 0.002, 0.003))};
  const ksl::vec3<double> at_hand = {0.1, -0.2, 0.9};
  r.joints = {robots::joint("shoulder", ksl::joint_kind::floating, ceiling, arm, {0.3, 0.2, 0.1}, {0, 0, 1}),
              robots::joint("wrist", ksl::joint_kind::revolute, sawn ? far_part : arm, hand,
                            sawn ? ksl::vec3<double>{at_hand.x - cut.x, at_hand.y - cut.y, at_hand.z - cut.z} : at_hand,
                            {0.6, 0, 0.8}),
              robots::joint("mount", ksl::joint_kind::prismatic, arm, camera, {-0.1, 0.1, 0.2}, {0, 0.8, 0.6})};
  if (sawn) {
    r.links.push_back(robots::link("far_part", beyond(cut)));
    r.joints.insert(r.joints.begin() + wrist,
                    robots::joint("weld", ksl::joint_kind::fixed, arm, far_part, cut, {0, 0, 1})); // same q
  }
  return r;
}

/// The inertia of a sawn robot's part that carries the shoulder.
inertia near_inertia(double near_mass) { return robot(near_mass, 0.1, true).links[arm].inertia; }

inertia scaled(const inertia &I, double s) {
  return {s * I.m, {s * I.h.x, s * I.h.y, s * I.h.z}, s * I.Ixx, s * I.Iyy, s * I.Izz, s * I.Ixy, s * I.Iyz, s * I.Izx};
}

// position, quaternion, wrist, mount; velocities that are large, so that products of them count
const numbers q = {0.4, -0.3, 0.8, 0.1, -0.5, 0.7, 0.5, 0.6, 0.2}, v = {0.8, -1.9, 1.3, 1.7, -2.1, 0.9, 3.1, -1.2},
              a = {2.3, -0.7, 1.6, -3.3, 2.2, 4.1, -5.2, 1.9};
const int pushed[3] = {hand, camera, arm};
const double push[18] = {3, -5, 7, 0.4, 0.2, -0.6, 1, 2, -3, 0.1, 0.7, -0.5, -4, 6, 2, 0.5, -0.3, 0.9};

/// What the arm exerts on the part beyond the weld, about the cut, in the arm's axes.
numbers weld(double near_mass, double far_mass, ksl::expressed_in axes) {
  const ksl::model m(robot(near_mass, far_mass, true));
  ksl::data d(m);
  const int link = m.find_link("far_part"),
            pushed_here[3] = {m.find_link("hand"), m.find_link("camera"), arm}; // numbers follow the tree
  const ksl::external_wrenches<double> external = {3, pushed_here, push, axes};
  numbers tau(8), out(6);
  ksl::inverse_dynamics(m, d, q.data(), v.data(), a.data(), tau.data(), external);
  ksl::reaction_request request;
  request.n = 1, request.link = &link, request.at = request.axes = ksl::wrench_frame::link,
  request.at_link = request.axes_link = link;
  ksl::reactions(m, d, request, out.data(), external);
  return out;
}

ksl::link_section section_of(ksl::section_share share) {
  ksl::link_section s;
  s.link = arm, s.share = share;
  s.point[0] = cut.x, s.point[1] = cut.y, s.point[2] = cut.z;
  s.normal[0] = 0.2, s.normal[1] = -0.3, s.normal[2] = 2;
  return s;
}

template <class S> numbers section(double near_mass, double far_mass, const ksl::link_section &s,
                                   ksl::expressed_in axes) {
  const ksl::model m(robot(near_mass, far_mass, false));
  ksl::data d(m);
  const std::vector<S> x(q.begin(), q.end()), y(v.begin(), v.end()), z(a.begin(), a.end()),
      given(std::begin(push), std::end(push));
  std::vector<S> out(6);
  ksl::section_wrench<S>(m, d, x.data(), y.data(), z.data(), s, out.data(), {3, pushed, given.data(), axes});
  return numbers(out.begin(), out.end());
}

void check_same(const numbers &found, const numbers &expected, double tolerance = 1e-11) {
  for (std::size_t i = 0; i < 6; ++i)
    CHECK(std::fabs(found[i] - expected[i]) < tolerance);
}

} // namespace

TEST_CASE(
    "a section carries what a weld would: an inertia that is given, beyond or with the joint that carries the link") {
  for (const ksl::expressed_in axes : {ksl::expressed_in::frame, ksl::expressed_in::world}) {
    const numbers expected = weld(1.3, 2.1, axes);
    ksl::link_section s = section_of(ksl::section_share::inertia);
    const inertia near_one = near_inertia(1.3), whole = robot(1.3, 2.1, false).links[arm].inertia;
    s.inertia = {
        whole.m - near_one.m,     {whole.h.x - near_one.h.x, whole.h.y - near_one.h.y, whole.h.z - near_one.h.z},
        whole.Ixx - near_one.Ixx, whole.Iyy - near_one.Iyy,
        whole.Izz - near_one.Izz, whole.Ixy - near_one.Ixy,
        whole.Iyz - near_one.Iyz, whole.Izx - near_one.Izx};
    check_same(section<double>(1.3, 2.1, s, axes), expected);
    check_same(section<float>(1.3, 2.1, s, axes), expected, 1e-4);
    // from the other side: the wrench is the opposite one
    numbers opposite = expected;
    for (double &x : opposite)
      x = -x;
    ksl::link_section back = section_of(ksl::section_share::inertia);
    back.inertia = near_one;
    for (double &x : back.normal)
      x = -x;
    check_same(section<double>(1.3, 2.1, back, axes), opposite);
    const int joints[2] = {mount, shoulder}; // named ones, whatever the plane says
    back.beyond_n = 2, back.beyond = joints, back.normal[2] = 5;
    check_same(section<double>(1.3, 2.1, back, axes), opposite);
  }
}

TEST_CASE("a section takes the link's own inertia by its centre of mass, or a fraction of it") {
  const ksl::expressed_in axes = ksl::expressed_in::frame;
  check_same(section<double>(0, 2.1, section_of(ksl::section_share::by_center), axes), weld(0, 2.1, axes));
  check_same(section<double>(1.3, 0, section_of(ksl::section_share::by_center), axes), weld(1.3, 0, axes));
  ksl::link_section s = section_of(ksl::section_share::fraction);
  s.fraction = 0.3;
  const numbers some = section<double>(1.3, 2.1, s, axes);
  s.share = ksl::section_share::inertia, s.inertia = scaled(robot(1.3, 2.1, false).links[arm].inertia, 0.3);
  const numbers same = section<double>(1.3, 2.1, s, axes);
  check_same(some, same);
  s.inertia = {};
  CHECK(std::fabs(section<double>(1.3, 2.1, s, axes)[0] - some[0]) > 1); // the fraction counts
}

TEST_CASE("a section's wrench in the world's axes, and with its moment first") {
  const ksl::expressed_in axes = ksl::expressed_in::frame;
  ksl::link_section s = section_of(ksl::section_share::by_center);
  const numbers own = section<double>(1.3, 2.1, s, axes);
  s.order = ksl::component_order::angular_first;
  const numbers moment_first = section<double>(1.3, 2.1, s, axes);
  for (std::size_t i = 0; i < 6; ++i)
    CHECK(moment_first[i] == own[(i + 3) % 6]);
  s.order = ksl::component_order::linear_first, s.axes = ksl::expressed_in::world;
  const numbers in_world = section<double>(1.3, 2.1, s, axes);
  const ksl::model m(robot(1.3, 2.1, false));
  ksl::data d(m);
  const ksl::mat3x3<double> R = ksl::frame_pose(m, d, q.data(), arm).R;
  for (std::size_t k : {0u, 3u}) {
    const double x = own[k], y = own[k + 1], z = own[k + 2];
    CHECK(in_world[k] == doctest::Approx(R.m00 * x + R.m01 * y + R.m02 * z).epsilon(1e-12));
    CHECK(in_world[k + 1] == doctest::Approx(R.m10 * x + R.m11 * y + R.m12 * z).epsilon(1e-12));
    CHECK(in_world[k + 2] == doctest::Approx(R.m20 * x + R.m21 * y + R.m22 * z).epsilon(1e-12));
  }
}

TEST_CASE("joints in the plane of a section: one that carries the link is near, those that it carries are beyond") {
  const ksl::model m(robot(1.3, 2.1, false));
  ksl::link_section s = section_of(ksl::section_share::by_center);
  const auto beyond = [&](double x, double y, double z) {
    s.point[0] = x, s.point[1] = y, s.point[2] = z;
    return std::array{ksl::is_beyond(m, s, shoulder), ksl::is_beyond(m, s, wrist), ksl::is_beyond(m, s, mount)};
  };
  s.normal[0] = 0, s.normal[1] = 0, s.normal[2] = 1;
  CHECK(beyond(0, 0, 0) == std::array{false, true, true});
  CHECK(beyond(7, 7, 0.9) == std::array{false, true, false});
  CHECK(beyond(7, 7, 0.2) == std::array{false, true, true});
  CHECK(beyond(7, 7, -0.1) == std::array{true, true, true});
  s.normal[0] = 1, s.normal[2] = 0;
  CHECK(beyond(0.1, 7, 7) == std::array{false, true, false});
  s.normal[0] = 0, s.normal[1] = -1;
  CHECK(beyond(7, 0.1, 7) == std::array{true, true, true});
  CHECK(beyond(7, -0.05, 7) == std::array{false, true, false});
}
