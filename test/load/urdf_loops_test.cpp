// Loops in URDF and SDF: the elements that state them, links with two parents, drives, what is written, and what is refused.
#include "refusal.hpp"

#include "description/structure/loops.hpp"
#include "ksl/urdf.hpp"
#include "load/robot_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace ksl;
using ksl::test::check_message;
using ksl::test::refusal;

namespace {

using A = algebra<double>;

/// Links base, a and b on joints about z, and what is given, from line 4 on.
std::string two_arms(const std::string &inside) {
  const auto arm = [](const std::string &link, const std::string &x) {
    return "<link name=\"" + link + "\"/><joint name=\"j" + link +
           "\" type=\"continuous\"><parent link=\"base\"/><child link=\"" + link + "\"/><origin xyz=\"" + x +
           " 0 0\"/><axis xyz=\"0 0 1\"/></joint>\n";
  };
  return "<robot name=\"r\" version=\"1.1\"><link name=\"base\"/>\n" + arm("a", "0") + arm("b", "1") + inside +
         "</robot>";
}

std::string constraint(const std::string &type, const std::string &inside) {
  return "<constraint name=\"c\" type=\"" + type + "\"><parent link=\"a\"/><child link=\"b\"/>" + inside +
         "</constraint>";
}

loop_description loop_of(const std::string &inside) { return read_urdf_text(two_arms(inside), "r.urdf").loops.at(0); }

vec3<double> turned(const mat3x3<double> &R, const vec3<double> &v) {
  vec3<double> out;
  A::product_drv(&R, &v, &out);
  return out;
}

void check_near(const vec3<double> &found, const vec3<double> &expected, double rounding = 1e-15) {
  CHECK(std::fabs(found.x - expected.x) < rounding);
  CHECK(std::fabs(found.y - expected.y) < rounding);
  CHECK(std::fabs(found.z - expected.z) < rounding);
}

bool same_bits(const SE3<double> &a, const SE3<double> &b) { return std::memcmp(&a, &b, sizeof a) == 0; }

void check_round_trip(const robot_description &robot) {
  const std::string text = urdf_text(robot);
  const robot_description again = read_urdf_text(text, "again.urdf");
  REQUIRE(again.loops.size() == robot.loops.size());
  for (std::size_t i = 0; i < robot.loops.size(); ++i) {
    const loop_description &x = robot.loops[i], &y = again.loops[i];
    CHECK((x.name == y.name && x.kind == y.kind && x.predecessor == y.predecessor && x.successor == y.successor));
    CHECK((same_bits(x.predecessor_pose, y.predecessor_pose) && same_bits(x.successor_pose, y.successor_pose)));
    CHECK((std::memcmp(&x.axis, &y.axis, sizeof x.axis) == 0 && std::memcmp(&x.axis2, &y.axis2, sizeof x.axis2) == 0));
    CHECK(x.pitch == y.pitch);
  }
  CHECK(again.drives == robot.drives);
  robot_description bare = again;
  bare.unused = robot.unused; // remarks
  CHECK(urdf_text(bare) == text);
}

} // namespace

