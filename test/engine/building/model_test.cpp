// From descriptions to models: names, order, and descriptions that are no mechanism.
#include "robots.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <string>

using ksl::joint_kind;

namespace {

std::string refusal(const ksl::robot_description &r, const ksl::model_options &options = {}) {
  try {
    const ksl::model m(r, options);
  } catch (const ksl::description_error &e) {
    return e.what();
  }
  return "";
}

bool has(const std::string &text, const char *words) { return text.find(words) != std::string::npos; }

} // namespace

TEST_CASE("joints: moving ones depth first in the order of the description, then fixed ones, base last") {
  ksl::robot_description r;
  for (const char *name : {"root", "a", "b", "c", "d"})
    r.links.push_back(robots::link(name));
  r.joints = {robots::joint("second", joint_kind::prismatic, 0, 3, {}, {1, 0, 0}),
              robots::joint("weld", joint_kind::fixed, 3, 2, {}, {1, 0, 0}),
              robots::joint("first", joint_kind::revolute, 0, 1, {}, {1, 0, 0}),
              robots::joint("deep", joint_kind::floating, 2, 4, {}, {1, 0, 0})};
  const ksl::model m(r);
  std::string names;
  for (const ksl::joint_row &j : m.joints())
    names += j.name + " ";
  CHECK(names == "second deep first weld base ");
  CHECK((m.moving_joints() == 3 && m.nq() == 9 && m.nv() == 8));
  CHECK((m.joints()[1].q_index == 1 && m.joints()[2].q_index == 8 && m.joints()[2].v_index == 7));
  CHECK((m.joints()[3].q_index == -1 && m.joints()[4].parent_link == -1));
  CHECK(
      (m.find_joint("deep") == 1 && m.find_joint("none") == -1 && m.find_link("d") >= 0 && m.find_link("none") == -1));
}

TEST_CASE("names that the ground can't have") {
  ksl::robot_description r = robots::pendulum(1, 1);
  r.joints[0].name = "base";
  CHECK(ksl::model(r).joints().back().name == "ground");
  r = robots::double_pendulum(1, 1, 1, 1);
  r.joints[0].name = "base";
  r.joints[1].name = "ground";
  CHECK(ksl::model(r).find_joint("ground") == 1);
  CHECK(ksl::model(r).joints().back().name != "ground");
}

TEST_CASE("a floating base beside a joint named floating_base") {
  ksl::robot_description r = robots::double_pendulum(1, 1, 1, 1);
  r.links[0] = robots::link("ceiling",
                            robots::solid(1, {0, 0, 0}, 1, 1, 1)); // two point masses alone would move in too many ways
  ksl::model_options floating;
  floating.floating_base = true;
  CHECK(ksl::model(r, floating).joints()[0].name == "floating_base");
  CHECK(ksl::model(r, floating).description().warnings.empty());
  r.joints[0].name = "floating_base";
  const ksl::model m(r, floating);
  CHECK((m.joints()[0].name == "floating_root" && m.joints()[0].kind == ksl::joint_kind::floating &&
         m.find_joint("floating_base") == 1));
  REQUIRE(m.description().warnings.size() == 1);
  CHECK(has(m.description().warnings[0], "is called floating_root"));
  r.joints[1].name = "floating_root";
  CHECK(ksl::model(r, floating).joints()[0].name == "floating_root_");
  CHECK(ksl::model(r).description().warnings.empty());
}

TEST_CASE("payload") {
  ksl::model_options options;
  options.payloads = {{"first", 2, {0, 0, -0.5}}, {"first", 1, {0, 0, 0}}};
  const ksl::model m(robots::pendulum(1, 1), options);
  const ksl::spatial_inertia<double> I = m.links()[1].inertia;
  CHECK(I.m == 4);
  CHECK(I.h.z == doctest::Approx(-2));
  CHECK(I.Ixx == doctest::Approx(1.5));
  options.payloads = {{"nobody", 2, {0, 0, 0}}};
  CHECK(has(refusal(robots::pendulum(1, 1), options), "nobody"));
}

