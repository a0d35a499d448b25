// The builder: a copy of a robot that was read is that robot, and what is no robot is refused in words.
#include "ksl/builder.hpp"
#include "robots.hpp"
#include "same_numbers.hpp"
#include "robot_files.hpp"

#include <cmath>
#include <limits>

using namespace ksl::test;

namespace {

using ksl::joint_kind;
using vector = ksl::vec3<double>;

constexpr ksl::SE3<double> here = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
const double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// What a builder is told of a robot; the inertias in it are in the axes of their links.
ksl::builder told_of(const ksl::robot_description &robot) {
  ksl::builder b(robot.name, robot.gravity);
  for (const ksl::link_description &link : robot.links) {
    ksl::link_mass mass;
    if (link.given) {
      const auto &[xx, yy, zz, xy, yz, zx] = link.given->moments;
      mass = {link.given->mass, link.given->center_of_mass, {xx, xy, zx, xy, yy, yz, zx, yz, zz}};
    }
    b.add_link(link.name, mass);
  }
  for (const ksl::joint_description &j : robot.joints) {
    const ksl::joint_kind_row row = ksl::row_of(j.kind);
    ksl::joint_options options;
    if (row.has_axis)
      options.axis = j.given.axis;
    if (row.has_axis2)
      options.axis2 = j.given.axis2;
    if (row.has_pitch)
      options.pitch = j.pitch;
    b.add_joint(j.name, j.kind, robot.links[static_cast<std::size_t>(j.parent)].name,
                robot.links[static_cast<std::size_t>(j.child)].name, j.placement, options);
  }
  return b;
}

/// The message with which `call` is refused.
template <class Call> std::string refusal(Call call) {
  try {
    call();
  } catch (const ksl::description_error &e) {
    return e.what();
  }
  return "accepted";
}

void check_refused(const std::string &message, std::initializer_list<const char *> parts) {
  CAPTURE(message);
  for (const char *part : parts) {
    CAPTURE(part);
    CHECK(message.find(part) != std::string::npos);
  }
}

ksl::builder two_links() {
  ksl::builder b("two");
  b.add_link("ground").add_link("arm", {1, {0, 0, 1}, {}});
  return b;
}

std::string refused_joint(joint_kind kind, const ksl::joint_options &options, const ksl::SE3<double> &pose = here) {
  return refusal([&] { two_links().add_joint("j", kind, "ground", "arm", pose, options); });
}

std::string refused_mass(const ksl::link_mass &mass) {
  return refusal([&] { two_links().add_link("odd", mass); });
}

} // namespace

TEST_CASE("builder: the copy of a robot has its bits") {
  ksl::model_options floating;
  floating.floating_base = true;
  floating.gravity = {1, 2, 3};
  for (const std::string &file : {std::string(every_kind_file), robot_file("panda")}) {
    const ksl::model read = ksl::load(file);
    check_same(read, told_of(read.description()).build());
    check_same(ksl::load(file, floating), told_of(read.description()).build(floating));
  }
}

TEST_CASE("builder: gravity and base are the model's own, and options come before") {
  ksl::builder b("falling", {1, 2, 3});
  b.add_link("stone", {1, {}, {}});
  CHECK(b.build().view().gravity.y == 2);
  ksl::model_options falling;
  falling.floating_base = true;
  falling.gravity = {0, 0, -1};
  CHECK(b.build(falling).view().gravity.z == -1);
  ksl::model_options options;
  options.floating_base = true;
  options.payloads = {{"stone", 2, {0, 0, 1}}};
  const ksl::model m = b.build(options);
  CHECK(m.nv() == 6);
  const ksl::model again(m.description());
  CHECK((again.nv() == 6 && again.view().gravity.x == 1 && again.mass() == 3));
  check_same(m, again);
}