TEST_CASE("loops: the axes of a constraint align its frames, origins leave the rest") {
  const loop_description same =
      loop_of(constraint("revolute", "<parent_origin xyz=\"1 2 3\" rpy=\"0.1 0.2 0.3\"/><parent_axis xyz=\"0 -2 0\"/>"
                                     "<child_origin xyz=\"4 5 6\" rpy=\"-0.3 0 0\"/><child_axis xyz=\"0 -1 0\"/>"));
  CHECK((same.kind == joint_kind::revolute && same.predecessor == 1 && same.successor == 2 && same.at.line == 4));
  check_near(same.axis, {0, -1, 0});
  check_near(same.predecessor_pose.t, {1, 2, 3});
  check_near(same.successor_pose.t, {4, 5, 6});
  CHECK(same.successor_pose.R.m11 == std::cos(-0.3)); // not turned

  // other axes: the successor's frame has its own direction where the predecessor has its components
  const struct {
    const char *a, *b;
    vec3<double> axis, on_successor;
  } cases[] = {{"0 0 1", "1 0 0", {0, 0, 1}, {1, 0, 0}},
               {"0 0 1", "0 0 -3", {0, 0, 1}, {0, 0, -1}},
               {"1 0 0", "0.6 0.8 0", {1, 0, 0}, {0.6, 0.8, 0}},
               {"0 -1 0", "0 1 0", {0, -1, 0}, {0, 1, 0}}};
  for (const auto &[a, b, axis, on_successor] : cases) {
    const loop_description other = loop_of(
        constraint("prismatic", "<parent_axis xyz=\"" + std::string(a) + "\"/><child_axis xyz=\"" + b + "\"/>"));
    check_near(other.axis, axis);
    check_near(turned(other.successor_pose.R, other.axis), on_successor);
  }
  // the smallest rotation: what is across both axes stays
  const loop_description least =
      loop_of(constraint("revolute", "<parent_axis xyz=\"1 0 0\"/><child_axis xyz=\"0.6 0.8 0\"/>"));
  check_near(turned(least.successor_pose.R, {0, 0, 1}), {0, 0, 1});
  // for any axes a and b, a goes to b and a × b stays, so that a × (a × b) goes to b × (a × b); of opposite ones it is half a turn
  const auto cross = [](const vec3<double> &x, const vec3<double> &y) {
    vec3<double> out;
    A::cross_vv(&x, &y, &out);
    return out;
  };
  const auto axes = [](const vec3<double> &a, const vec3<double> &b, const std::string &more = "") {
    const auto xyz = [](const vec3<double> &v) {
      return std::to_string(v.x) + " " + std::to_string(v.y) + " " + std::to_string(v.z);
    };
    return loop_of(constraint(more.empty() ? "revolute" : "universal",
                              "<parent_axis xyz=\"" + xyz(a) + "\"/><child_axis xyz=\"" + xyz(b) + "\"/>" + more))
        .successor_pose.R;
  };
  const vec3<double> some[] = {{0.48, 0.6, 0.64}, {-0.48, 0.64, 0.6}, {0.64, 0.48, -0.6}, {0.6, -0.64, 0.48}};
  for (const vec3<double> &a : some) {
    for (const vec3<double> &b : some) {
      const vec3<double> n = cross(a, b);
      const mat3x3<double> R = axes(a, b);
      check_near(turned(R, a), b, 1e-14), check_near(turned(R, n), n, 1e-14);
      check_near(turned(R, cross(a, n)), cross(b, n), 1e-14);
    }
    const mat3x3<double> half = axes(a, {-a.x, -a.y, -a.z});
    check_near(turned(half, a), {-a.x, -a.y, -a.z}, 1e-14);
    for (const vec3<double> &x : some)
      check_near(turned(half, turned(half, x)), x, 1e-14);
    CHECK(half.m00 + half.m11 + half.m22 == doctest::Approx(-1));
  }
  // two axes on both sides: the second one goes to the half-plane of the other's
  const vec3<double> a = some[0], b = some[1], a2 = {0.64, 0, -0.48}, b2 = {0, -0.6, 0.64};
  const mat3x3<double> R = axes(a, b, "<parent_axis2 xyz=\"0.64 0 -0.48\"/><child_axis2 xyz=\"0 -0.6 0.64\"/>");
  const vec3<double> there = cross(b, turned(R, a2)), wanted = cross(b, b2), off = cross(there, wanted);
  check_near(turned(R, a), b, 1e-14), check_near(off, {0, 0, 0}, 1e-14);
  CHECK(A::dot_vv(&there, &wanted) > 0);
  // one axis alone is that of both sides
  check_near(loop_of(constraint("revolute", "<child_axis xyz=\"0 3 4\"/>")).axis, {0, 0.6, 0.8});
}

TEST_CASE("loops: constraints of the other kinds") {
  const loop_description two = loop_of(constraint(
      "universal",
      "<parent_axis xyz=\"0 0 1\"/><parent_axis2 xyz=\"0 1 0\"/><child_axis xyz=\"1 0 0\"/><child_axis2 xyz=\"0 0 1\"/>"));
  check_near(turned(two.successor_pose.R, two.axis), {1, 0, 0});
  check_near(turned(two.successor_pose.R, two.axis2), {0, 0, 1});
  const loop_description one_each =
      loop_of(constraint("universal", "<parent_axis xyz=\"0 0 1\"/><child_axis xyz=\"1 0 0\"/>"));
  check_near(one_each.axis, {0, 0, 1});
  check_near(one_each.axis2, {1, 0, 0});
  CHECK(one_each.successor_pose.R.m00 == 1);
  const loop_description screw =
      loop_of(constraint("helical", "<parent_axis xyz=\"0 0 1\"/><screw_thread_pitch value=\"0.005\"/>"));
  CHECK(*screw.pitch == doctest::Approx(0.005 / 6.283185307179586));
  const robot_description ball = read_urdf_text(
      two_arms(constraint("spherical", "<parent_axis xyz=\"0 0 1\"/><limit effort=\"3\"/><dynamics damping=\"1\"/>")),
      "r.urdf");
  CHECK(ball.loops.at(0).kind == joint_kind::spherical);
  std::string unused;
  for (const std::string &line : ball.unused)
    unused += line + "\n";
  CHECK(unused.find("joint c: parent_axis (no effect on a spherical joint)") != unused.npos);
  CHECK(unused.find("joint c: limit, dynamics (not used, since the joint closes a loop)") != unused.npos);
}

