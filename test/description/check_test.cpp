#include "refusal.hpp"

#include <cmath>
#include <limits>

using namespace ksl;
using ksl::test::check_message;

namespace {

/// Links named l0, l1, ... and fixed joints j0, j1, ... between the pairs given; no file, no lines.
robot_description robot_of(int links, std::initializer_list<std::pair<int, int>> ends) {
  robot_description robot;
  for (int i = 0; i < links; ++i)
    robot.links.push_back({"l" + std::to_string(i), {}, {}, false, false, {}});
  for (const auto &[parent, child] : ends) {
    joint_description joint;
    joint.name = "j" + std::to_string(robot.joints.size());
    joint.parent = parent;
    joint.child = child;
    robot.joints.push_back(joint);
  }
  return robot;
}

std::string refusal(const robot_description &robot) {
  return test::refusal_of([&] { check_tree(robot); });
}

/// The fault that check_inertias finds in a link, without "link l0: ".
std::string fault(const spatial_inertia<double> &I) {
  robot_description robot = robot_of(1, {});
  robot.links[0].inertia = I;
  const auto lines = check_inertias(robot);
  if (lines.empty())
    return "none";
  CHECK(lines.size() == 1);
  CHECK(lines[0].substr(0, 9) == "link l0: ");
  return lines[0].substr(9);
}

/// A body of the centroidal inertia diag(a, b, c) turned by `angle` about z, with its centroid at c.
spatial_inertia<double> body(double m, double a, double b, double c, double angle = 0, vec3<double> at = {0, 0, 0}) {
  const double cz = std::cos(angle), sz = std::sin(angle);
  spatial_inertia<double> I{};
  I.m = m;
  I.h = {m * at.x, m * at.y, m * at.z};
  I.Ixx = a * cz * cz + b * sz * sz + m * (at.y * at.y + at.z * at.z);
  I.Iyy = a * sz * sz + b * cz * cz + m * (at.z * at.z + at.x * at.x);
  I.Izz = c + m * (at.x * at.x + at.y * at.y);
  I.Ixy = (a - b) * sz * cz - m * at.x * at.y;
  I.Iyz = -m * at.y * at.z;
  I.Izx = -m * at.z * at.x;
  return I;
}

} // namespace

TEST_CASE("a tree has one root") {
  CHECK(check_tree(robot_of(1, {})) == 0);
  CHECK(check_tree(robot_of(4, {{2, 0}, {0, 1}, {2, 3}})) == 2);
}

TEST_CASE("a long chain needs no deep stack") {
  robot_description robot = robot_of(20000, {});
  for (int i = 1; i < 20000; ++i) {
    joint_description joint;
    joint.name = "j" + std::to_string(i);
    joint.parent = i;
    joint.child = i - 1;
    robot.joints.push_back(joint);
  }
  CHECK(check_tree(robot) == 19999);
}

TEST_CASE("what is no tree is refused, without file and line where there are none") {
  check_message(refusal(robot_of(0, {})), {"no link", "at least one"});
  check_message(refusal(robot_of(2, {})), {"links l0, l1 have no parent", "join them"});
  check_message(refusal(robot_of(2, {{0, 0}, {0, 1}})),
                {"joint j0: link l0 is both its parent and its child", "name two"});
  check_message(refusal(robot_of(3, {{0, 2}, {1, 2}, {0, 1}})), {"link l2 has two parents", "j0", "j1", "remove one"});
  check_message(refusal(robot_of(4, {{1, 2}, {2, 3}, {3, 1}})),
                {"links l", "l1", "l2", "l3", "cycle", "j0", "remove one"});
  check_message(refusal(robot_of(2, {{0, 1}, {1, 0}})), {"l0", "l1", "cycle", "j0", "j1"});
  check_message(refusal(robot_of(2, {{0, 7}})), {"joint j0", "number 7", "expected 0 to 1"});
  check_message(refusal(robot_of(2, {{-1, 1}})), {"joint j0", "number -1"});
  check_message(refusal(robot_of(2, {{1, -1}})), {"joint j0", "its child number -1"});
  check_message(refusal(robot_of(3, {})), {"links l0, l1, l2 have no parent"});
  CHECK(refusal(robot_of(4, {{1, 2}, {2, 3}, {3, 1}})).find("l0") == std::string::npos);
}

TEST_CASE("names") {
  robot_description robot = robot_of(2, {{0, 1}});
  robot.links[1].name = "l0";
  check_message(refusal(robot), {"a second link is named \"l0\"", "rename"});
  robot.links[1].name = "";
  check_message(refusal(robot), {"a link has no name"});
  robot = robot_of(3, {{0, 1}, {0, 2}});
  robot.joints[1].name = "j0";
  robot.joints[0].at.line = 3;
  robot.joints[1].at.line = 9;
  robot.file = "r.urdf";
  check_message(refusal(robot), {"r.urdf:9: a second joint is named \"j0\"", "the first is in line 3", "rename"});
  robot.file.clear();
  check_message(refusal(robot), {"line 9: a second joint is named \"j0\""});
  // a link and a joint may share a name
  robot = robot_of(2, {{0, 1}});
  robot.joints[0].name = "l0";
  CHECK(check_tree(robot) == 0);
}