TEST_CASE("descriptions that are no mechanism") {
  const ksl::robot_description good = robots::double_pendulum(1, 1, 1, 1);
  ksl::robot_description r = good;
  r.joints[1].parent = 2;
  CHECK(has(refusal(r), "elbow"));
  r = good;
  r.joints[1].child = 1;
  CHECK(has(refusal(r), "first"));
  r = good;
  r.joints.pop_back();
  CHECK(has(refusal(r), "second"));
  r = good;
  r.joints[0].parent = 2; // first and second carry each other
  r.joints[1].parent = 1;
  CHECK(refusal(r) != "");
  r = good;
  r.links[2].name = "first";
  CHECK(has(refusal(r), "first"));
  r = good;
  r.joints[1].name = "shoulder";
  CHECK(has(refusal(r), "shoulder"));
  r = good;
  r.links[1].inertia.m = -1;
  CHECK(has(refusal(r), "first"));
  r = {};
  CHECK(refusal(r) != "");
  r = good;
  r.joints[1].parent = 7;
  CHECK(has(refusal(r), "elbow"));
}

TEST_CASE("finite numbers whose products are not are refused, with the link that they concern") {
  ksl::robot_description r = robots::double_pendulum(1, 1, 1, 1);
  CHECK(refusal(r).empty());
  r.links.push_back(robots::link("load", robots::solid(1e200, {0, 0, 0}, 1, 1, 1)));
  r.joints.push_back(robots::joint("weld", joint_kind::fixed, 2, 3, {1e80, 0, 0}, {})); // 1e360 kg m²
  CHECK(has(refusal(r), "link second: its place, or the inertia"));
  r = robots::double_pendulum(1, 1, 1, 1);
  r.joints[1].placement.t.z = -1e200; // the second mass is so far from the shoulder
  CHECK(has(refusal(r), "link first: its place, or the inertia"));
  r.joints[1].placement.t.z = -1e100;
  CHECK(refusal(r).empty());

  r = robots::double_pendulum(1, 1, 1, 1);
  r.links.push_back(robots::link("plate"));
  r.joints.push_back(robots::joint("weld", joint_kind::fixed, 1, 3, {1.2e308, 0, 0}, {}));
  for (const joint_kind kind :
       {joint_kind::revolute, joint_kind::universal}) { // a universal joint has a body of its own inside
    r.links.push_back(robots::link("hand", robots::solid(1, {0, 0, 0}, 1, 1, 1)));
    r.joints.push_back(robots::joint("wrist", kind, 3, 4, {1.2e308, 0, 0}, {0, 1, 0}));
    r.joints.back().axis2 = {1, 0, 0};
    CHECK(has(refusal(r), "link hand: its place, or the inertia"));
    r.links.pop_back(), r.joints.pop_back();
  }
}

TEST_CASE("a follower that stands still limits nothing, and one that moves limits its leader") {
  ksl::robot_description r = robots::double_pendulum(1, 1, 1, 1);
  r.links.push_back(robots::link("third", robots::solid(1, {0, 0, -1})));
  r.joints.push_back(robots::joint("knee", joint_kind::revolute, 2, 3, {0, 0, -1}, {0, 1, 0}));
  r.joints[2].lower = 0.2, r.joints[2].upper = 0.4;
  const auto range_of_leader = [&](double multiplier) {
    r.joints[2].mimic = ksl::mimic_description{"elbow", multiplier, 0.3, {}};
    return ksl::model(r).position_ranges()[1];
  };
  const ksl::model::position_range moved = range_of_leader(-2), still = range_of_leader(0);
  CHECK(moved.lower == doctest::Approx(-0.05).epsilon(1e-12)); // 0.3 − 2 q is between 0.2 and 0.4
  CHECK(moved.upper == doctest::Approx(0.05).epsilon(1e-12));
  CHECK((still.lower == -std::acos(-1.0) && still.upper == std::acos(-1.0)));
}