TEST_CASE("loops: the elements of Isaac Sim and of URDF+") {
  const loop_description isaac =
      loop_of("<loop_joint name=\"c\" type=\"continuous\"><link1 link=\"b\" xyz=\"1 0 0\" rpy=\"0 0 0.5\"/>"
              "<link2 link=\"a\" xyz=\"0 2 0\"/><axis xyz=\"0 0 1\"/></loop_joint>");
  CHECK((isaac.predecessor == 2 && isaac.successor == 1 && isaac.kind == joint_kind::continuous));
  check_near(isaac.predecessor_pose.t, {1, 0, 0});
  CHECK(isaac.predecessor_pose.R.m00 == std::cos(0.5));
  check_near(isaac.successor_pose.t, {0, 2, 0});
  const loop_description plus =
      loop_of("<loop name=\"c\" type=\"fixed\"><predecessor link=\"a\"><origin xyz=\"1 0 0\"/></predecessor>"
              "<successor link=\"b\"><origin xyz=\"0 2 0\" rpy=\"0 0 0.5\"/></successor></loop>");
  CHECK((plus.predecessor == 1 && plus.successor == 2 && plus.kind == joint_kind::fixed));
  check_near(plus.predecessor_pose.t, {1, 0, 0});
  CHECK(plus.successor_pose.R.m00 == std::cos(0.5));
  const std::string coupling =
      "<coupling name=\"k\"><predecessor link=\"a\"/><successor link=\"b\"/><ratio value=\"-2\"/></coupling>";
  const joint_description follower = read_urdf_text(two_arms(coupling), "r.urdf").joints.at(1);
  REQUIRE(follower.mimic.has_value());
  CHECK((follower.mimic->joint == "ja" && follower.mimic->multiplier == -2 && follower.mimic->offset == 0));
  CHECK(!read_urdf_text(two_arms(coupling), "r.urdf", {.mimic_independent = true}).joints.at(1).mimic);
  // links that are welded to those that move, by joints behind them in the file
  const auto joint = [](const std::string &name, const std::string &type, const std::string &parent,
                        const std::string &child) {
    return "<link name=\"" + child + "\"/><joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
           "\"/><child link=\"" + child + "\"/></joint>";
  };
  const robot_description welded = read_urdf_text(
      two_arms(joint("jd", "continuous", "base", "d") + joint("we", "fixed", "d", "e") +
               joint("wf", "fixed", "b", "f") +
               "<coupling name=\"k\"><predecessor link=\"f\"/><successor link=\"e\"/><ratio value=\"3\"/></coupling>"),
      "r.urdf");
  for (const joint_description &each : welded.joints)
    CHECK(each.mimic.has_value() == (each.name == "jd"));
  CHECK((welded.joints.at(2).mimic->joint == "jb" && welded.joints.at(2).mimic->multiplier == 3));
}

TEST_CASE("loops: of two joints to one link the later closes a loop, unless the tree needs it") {
  const std::string links = "<robot name=\"r\"><link name=\"base\"/><link name=\"a\"/><link name=\"b\"/>";
  const auto joint = [](const std::string &name, const std::string &parent, const std::string &child) {
    return "<joint name=\"" + name + "\" type=\"prismatic\"><parent link=\"" + parent + "\"/><child link=\"" + child +
           "\"/><origin xyz=\"1 2 3\" rpy=\"0 0 1\"/><axis xyz=\"0 0 2\"/><limit lower=\"0\" upper=\"1\"/></joint>";
  };
  const robot_description robot = read_urdf_text(
      links + joint("i", "base", "a") + joint("j", "base", "b") + joint("k", "a", "b") + "</robot>", "r.urdf");
  REQUIRE((robot.joints.size() == 2 && robot.loops.size() == 1));
  const loop_description &loop = robot.loops[0];
  CHECK((loop.name == "k" && loop.predecessor == 1 && loop.successor == 2 && loop.kind == joint_kind::prismatic));
  check_near(loop.predecessor_pose.t, {1, 2, 3});
  CHECK((loop.axis.z == 1 && loop.successor_pose.R.m00 == 1 && loop.successor_pose.t.x == 0));
  CHECK(robot.unused == std::vector<std::string>{"joint k: limit (not used, since the joint closes a loop)"});
  check_round_trip(robot);
  // but one with a motor is a coordinate, if another can close the loop
  const std::string motor = "<transmission name=\"t\"><joint name=\"k\"/><actuator name=\"m\"/></transmission>";
  const robot_description driven = read_urdf_text(
      links + joint("i", "base", "a") + joint("j", "base", "b") + joint("k", "a", "b") + motor + "</robot>", "r.urdf");
  CHECK((driven.loops.at(0).name == "j" && driven.drives == std::vector<std::string>{"k"}));
  // the first joints to a and b are a cycle
  const robot_description other = read_urdf_text(
      links + joint("i", "b", "a") + joint("j", "a", "b") + joint("k", "base", "b") + "</robot>", "r.urdf");
  CHECK((other.joints.size() == 2 && other.loops.at(0).name == "j"));
  check_message(refusal(links + joint("i", "b", "a") + joint("j", "a", "b") + "</robot>"), {"links", "form a cycle"});
}