TEST_CASE("builder: masses, limits and losses as given") {
  ksl::builder b = two_links();
  ksl::joint_options options;
  options.axis = vector{0, 3, 4};
  options.lower = -1, options.upper = std::numeric_limits<double>::infinity(), options.effort = 5,
  options.damping = 0.5;
  b.add_joint("j", joint_kind::revolute, "ground", "arm", here, options);
  const ksl::robot_description robot = b.description();
  const ksl::joint_description &j = robot.joints[0];
  CHECK((j.axis.y == 0.6 && j.axis.z == 0.8 && *j.lower == -1 && !j.upper && *j.effort == 5 && !j.velocity &&
         j.damping == 0.5));
  CHECK((robot.links[1].inertia.Ixx == 1 && robot.links[1].inertia.h.z == 1 && !robot.links[0].has_inertial));
}

TEST_CASE("builder: inertias that no body can have") {
  check_refused(refused_mass({1, {}, {1, 0, 0, 0, 1, 0, 0, 0, -1}}), {"link odd", "not positive semidefinite", "-1"});
  check_refused(refused_mass({1, {}, {1, 0.5, 0, 0.4, 1, 0, 0, 0, 1}}), {"link odd", "not symmetric", "0.1"});
  check_refused(refused_mass({-1, {}, {}}), {"link odd", "-1", "negative"});
  check_refused(refused_mass({1, {not_a_number, 0, 0}, {}}), {"link odd", "not finite"});
  ksl::builder b("plate");
  b.add_link("plate", {1, {}, {1, 0, 0, 0, 1, 0, 0, 0, 3}}); // as in a file: a warning, or an error if strict
  REQUIRE(b.description().warnings.size() == 1);
  check_refused(b.description().warnings[0], {"link plate", "exceeds the sum"});
  check_refused(refusal([&] { b.build({}, {.strict = true}); }), {"link plate", "correct these inertias"});
}

TEST_CASE("builder: names and links") {
  check_refused(refusal([] { two_links().add_link("arm"); }), {"a second link", "\"arm\""});
  check_refused(refusal([] { two_links().add_link(""); }), {"no name"});
  check_refused(refusal([] { two_links().add_link("a\nb"); }), {"control character"});
  check_refused(refusal([] { two_links().add_joint("j", joint_kind::fixed, "grund", "arm", here); }),
                {"joint j", "parent link \"grund\"", "did you mean \"ground\"?"});
  check_refused(refusal([] { two_links().add_joint("j", joint_kind::fixed, "ground", "x", here); }),
                {"child link \"x\"", "add that link"});
  check_refused(refusal([] { two_links().build(); }), {"ground", "arm", "one root"});
  check_refused(refusal([] { ksl::joint_kind_named("revolut"); }), {"\"revolut\"", "did you mean \"revolute\"?"});
  CHECK(ksl::joint_kind_named("free") == joint_kind::floating);
  CHECK(ksl::joint_kind_named("screw") == joint_kind::helical);
  ksl::builder loop = two_links();
  loop.add_joint("up", joint_kind::fixed, "ground", "arm", here)
      .add_joint("down", joint_kind::fixed, "arm", "ground", here);
  check_refused(refusal([&] { loop.build(); }), {"cycle", "up"});
}