TEST_CASE("a helical joint has a pitch") {
  robot_description robot = robot_of(2, {{0, 1}});
  robot.joints[0].kind = joint_kind::helical;
  check_message(refusal(robot), {"joint j0: a helical joint needs a finite pitch", "metres for each radian"});
  robot.joints[0].pitch = std::numeric_limits<double>::infinity();
  check_message(refusal(robot), {"needs a finite pitch"});
  robot.joints[0].pitch = 0.002;
  CHECK(check_tree(robot) == 0);
}

TEST_CASE("axes have length 1, and those of a universal joint are not parallel") {
  robot_description robot = robot_of(2, {{0, 1}});
  robot.joints[0].kind = joint_kind::universal;
  check_message(refusal(robot), {"joint j0: a universal joint needs a second axis", "give it"});
  robot.joints[0].axis2 = {-1, 0, 0}; // the first axis is x if none is given
  check_message(refusal(robot), {"joint j0: a universal joint needs two axes that are not parallel"});
  robot.joints[0].axis2 = {0, 2, 0};
  check_message(refusal(robot), {"joint j0: its second axis has length 2, expected 1"});
  robot.joints[0].axis2 = {0.6, 0.8, 0};
  CHECK(check_tree(robot) == 0);
  robot.joints[0].axis = {0, 0, 0.5};
  check_message(refusal(robot), {"joint j0: its axis has length 0.5, expected 1"});
}

TEST_CASE("numbers that no mechanism has") {
  robot_description robot = robot_of(2, {{0, 1}});
  robot.links[1].inertia.m = -2;
  check_message(refusal(robot), {"link l1", "mass is -2, negative", "zero or more"});
  robot.links[1].inertia.m = std::numeric_limits<double>::quiet_NaN();
  check_message(refusal(robot), {"link l1", "not finite"});
  robot = robot_of(2, {{0, 1}});
  robot.joints[0].placement.t.x = std::numeric_limits<double>::infinity();
  check_message(refusal(robot), {"joint j0", "not finite"});
}

TEST_CASE("inertias of bodies pass") {
  CHECK(fault({}) == "none");
  CHECK(fault(body(2, 0, 0, 0)) == "none");                     // a point
  CHECK(fault(body(2, 0, 0, 0, 0, {0.1, -0.7, 30})) == "none"); // a point far off
  CHECK(fault(body(1, 0, 1, 1, 0.3)) == "none");                // a thin rod
  CHECK(fault(body(1, 1, 2, 3, 0.7, {5, -3, 2})) == "none");    // a plate: the triangle inequality is tight
  CHECK(fault(body(1, 1, 1, 2 * (1 + 2e-7))) == "none");        // within the tolerance
  CHECK(fault(body(1e-9, 1e-15, 2e-15, 2.5e-15)) == "none");
}

TEST_CASE("a plate far from its link's origin passes in spite of rounding") {
  for (int k = 1; k <= 50; ++k)
    CHECK(fault(body(1, 1e-6, 2e-6, 3e-6, 0.1 * k, {100.1 * k, 201.3, -302.7 + k})) == "none");
}

TEST_CASE("inertias that no body can have say the condition") {
  CHECK(fault(body(1, 0.0125, 0.086, 0.066)) ==
        "principal moments 0.086, 0.066, 0.0125: the largest exceeds the sum of the other two by 0.0075");
  CHECK(fault(body(1, 0.0125, 0.086, 0.066, 0.4, {0.1, 0.2, 0.3})) ==
        "principal moments 0.086, 0.066, 0.0125: the largest exceeds the sum of the other two by 0.0075");
  CHECK(fault(body(1, -1, 2, 2, 1.1)) == "principal moments 2, 2, -1: the smallest is negative");
  CHECK(fault(body(1, 1, 1, 2 * (1 + 2e-6))).find("exceeds") != std::string::npos);
  CHECK(fault(body(1, 3e-3, -1e-19, -1e-19)) ==
        "principal moments 0.003, 0, 0: the largest exceeds the sum of the other two by 0.003"); // rounding shows as 0
  // the inertia about the link's origin is not enough for its mass so far away
  CHECK(fault({2, {2, 0, 0}, 1, 1, 1, 0, 0, 0}).find("negative") != std::string::npos);
  CHECK(fault(body(0, 1, 1, 1)) == "mass 0 with an inertia that is not zero");
  CHECK(fault(body(-1, 0, 0, 0)) == "mass -1 is negative");
  CHECK(fault({1, {0, 0, 0}, std::numeric_limits<double>::infinity(), 1, 1, 0, 0, 0}) ==
        "mass or inertia is not finite");
}