TEST_CASE("loops: transmissions and interfaces of commands name drives") {
  const std::string transmission = "<transmission name=\"t\"><joint name=\"jb\"/><actuator name=\"m\"/></transmission>";
  const std::string control = "<ros2_control name=\"x\"><joint name=\"ja\"><command_interface name=\"effort\"/></joint>"
                              "<joint name=\"c\"><command_interface name=\"effort\"/></joint>"
                              "<joint name=\"jb\"><state_interface name=\"position\"/></joint></ros2_control>";
  const std::string loop = constraint("revolute", "<parent_axis xyz=\"0 0 1\"/>");
  const auto drives = [&](const std::string &inside) {
    return read_urdf_text(two_arms(loop + inside), "r.urdf").drives;
  };
  CHECK(!drives(""));
  CHECK(drives(transmission) == std::vector<std::string>{"jb"});
  CHECK(drives(control) == std::vector<std::string>{"ja"});
  CHECK(drives(transmission + control) == std::vector<std::string>{"jb", "ja"});
  check_round_trip(read_urdf_text(two_arms(loop + transmission + control), "r.urdf"));
  // they are used then, and not in a tree, nor where they name no joint
  const auto is_unused = [&](const std::string &inside) {
    const std::vector<std::string> lines = read_urdf_text(two_arms(inside), "r.urdf").unused;
    return std::any_of(lines.begin(), lines.end(),
                       [](const std::string &line) { return line.find("transmission") != line.npos; });
  };
  CHECK((!is_unused(loop + transmission) && is_unused(transmission)));
  CHECK(is_unused(loop + "<transmission name=\"u\"><joint name=\"ja\"/></transmission>"));
  // a motor on the joint that closes the loop is none, which is said
  const std::vector<std::string> said = read_urdf_text(two_arms(loop + control), "r.urdf").unused;
  CHECK(std::count(said.begin(), said.end(), "joint c: command_interface (no drive, since the joint closes a loop)") ==
        1);
}

TEST_CASE("loops: what is written is read again") {
  check_round_trip(read_urdf_text(
      two_arms(
          "<constraint name=\"c\" type=\"universal\"><parent link=\"a\"/><parent_origin xyz=\"0.1 0.2 0.3\" rpy=\"0.1 0.7 -2\"/>"
          "<parent_axis xyz=\"0 1 1\"/><parent_axis2 xyz=\"1 0.1 0\"/><child link=\"b\"/>"
          "<child_origin quat_xyzw=\"0.6 0 0 0.8\"/></constraint>"
          "<loop_joint name=\"d\" type=\"helical\"><link1 link=\"a\"/><link2 link=\"b\" rpy=\"1 2 3\"/><axis xyz=\"1 2 3\"/>"
          "<screw_thread_pitch value=\"0.003\"/></loop_joint>"
          "<loop name=\"e\" type=\"planar\"><predecessor link=\"a\"/><successor link=\"b\"/><axis xyz=\"0 3 4\"/></loop>"),
      "r.urdf"));
}