TEST_CASE("builder: what a kind of joint needs and what it must not have") {
  const vector z = {0, 0, 1};
  const auto with = [](auto change) {
    ksl::joint_options options;
    options.axis = vector{0, 0, 1};
    change(options);
    return options;
  };
  using options = ksl::joint_options;
  const options plain, on_z = with([](options &) {});
  check_refused(refused_joint(joint_kind::revolute, plain), {"joint j", "revolute joint needs an axis"});
  check_refused(refused_joint(joint_kind::revolute, with([](options &o) { o.axis = vector{0, 0, 0}; })),
                {"its axis is zero"});
  check_refused(refused_joint(joint_kind::revolute, with([](options &o) { o.axis->y = not_a_number; })),
                {"its axis is not finite"});
  check_refused(refused_joint(joint_kind::spherical, on_z), {"spherical joint has no axis"});
  check_refused(refused_joint(joint_kind::revolute, with([&](options &o) { o.axis2 = z; })),
                {"revolute joint has no axis2"});
  check_refused(refused_joint(joint_kind::revolute, with([](options &o) { o.pitch = 1; })),
                {"revolute joint has no pitch"});
  check_refused(refused_joint(joint_kind::helical, on_z), {"helical joint needs its pitch"});
  check_refused(refused_joint(joint_kind::continuous, with([](options &o) { o.lower = 1; })),
                {"continuous joint has no lower limit"});
  check_refused(refused_joint(joint_kind::revolute, with([](options &o) { o.upper = not_a_number; })),
                {"its upper limit is not a number"});
  check_refused(refused_joint(joint_kind::revolute, with([](options &o) { o.lower = 1, o.upper = 0; })),
                {"lower limit 1 is above upper limit 0"});
  check_refused(refused_joint(joint_kind::revolute, with([](options &o) { o.friction = -1; })), {"-1"});
  const auto losses = [&](joint_kind kind, auto change) {
    return refused_joint(kind, with([&](options &o) {
                           if (kind != joint_kind::revolute && kind != joint_kind::helical)
                             o.axis.reset();
                           change(o);
                         }));
  };
  for (double options::*const each :
       {&options::damping, &options::friction, &options::armature, &options::rotor_inertia}) {
    check_refused(losses(joint_kind::fixed, [&](options &o) { o.*each = 1; }),
                  {"a fixed joint has neither damping nor friction"});
    check_refused(losses(joint_kind::revolute, [&](options &o) { o.*each = std::numeric_limits<double>::infinity(); }),
                  {"is inf", "finite"});
  }
  check_refused(losses(joint_kind::spherical, [](options &o) { o.spring_stiffness = 1; }),
                {"only joints with one coordinate have springs", "a spherical joint hasn't one"});
  const char *const sentence = "gear ratio and rest position must be finite, and a width of friction positive";
  check_refused(losses(joint_kind::revolute, [](options &o) { o.gear_ratio = not_a_number; }), {sentence});
  check_refused(losses(joint_kind::revolute, [](options &o) { o.spring_rest = not_a_number; }), {sentence});
  check_refused(losses(joint_kind::revolute, [](options &o) { o.friction_width = 0; }), {sentence});
  check_refused(
      losses(joint_kind::revolute, [](options &o) { o.friction_width = std::numeric_limits<double>::infinity(); }),
      {sentence});
  CHECK(losses(joint_kind::revolute, [](options &o) { o.friction_width = 0.1; }) == "accepted");
  check_refused(losses(joint_kind::helical, [](options &o) { o.pitch = not_a_number; }), {"its pitch is not finite"});
  for (const auto &[multiplier, offset] : {std::pair{not_a_number, 0.0}, {1.0, not_a_number}}) {
    ksl::builder b = two_links();
    b.add_link("hand").add_joint("j", joint_kind::revolute, "ground", "arm", here, on_z);
    const double m = multiplier, o = offset;
    b.add_joint("k", joint_kind::revolute, "arm", "hand", here,
                with([m, o](options &follower) { follower.mimic = {"j", m, o, {}}; }));
    check_refused(refusal([&] { b.build(); }), {"joint k", "multiplier and offset of its <mimic> must be finite"});
  }
}