namespace {

/// l0 to l5 in a row: l1 welded to l0, l2 hinged to l1, l3 and l4 welded on, l5 slides on l4; all with geometry, l2 and
/// l5 with a mass.
robot_description arm() {
  robot_description robot = robot_of(6, {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}});
  robot.joints[1].kind = joint_kind::revolute;
  robot.joints[4].kind = joint_kind::prismatic;
  for (link_description &link : robot.links)
    link.has_geometry = true;
  robot.links[2].inertia = robot.links[5].inertia = body(1, 1, 1, 1);
  return robot;
}

/// The links that check_masses has a line for.
std::string without_mass(const robot_description &robot, bool floating_base = false,
                         const std::set<std::string> &with_payload = {}) {
  std::string names;
  for (const std::string &line : check_masses(robot, floating_base, with_payload, false)) {
    CHECK(line.substr(0, 5) == "link ");
    CHECK(line.find(": moves and has geometry, but no mass") != std::string::npos);
    names += line.substr(5, line.find_first_of(" :", 5) - 5) + " ";
  }
  return names;
}

} // namespace

TEST_CASE("links that move and have geometry need a mass") {
  robot_description robot = arm();
  CHECK(without_mass(robot) == "l3 l4 ");
  CHECK(without_mass(robot, true) == "l0 l1 l3 l4 ");
  CHECK(without_mass(robot, true, {"l1", "l4"}) == "l0 l3 ");
  robot.links[3].has_geometry = false; // a frame between two joints needs none
  CHECK(without_mass(robot) == "l4 ");
  robot.links[4].at.line = 7;
  CHECK(check_masses(robot, false, {}, false)[0] ==
        "link l4 (line 7): moves and has geometry, but no mass: its weight and inertia are missing");
  // listed from the tip to the root: two links before the one that they are welded to
  robot = robot_of(4, {{3, 2}, {2, 1}, {1, 0}});
  robot.joints[0].kind = joint_kind::continuous;
  for (link_description &link : robot.links)
    link.has_geometry = true;
  robot.links[2].inertia = body(1, 1, 1, 1);
  CHECK(without_mass(robot) == "l0 l1 ");
}

TEST_CASE("one link that moves needs a mass, with geometry or without") {
  robot_description robot = arm();
  robot.file = "r.urdf";
  robot.links[2].inertia = robot.links[5].inertia = {};
  robot.links[0].inertia = body(3, 1, 1, 1); // does not move
  const auto refusal_of_masses = [&](bool floating_base) {
    return test::refusal_of([&] { check_masses(robot, floating_base, {}, false); });
  };
  const std::string none = "r.urdf: none of the links that move (l2, l3, l4, l5) has a mass";
  check_message(refusal_of_masses(false),
                {none.c_str(), "give these links a mass", "optional"}); // of a program, or another format
  robot.links[3].at.line = 7;
  check_message(refusal_of_masses(false), {none.c_str(), "add <inertial> to these links", "optional"});
  CHECK(refusal_of_masses(true) == "accepted");
  CHECK(without_mass(robot, false, {"l4"}) == "l2 l3 l5 ");
  const auto lines = check_masses(robot, false, {}, true);
  CHECK((lines.size() == 1 && lines[0].find("none of the links that move") == 0));
  for (link_description &link : robot.links)
    link.has_geometry = false;
  CHECK(refusal_of_masses(false) != "accepted");
  for (joint_description &joint : robot.joints)
    joint.kind = joint_kind::fixed;
  CHECK(refusal_of_masses(false) == "accepted"); // nothing moves
}

TEST_CASE("lines for links are warnings, or an error when strict") {
  robot_description robot = robot_of(1, {});
  warn_of_links(robot, {}, true, "mend");
  CHECK(robot.warnings.empty());
  warn_of_links(robot, {"link a: x", "link b: y"}, false, "mend");
  CHECK(robot.warnings == std::vector<std::string>{"link a: x", "link b: y"});
  CHECK(test::refusal_of([&] {
          warn_of_links(robot, {"link a: x", "link b: y", "link c: z", "link d: z", "link e: z"}, true, "mend them");
        }) == "link a: x; link b: y; link c: z; 2 more such links; mend them, or read the file without strict");
}

TEST_CASE("principal moments of full matrices") {
  // R diag(1, 2, 3.5) Rᵀ with R = (1/3) [1 -2 2; 2 -1 -2; 2 2 1], worked out by hand in ninths
  const double a = 1, b = 2, c = 3.5;
  spatial_inertia<double> I{};
  I.m = 1;
  I.Ixx = (a + 4 * b + 4 * c) / 9;
  I.Iyy = (4 * a + b + 4 * c) / 9;
  I.Izz = (4 * a + 4 * b + c) / 9;
  I.Ixy = (2 * a + 2 * b - 4 * c) / 9;
  I.Iyz = (4 * a - 2 * b - 2 * c) / 9;
  I.Izx = (2 * a - 4 * b + 2 * c) / 9;
  CHECK(fault(I) == "principal moments 3.5, 2, 1: the largest exceeds the sum of the other two by 0.5");
}