TEST_CASE("a model is copied, assigned and moved with its arrays, and views are those of the arrays it has then") {
  const double q = 0.8, v = 2.1, a = -1.7;
  // a point mass m at l below the axis, under gravity g: τ = m l² a + m g l sin q
  const auto torque = [&](double mass, double length, double g) {
    return mass * length * length * a + mass * g * length * std::sin(q);
  };
  const auto is = [&](const ksl::model &m, double expected) {
    ksl::data d(m);
    double tau;
    float single, q1 = static_cast<float>(q), v1 = static_cast<float>(v), a1 = static_cast<float>(a);
    ksl::inverse_dynamics(m, d, &q, &v, &a, &tau);
    ksl::inverse_dynamics(m, d, &q1, &v1, &a1, &single);
    return std::abs(tau - expected) < 1e-12 && std::abs(single - static_cast<float>(expected)) < 1e-4F;
  };
  const double mass = 1.3, length = 0.7, g = 9.81;
  auto m = std::make_unique<ksl::model>(robots::pendulum(mass, length));
  const ksl::model copy = *m;
  ksl::model assigned(robots::double_pendulum(1, 1, 1, 1));
  assigned = *m;
  const ksl::model moon = m->with_gravity({0, 0, -1.62}),
                   heavy = m->with_inertias({{1, robots::solid(2 * mass, {0, 0, -length})}});
  CHECK(copy.view().body != m->view().body);
  CHECK(assigned.view_single().body != m->view_single().body);
  ksl::model moved = std::move(*m);
  m.reset(); // with what stale views would look at
  ksl::model taken(robots::double_pendulum(1, 1, 1, 1));
  CHECK(is(moved, torque(mass, length, g)));
  taken = std::move(moved);
  CHECK(is(copy, torque(mass, length, g)));
  CHECK(is(assigned, torque(mass, length, g)));
  CHECK(is(taken, torque(mass, length, g)));
  CHECK(is(moon, torque(mass, length, 1.62)));
  CHECK(is(heavy, torque(2 * mass, length, g)));
}

TEST_CASE("zeros are numbers of their own type") {
  const ksl::model m(robots::double_pendulum(1, 1, 1, 1));
  const ksl::data d(m);
  CHECK(static_cast<const void *>(d.zero<double>()) != static_cast<const void *>(d.zero<float>()));
  for (int i = 0; i < m.nv(); ++i) {
    CHECK(d.zero<double>()[i] == 0);
    CHECK(d.zero<float>()[i] == 0);
  }
}