TEST_CASE("builder: gravity, where a description comes from, links without mass or with moments alone") {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<double, 3> gravity = {0, 0, -9.81};
    gravity[axis] = not_a_number;
    check_refused(refusal([&] { ksl::builder("moon", gravity); }), {"robot \"moon\"", "gravity is not finite"});
  }
  ksl::builder b("one link");
  b.add_link("ground").read_from("arm.xml", {"a tendon (not used)"}, {"a doubt"});
  CHECK(
      (b.description().file == "arm.xml" && b.description().unused == std::vector<std::string>{"a tendon (not used)"}));
  CHECK(b.description().warnings[0] == "a doubt");
  for (std::size_t k = 0; k < 3; ++k) { // a rotor, say: moments about one axis and no mass
    ksl::link_mass mass;
    (k == 0 ? mass.inertia.m00 : k == 1 ? mass.inertia.m11 : mass.inertia.m22) = 0.5;
    ksl::builder alone("rotor");
    const ksl::link_description link = alone.add_link("rotor", mass).description().links[0];
    CHECK((link.has_inertial && link.inertia.m == 0 && link.inertia.Ixx + link.inertia.Iyy + link.inertia.Izz == 0.5));
  }
  check_refused(refused_mass({1, {0, not_a_number, 0}, {}}), {"link odd", "not finite"});
  check_refused(refused_mass({1, {0, 0, not_a_number}, {}}), {"link odd", "not finite"});
  check_refused(refused_mass({1, {}, {not_a_number, 0, 0, 0, 1, 0, 0, 0, 1}}), {"link odd", "not finite"});
  check_refused(refusal([] { ksl::builder("empty").add_joint("j", joint_kind::fixed, "ground", "arm", here); }),
                {"parent link \"ground\" does not exist", "add that link before it"});
  ksl::link_mass skewed = {1, {}, {1, 0.1, 0, 0.1 + 1e-9, 1, 0, 0, 0, 1}}; // to rounding: the mean is taken
  ksl::builder almost("almost");
  CHECK(almost.add_link("body", skewed).description().links[0].inertia.Ixy == doctest::Approx(0.1).epsilon(1e-8));
}

TEST_CASE("builder: poses are rigid") {
  ksl::SE3<double> pose = here;
  pose.R.m00 = 1.1;
  check_refused(refused_joint(joint_kind::fixed, {}, pose), {"joint j: its pose", "not rigid"});
  pose.R.m00 = -1;
  check_refused(refused_joint(joint_kind::fixed, {}, pose), {"reflection"});
  pose.R.m00 = not_a_number;
  check_refused(refused_joint(joint_kind::fixed, {}, pose), {"not rigid"});
  pose = here;
  for (double ksl::vec3<double>::*const each : {&vector::x, &vector::y, &vector::z}) {
    pose.t.*each = not_a_number;
    check_refused(refused_joint(joint_kind::fixed, {}, pose), {"not finite"});
    pose = here;
  }
  pose.R.m00 = pose.R.m11 = std::cos(0.3f), pose.R.m10 = std::sin(0.3f),
  pose.R.m01 = -pose.R.m10; // in single precision
  ksl::builder b = two_links();
  b.add_joint("j", joint_kind::fixed, "ground", "arm", pose);
  const ksl::mat3x3<double> R = b.description().joints[0].placement.R;
  CHECK(R.m00 * R.m00 + R.m10 * R.m10 == doctest::Approx(1).epsilon(1e-15));
  CHECK(R.m10 == doctest::Approx(std::sin(0.3)).epsilon(1e-7));
}

TEST_CASE("builder: Denavit–Hartenberg tables") {
  const ksl::link_mass mass = {1, {0, 0, 0}, {}};
  const std::vector<ksl::dh_row> rows = {{0.1, 0.3, 0.2, 0.4, joint_kind::revolute, mass, {}},
                                         {-0.2, -1, 0.5, 2, joint_kind::prismatic, mass, {}}};
  for (const ksl::dh_convention convention : {ksl::dh_convention::standard, ksl::dh_convention::modified}) {
    ksl::builder b("arm"); // where its frames are: test/model/builder_test.py
    CHECK(b.add_link("base").add_dh_chain("base", rows, convention).build().mass() == 2);
    for (double ksl::dh_row::*const each :
         {&ksl::dh_row::a, &ksl::dh_row::alpha, &ksl::dh_row::d, &ksl::dh_row::theta}) {
      std::vector<ksl::dh_row> wrong = rows;
      wrong[1].*each = not_a_number;
      check_refused(refusal([&] { ksl::builder("arm").add_link("base").add_dh_chain("base", wrong, convention); }),
                    {"one of a, alpha, d, theta is not finite; mend the table"});
    }
  }
  ksl::builder b("arm");
  b.add_link("base");
  check_refused(refusal([&] {
                  b.add_dh_chain("base", {{0, 0, 0, 0, joint_kind::spherical, {}, {}}}, ksl::dh_convention::standard);
                }),
                {"row 1", "spherical"});
}