TEST_CASE("loops: what can't be read is refused") {
  const std::string axis = "<parent_axis xyz=\"0 0 1\"/>";
  const struct {
    std::string inside;
    std::initializer_list<const char *> says;
  } cases[] = {
      {constraint("revolute", ""),
       {"r.urdf:4: loop joint c: a revolute joint that closes a loop needs its axis", "parent_axis"}},
      {constraint("hinge", axis), {"r.urdf:4: loop joint c: joint type \"hinge\" is unknown", "expected one of"}},
      {constraint("floating", ""),
       {"r.urdf:4: loop joint c: a floating joint leaves all freedoms", "correct its kind"}},
      {constraint("universal", axis), {"needs its second axis", "parent_axis2"}},
      {constraint("helical", axis), {"loop joint c: a helical joint needs its pitch"}},
      {"<constraint type=\"fixed\"/>", {"<constraint> has no name"}},
      {"<constraint name=\"c\" type=\"fixed\"><parent link=\"a\"/></constraint>",
       {"no <child> in <constraint>", "add <child"}},
      {"<loop_joint name=\"c\" type=\"fixed\"><link1 link=\"a\"/><link2 link=\"bb\"/></loop_joint>",
       {"link2 link \"bb\" does not exist", "did you mean \"b\"?"}},
      {"<loop name=\"c\" type=\"fixed\"><predecessor link=\"a\" xyz=\"0 0 0\"><origin/></predecessor><successor link=\"b\"/></loop>",
       {"an <origin>, and xyz", "keep one"}},
      {"<constraint name=\"c\" type=\"fixed\"><parent link=\"a\"/><child link=\"a\"/></constraint>",
       {"connects link a with itself"}},
      {"<constraint name=\"ja\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></constraint>",
       {"r.urdf:4: a second joint is named \"ja\""}},
      {"<Constraint name=\"c\"/>", {"r.urdf:4: <Constraint> would close a loop", "write <constraint"}},
      {"<x:loop_joint name=\"c\"/>", {"<x:loop_joint> would close a loop"}},
      {"<CONSTRAINT name=\"c\"/>", {"<CONSTRAINT> would close a loop"}},
      {"<gazebo><joint name=\"g\" type=\"revolute\"><parent>a</parent><child>b</child></joint></gazebo>",
       {"r.urdf:4: joint \"g\" in <gazebo> closes a loop", "<constraint>"}},
      {"<coupling name=\"k\"><predecessor link=\"a\"/><successor link=\"b\"/></coupling>",
       {"coupling k: <coupling> has no <ratio>"}},
      {"<coupling name=\"k\"><predecessor link=\"a\"/><successor link=\"base\"/><ratio value=\"1\"/></coupling>",
       {"r.urdf:4: coupling k: it couples links a and base", "<mimic>"}},
      {constraint("fixed", "") +
           "<link name=\"d\"/><joint name=\"jd\" type=\"continuous\"><parent link=\"base\"/><child link=\"d\"/><mimic joint=\"c\"/></joint>",
       {"joint jd: it mimics joint \"c\", which closes a loop"}}};
  for (const auto &each : cases) {
    CAPTURE(each.inside);
    check_message(refusal(two_arms(each.inside)), each.says);
  }
}

TEST_CASE("loops: a file is read without them, if asked for, whatever they say") {
  const robot_description cut = read_urdf_text(
      two_arms(constraint("hinge", "") +
               "<x:loop_joint/><joint name=\"k\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>"),
      "r.urdf", {.cut_loops = true});
  CHECK((cut.loops.empty() && cut.joints.size() == 2 && !cut.drives));
}

TEST_CASE("loops: in SDF, a joint whose child has a parent closes one, with frames from the poses of the links") {
  const auto link = [](const std::string &name, const std::string &pose) {
    return "<link name=\"" + name + "\"><pose>" + pose + "</pose></link>";
  };
  const auto joint = [](const std::string &name, const std::string &parent, const std::string &child,
                        const std::string &inside = "") {
    return "<joint name=\"" + name + "\" type=\"revolute\"><parent>" + parent + "</parent><child>" + child +
           "</child>" + inside + "<axis><xyz>0 0 1</xyz></axis></joint>";
  };
  const robot_description robot = read_robot_text(
      "<sdf version=\"1.10\"><model name=\"m\">" + link("a", "0 0 0 0 0 0") +
          link("b", "1 0 0 0 0 1.5707963267948966") + joint("i", "world", "a") + joint("j", "world", "b") +
          joint("k", "a", "b", "<pose>0 0.5 0 0 0 0</pose>") + "</model></sdf>",
      "r.sdf");
  REQUIRE(robot.loops.size() == 1);
  const loop_description &loop = robot.loops[0];
  CHECK((loop.name == "k" && loop.predecessor == 1 && loop.successor == 2));
  check_near(loop.predecessor_pose.t, {0.5, 0, 0}); // y of b is −x of a
  check_near(loop.successor_pose.t, {0, 0.5, 0});
  check_near(turned(loop.predecessor_pose.R, {1, 0, 0}), {0, 1, 0});
  CHECK(loop.successor_pose.R.m00 == 1);
}