TEST_CASE(
    "limits of each number of a position: given ones, one that is given, none; and the range of random positions") {
  const double pi = std::acos(-1.0), inf = HUGE_VAL;
  ksl::robot_description r;
  r.links.push_back(robots::link("ground"));
  const auto add = [&](joint_kind kind) -> ksl::joint_description & {
    const int n = static_cast<int>(r.links.size());
    r.links.push_back(robots::link(("link" + std::to_string(n)).c_str(), robots::solid(1, {0.1, 0, 0}, 0.1, 0.1, 0.1)));
    r.joints.push_back(robots::joint(("joint" + std::to_string(n)).c_str(), kind, n - 1, n, {0.1, 0, 0}, {0, 0, 1}));
    r.joints.back().axis2 = {0, 1, 0};
    return r.joints.back();
  };
  add(joint_kind::spherical);
  ksl::joint_description &both = add(joint_kind::revolute);
  both.lower = -0.3, both.upper = 1.2;
  add(joint_kind::prismatic).lower = 0.25;
  add(joint_kind::revolute).upper = 0.5;
  add(joint_kind::revolute);
  add(joint_kind::prismatic);
  add(joint_kind::continuous);
  ksl::joint_description &sleeve = add(joint_kind::cylindrical); // angle, displacement
  sleeve.lower = -0.7, sleeve.upper = 0.1, sleeve.further[0] = {0.2, 0.9};
  ksl::joint_description &cardan = add(joint_kind::universal);
  cardan.lower = -0.4, cardan.upper = 0.6, cardan.further[0] = {-0.5, 0.8};
  ksl::joint_description &table = add(joint_kind::planar); // x, y, angle
  table.lower = -2, table.upper = 3, table.further[0] = {-4, 5}, table.further[1] = {-0.1, 0.2};
  ksl::joint_description &gantry = add(joint_kind::translation);
  gantry.further[1] = {-7, 8};
  add(joint_kind::floating);
  const ksl::model m(r);
  const double expected[][4] = {// limits, range
                                {-inf, inf, -1, 1},
                                {-inf, inf, -1, 1},
                                {-inf, inf, -1, 1},
                                {-inf, inf, -1, 1},
                                {-0.3, 1.2, -0.3, 1.2},
                                {0.25, inf, 0.25, 2.25},
                                {-inf, 0.5, 0.5 - 2 * pi, 0.5},
                                {-inf, inf, -pi, pi},
                                {-inf, inf, -1, 1},
                                {-inf, inf, -pi, pi},
                                {-0.7, 0.1, -0.7, 0.1},
                                {0.2, 0.9, 0.2, 0.9},
                                {-0.4, 0.6, -0.4, 0.6},
                                {-0.5, 0.8, -0.5, 0.8},
                                {-2, 3, -2, 3},
                                {-4, 5, -4, 5},
                                {-0.1, 0.2, -0.1, 0.2},
                                {-inf, inf, -1, 1},
                                {-inf, inf, -1, 1},
                                {-7, 8, -7, 8},
                                {-inf, inf, -1, 1},
                                {-inf, inf, -1, 1},
                                {-inf, inf, -1, 1},
                                {-inf, inf, -1, 1},
                                {-inf, inf, -1, 1},
                                {-inf, inf, -1, 1},
                                {-inf, inf, -1, 1}};
  REQUIRE(m.nq() == static_cast<int>(std::size(expected)));
  const ksl::model_view<double> view = m.view();
  for (int i = 0; i < m.nq(); ++i) {
    CAPTURE(i);
    const ksl::model::position_range range = m.position_ranges()[static_cast<std::size_t>(i)];
    CHECK((view.lower[i] == expected[i][0] && view.upper[i] == expected[i][1]));
    CHECK(range.lower == doctest::Approx(expected[i][2]).epsilon(1e-15));
    CHECK(range.upper == doctest::Approx(expected[i][3]).epsilon(1e-15));
  }
}

namespace {

/// Are the numbers of a model in single precision those in double precision, rounded?
void check_single(const ksl::model &m) {
  const ksl::model_view<double> d = m.view();
  const ksl::model_view<float> s = m.view_in<float>();
  const auto check = [](const auto &one, const auto &single, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k)
      CHECK((&single)[k] == static_cast<float>((&one)[k]));
  };
  REQUIRE((d.bodies == s.bodies && d.links == s.links));
  check(d.inertia[0], s.inertia[0], static_cast<std::size_t>(d.bodies)); // masses first
  for (int i = 0; i < d.bodies; ++i) {
    check(d.body[i].placement.R.m00, s.body[i].placement.R.m00, 12);
    check(d.augmented[i].m, s.augmented[i].m, 10);
  }
  for (int i = 0; i < d.links; ++i) {
    check(d.link[i].inertia.m, s.link[i].inertia.m, 10);
    check(d.link[i].pose.R.m00, s.link[i].pose.R.m00, 12);
  }
}

} // namespace

TEST_CASE(
    "a model's numbers in single precision are those in double precision, rounded, also where inertias were changed") {
  const ksl::model m = ksl::load(every_kind_file);
  check_single(m);
  std::vector<ksl::link_inertia> others;
  for (int l = 1; l < static_cast<int>(m.links().size()); ++l)
    others.push_back({l, robots::solid(1 + 0.1 * l, {0.01 * l, 0.02, -0.03}, 0.1, 0.2, 0.15)});
  check_single(m.with_inertias(others));
}
