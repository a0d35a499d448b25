#include "refusal.hpp"

#include "ksl/engine/model/joints.hpp"

#include <cmath>
#include <cstdio>
#include <locale>

using namespace ksl;

namespace {

/// Two links a and b; `joint` stands inside the joint j of the type given.
std::string robot_with(const std::string &type, const std::string &joint, const std::string &version = "1.2") {
  return "<robot name=\"r\" version=\"" + version + "\"><link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"" +
         type + "\"><parent link=\"a\"/><child link=\"b\"/>" + joint + "</joint></robot>";
}

robot_description read(const std::string &text, const read_options &options = {}) {
  return read_urdf_text(text, "r.urdf", options);
}

joint_description joint_with(const std::string &type, const std::string &joint) {
  return read(robot_with(type, joint)).joints.at(0);
}

link_description link_with(const std::string &inertial) {
  return read("<robot version=\"1.1\"><link name=\"a\"><inertial>" + inertial + "</inertial></link></robot>")
      .links.at(0);
}

void check_matrix(const mat3x3<double> &R, const double (&rows)[3][3], double within = 1e-15) {
  const double found[3][3] = {{R.m00, R.m01, R.m02}, {R.m10, R.m11, R.m12}, {R.m20, R.m21, R.m22}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      CAPTURE(i);
      CAPTURE(j);
      CHECK(std::fabs(found[i][j] - rows[i][j]) <= within);
    }
}

void check_unused(const robot_description &robot, std::vector<std::string> lines) {
  CAPTURE(robot.unused.size());
  REQUIRE(robot.unused.size() == lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i)
    CHECK(robot.unused[i] == lines[i]);
}

} // namespace

TEST_CASE("links and joints keep the order of the file, their names and lines") {
  const auto robot = read(
      "<robot name=\"two\">\n<link name=\"tip\"/>\n<link\n name=\"base\"/>\n"
      "<joint name=\"hinge\" type=\"revolute\">\n<parent link=\"base\"/><child link=\"tip\"/></joint>\n</robot>\n");
  CHECK(robot.name == "two");
  CHECK(robot.file == "r.urdf");
  REQUIRE(robot.links.size() == 2);
  CHECK(robot.links[0].name == "tip");
  CHECK(robot.links[0].at.line == 2);
  CHECK(robot.links[1].at.line == 3);
  CHECK(!robot.links[0].has_inertial);
  REQUIRE(robot.joints.size() == 1);
  const joint_description &joint = robot.joints[0];
  CHECK(joint.name == "hinge");
  CHECK(joint.at.line == 5);
  CHECK(joint.parent == 1);
  CHECK(joint.child == 0);
  CHECK(joint.kind == joint_kind::revolute);
  CHECK(joint.axis.x == 1);
  CHECK(!joint.lower);
  check_matrix(joint.placement.R, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, 0);
  CHECK(joint.placement.t.x == 0);
  CHECK(robot.unused.empty());
  CHECK(robot.warnings.empty());
}

TEST_CASE("every kind of joint") {
  for (const joint_kind kind : joint_kinds) {
    const joint_kind_row row = row_of(kind);
    const std::string needed = row.has_pitch   ? "<screw_thread_pitch value=\"0.01\"/>"
                               : row.has_axis2 ? "<axis2 xyz=\"0 1 0\"/>"
                                               : "";
    CHECK(joint_with(row.name, needed).kind == kind);
    if (row.other_name)
      CHECK(joint_with(row.other_name, needed).kind == kind);
  }
}

TEST_CASE("the pitch of a helical joint is read in metres a revolution and kept in metres a radian") {
  const joint_description joint = joint_with("helical", "<axis xyz=\"0 0 2\"/><screw_thread_pitch value=\"-0.005\"/>");
  CHECK(std::fabs(*joint.pitch - -0.005 / (2 * std::acos(-1.0))) < 1e-19);
  CHECK(joint.axis.z == 1);
  check_unused(read(robot_with("spherical", "<axis xyz=\"0 0 1\"/><screw_thread_pitch value=\"1\"/>")),
               {"joint j: axis, screw_thread_pitch (no effect on a spherical joint)"});
}

TEST_CASE("both axes of a universal joint, and the normal of a planar one") {
  const joint_description joint = joint_with("universal", "<axis xyz=\"0 0 2\"/><axis2 xyz=\"0 -3 4\"/>");
  CHECK((joint.axis.z == 1 && joint.axis2.y == -0.6 && joint.axis2.z == 0.8));
  CHECK(joint_with("universal", "<axis2 xyz=\"0 1 0\"/>").axis.x == 1);
  CHECK(joint_with("planar", "<axis xyz=\"0 0 1\"/>").axis.z == 1);
  CHECK(joint_with("planar", "").axis.x == 1); // URDF's default
  check_unused(read(robot_with("planar", "<axis2 xyz=\"0 0 1\"/><limit lower=\"1\"/>")),
               {"joint j: axis2, limit (no effect on a planar joint)"});
}

TEST_CASE("types beyond URDF are read with a warning") {
  for (const joint_kind kind : joint_kinds) {
    const joint_kind_row row = row_of(kind);
    const std::string type = row.name, needed = "<screw_thread_pitch value=\"0.01\"/><axis2 xyz=\"0 1 0\"/>";
    const bool standard = kind <= joint_kind::prismatic || kind == joint_kind::continuous ||
                          kind == joint_kind::planar || kind == joint_kind::floating;
    CAPTURE(type);
    const auto warnings = read(robot_with(type, needed)).warnings;
    CHECK(warnings.size() == (standard ? 0 : 1));
    if (!standard)
      CHECK(warnings[0] == "joint j: " + type + " is a type beyond URDF, which other readers may refuse");
  }
}

TEST_CASE("joints of Drake") {
  const auto drake = [](const std::string &type, const std::string &inside) {
    return read("<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><drake:joint name=\"j\" type=\"" + type +
                "\"><parent link=\"a\"/><child link=\"b\"/><origin xyz=\"1 2 3\"/>" + inside +
                "</drake:joint></robot>");
  };
  const robot_description ball = drake("ball", "");
  CHECK(ball.joints[0].kind == joint_kind::spherical);
  CHECK(ball.joints[0].placement.t.y == 2);
  REQUIRE(ball.warnings.size() == 1);
  CHECK(ball.warnings[0] ==
        "joint j: <drake:joint> type ball, an extension of URDF; q is a quaternion [x y z w] and v in "
        "the child's axes, Drake's are roll, pitch, yaw and in the parent's axes");
  const joint_description universal = drake("universal", "").joints[0];
  CHECK((universal.kind == joint_kind::universal && universal.axis.x == 1 && universal.axis2.y == 1));
  const robot_description planar = drake("planar", "<axis xyz=\"0 0 2\"/><dynamics damping=\"1 2 3\"/>");
  CHECK((planar.joints[0].kind == joint_kind::planar && planar.joints[0].axis.z == 1));
  CHECK(drake("planar", "").joints[0].axis.x == 1);
  check_unused(planar, {"joint j: dynamics (not used)"});
  const joint_description screw =
      drake("screw", "<axis xyz=\"0 0 1\"/><drake:screw_thread_pitch value=\"0.005\"/>").joints[0];
  CHECK((screw.kind == joint_kind::helical && screw.axis.z == 1));
  CHECK(std::fabs(*screw.pitch - 0.005 / (2 * std::acos(-1.0))) < 1e-19);
}

TEST_CASE("rpy turns about fixed axes, x first: Rz Ry Rx") {
  // roll 90° takes y to z; then yaw 90° takes x to y and leaves z
  const auto D =
      joint_with("fixed", "<origin xyz=\"1 2 +3\" rpy=\"1.5707963267948966 0 1.5707963267948966\"/>").placement;
  check_matrix(D.R, {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}});
  CHECK(D.t.x == 1);
  CHECK(D.t.y == 2);
  CHECK(D.t.z == 3);
  // atan(4/3), atan(12/5), atan(15/8) have rational sines and cosines
  const std::string angles = "0.9272952180016122 1.176005207095135 1.0808390005411683";
  const double cr = 0.6, sr = 0.8, cp = 5. / 13, sp = 12. / 13, cy = 8. / 17, sy = 15. / 17;
  check_matrix(joint_with("fixed", "<origin rpy=\"" + angles + "\"/>").placement.R,
               {{cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr},
                {sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr},
                {-sp, cp * sr, cp * cr}},
               1e-15);
}

TEST_CASE("angles near a right one are taken as written") {
  const auto R = joint_with("fixed", "<origin rpy=\"1.5708 0 0\"/>").placement.R;
  CHECK(R.m11 == std::cos(1.5708));
  CHECK(R.m11 < -3.6e-6);
}

TEST_CASE("quat_xyzw from version 1.1 on") {
  // a third of a turn about (1, 1, 1) takes x to y, y to z, z to x
  const double rows[3][3] = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
  check_matrix(joint_with("fixed", "<origin quat_xyzw=\"0.5 0.5 0.5 0.5\"/>").placement.R, rows, 0);
  // nearly unit: normalised
  check_matrix(joint_with("fixed", "<origin quat_xyzw=\"0.5002 0.5002 0.5002 0.5002\"/>").placement.R, rows, 1e-15);
  // 3-4-5: the angle about x is 2 atan(3/4), cos 7/25, sin 24/25
  check_matrix(joint_with("fixed", "<origin quat_xyzw=\"0.6 0 0 0.8\"/>").placement.R,
               {{1, 0, 0}, {0, 7. / 25, -24. / 25}, {0, 24. / 25, 7. / 25}});
  CHECK(joint_with("fixed", "<origin xyz=\"0 0 4\" quat_xyzw=\"0 0 0 1\"/>").placement.t.z == 4);
}

TEST_CASE("the axis is normalised") {
  const auto axis = joint_with("prismatic", "<axis xyz=\"3 0 -4\"/>").axis;
  CHECK(std::fabs(axis.x - 0.6) <= 1e-16);
  CHECK(axis.y == 0);
  CHECK(std::fabs(axis.z + 0.8) <= 2e-16);
  CHECK(joint_with("revolute", "<axis xyz=\"0 0 1\"/>").axis.z == 1);
  CHECK(joint_with("revolute", "<axis xyz=\"0 1e-200 0\"/>").axis.y == 1);
  CHECK(joint_with("revolute", "<axis xyz=\"0 -1e200 0\"/>").axis.y == -1);
}

TEST_CASE("limits and dynamics are kept as written") {
  const auto joint = joint_with("revolute", "<limit lower=\"-1\" upper=\"2\" effort=\"30\" velocity=\"4\"/>"
                                            "<dynamics damping=\"0.5\" friction=\"0.25\"/>");
  CHECK(joint.lower == -1.0);
  CHECK(joint.upper == 2.0);
  CHECK(joint.effort == 30.0);
  CHECK(joint.velocity == 4.0);
  CHECK(joint.damping == 0.5);
  CHECK(joint.friction == 0.25);
  const auto half = joint_with("revolute", "<limit effort=\"30\" upper=\"0\"/>");
  CHECK(!half.lower);
  CHECK(half.upper == 0.0);
  CHECK(!half.velocity);
  // a limit on a joint without limits says nothing
  const auto endless = read(robot_with("continuous", "<limit lower=\"0\" upper=\"0\" effort=\"30\"/>"));
  CHECK(!endless.joints[0].lower);
  CHECK(endless.joints[0].effort == 30.0);
  check_unused(endless, {"joint j: limit lower, limit upper (no effect on a continuous joint)"});
}

TEST_CASE("inertia about the link's origin, by the parallel-axis theorem") {
  const auto link = link_with("<origin xyz=\"1 2 3\"/><mass value=\"2\"/>"
                              "<inertia ixx=\"10\" ixy=\"0.1\" ixz=\"0.2\" iyy=\"11\" iyz=\"0.3\" izz=\"12\"/>");
  CHECK(link.has_inertial);
  const auto &I = link.inertia;
  CHECK(I.m == 2);
  CHECK(I.h.x == 2);
  CHECK(I.h.y == 4);
  CHECK(I.h.z == 6);
  CHECK(I.Ixx == 10 + 2 * (4 + 9));
  CHECK(I.Iyy == 11 + 2 * (9 + 1));
  CHECK(I.Izz == 12 + 2 * (1 + 4));
  CHECK(I.Ixy == doctest::Approx(0.1 - 2 * 1 * 2).epsilon(1e-15));
  CHECK(I.Iyz == doctest::Approx(0.3 - 2 * 2 * 3).epsilon(1e-15));
  CHECK(I.Izx == doctest::Approx(0.2 - 2 * 3 * 1).epsilon(1e-15));
}

TEST_CASE("the inertia's own axes are turned into the link's") {
  // yaw 90°: the body's x is the link's y, its y the link's -x, so xy changes sign and xz becomes yz
  for (const char *turn :
       {"rpy=\"0 0 1.5707963267948966\"", "quat_xyzw=\"0 0 0.7071067811865476 0.7071067811865476\""}) {
    const auto I = link_with("<origin " + std::string(turn) +
                             "/><mass value=\"1\"/>"
                             "<inertia ixx=\"10\" ixy=\"0.5\" ixz=\"0.25\" iyy=\"11\" iyz=\"0.125\" izz=\"12\"/>")
                       .inertia;
    const auto near = [](double a, double b) { return std::fabs(a - b) <= 1e-14; };
    CHECK(near(I.Ixx, 11));
    CHECK(near(I.Iyy, 10));
    CHECK(near(I.Izz, 12));
    CHECK(near(I.Ixy, -0.5));
    CHECK(near(I.Iyz, 0.25));
    CHECK(near(I.Izx, -0.125));
  }
}

TEST_CASE("what is not used is listed, each kind once and in a fixed order") {
  const auto robot = read(R"(<?xml version="1.0"?>
<!-- a comment --><robot name="r" version="1.2" xmlns:xacro="http://www.ros.org/wiki/xacro" colour="red">
  <material name="m"/>
  <gazebo/><transmission/><gazebo reference="a"/>
  <link name="a" type="t"><visual/><visual/><collision/><foo/></link>
  <link name="b"><visual/><bar/><foo/>stray</link>
  <link name="c"/><link name="d"/>
  <joint name="j" type="revolute"><parent link="a"/><child link="b"/><dynamics damping="1" friction="2" D="3" K="4"/>
    <limit lower="0" upper="1" effort="1" acceleration="5" deceleration="6" jerk="7"/><calibration/></joint>
  <joint name="k" type="prismatic"><parent link="b"/><child link="c"/><dynamics damping="1" friction="2" D="3" K="4"/>
    <safety_controller/><zap/></joint>
  <joint name="f" type="fixed"><parent link="c"/><child link="d"/><axis xyz="0 0 0"/><limit/><mimic joint="j"/>
    <dynamics damping="0.0" friction="0"/></joint>
  <camera/>
</robot>)");
  check_unused(robot, {
                          "visual (2 links)",
                          "collision (1 link)",
                          "joint j: limit acceleration, limit deceleration, limit jerk, calibration (not used)",
                          "joint k: safety_controller (not used)",
                          "joint f: axis, limit, mimic (no effect on a fixed joint)",
                          "material (1)",
                          "gazebo (2)",
                          "transmission (1)",
                          "unknown element <camera> in robot, line 14",
                          "unknown element <foo> in link a, line 5, and 1 more",
                          "unknown element <bar> in link b, line 6",
                          "unknown element <zap> in joint k, line 11",
                          "unknown attribute colour of <robot> in robot, line 2",
                          "unknown attribute type of <link> in link a, line 5",
                          "unknown attribute D, K of <dynamics> in joint j, line 8, and 1 more",
                          "text in <link> in link b, line 6",
                      });
}

TEST_CASE("a mimic joint gets a coordinate of its own when that is asked for") {
  read_options options;
  options.mimic_independent = true;
  const auto robot = read(robot_with("revolute", "<mimic joint=\"k\"/>"), options);
  check_unused(robot, {"joint j: mimic (the coupling is not applied: each has a coordinate of its own)"});
}

TEST_CASE("a mimic joint follows another") {
  const auto robot = read(R"(<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
  <joint name="j" type="revolute"><parent link="a"/><child link="b"/><mimic joint="k" multiplier="-2" offset="0.5"/></joint>
  <joint name="k" type="prismatic"><parent link="b"/><child link="c"/></joint></robot>)");
  REQUIRE(robot.joints[0].mimic);
  CHECK(robot.joints[0].mimic->joint == "k");
  CHECK((robot.joints[0].mimic->multiplier == -2 && robot.joints[0].mimic->offset == 0.5 &&
         robot.joints[0].mimic->at.line == 2));
  CHECK(!robot.joints[1].mimic);
  check_unused(robot, {});
}

TEST_CASE("meshes are not looked for") {
  check_unused(read("<robot><link name=\"a\"><visual><geometry><mesh filename=\"package://none/x.dae\"/></geometry>"
                    "</visual></link></robot>"),
               {"visual (1 link)"});
}

TEST_CASE("limits of joints with several numbers, where they have an effect") {
  const joint_description j = joint_with("cylindrical", "<limit1 lower=\"-1\" upper=\"2\"/><limit2 upper=\"3\"/>");
  CHECK((*j.lower == -1 && *j.upper == 2 && !j.further[0].lower && *j.further[0].upper == 3 && !j.further[1].upper));
  check_unused(read(robot_with("revolute", "<limit1 lower=\"-1\" upper=\"2\"/>")),
               {"joint j: limit1 (no effect on a revolute joint)"});
  check_unused(read(robot_with("continuous", "<limit upper=\"1\"/>")),
               {"joint j: limit upper (no effect on a continuous joint)"});
  CHECK((*joint_with("revolute", "<limit lower=\"1\"/>").lower == 1 &&
         !joint_with("revolute", "<limit lower=\"1\"/>").upper));
}

TEST_CASE("unknown attributes of one place are one line if they are as many; namespaces are no attributes") {
  check_unused(read("<robot><link name=\"a\" D=\"1\" E=\"2\" F=\"3\"/>\n<link name=\"b\" E=\"1\"/>"
                    "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint></robot>"),
               {"unknown attribute D, F of <link> in link a, line 1",
                "unknown attribute E of <link> in link a, line 1, and 1 more"});
  check_unused(read("<robot xmlns=\"x\" xmlns:drake=\"y\"><link name=\"a\"/></robot>"), {});
}

TEST_CASE("meshes without a file, or outside of links") {
  CHECK(read("<robot><link name=\"a\"/><mesh filename=\"x.stl\"/><mesh/></robot>").links.size() == 1);
}

TEST_CASE("line ends of every system count the same") {
  for (const char *end : {"\n", "\r\n", "\r"}) {
    const std::string e = end;
    const auto robot = read("<robot>" + e + e + "<link name=\"a\"/>" + e + "<link" + e + "name=\"b\"/>" + e +
                            "<joint name=\"j\" type=\"fixed\">" + e + "<parent link=\"a\"/><child link=\"b\"/>" +
                            "<origin xyz=\"1" + e + "2 3\"/></joint></robot>");
    CHECK(robot.links[0].at.line == 3);
    CHECK(robot.links[1].at.line == 4);
    CHECK(robot.joints[0].at.line == 6);
    CHECK(robot.joints[0].placement.t.y == 2);
  }
}

TEST_CASE("encodings") {
  const std::string text = "<robot name=\"r\">\n<link name=\"caf\xc3\xa9\"/>\n</robot>";
  const auto check = [](const std::string &bytes, std::size_t warnings) {
    const auto robot = read(bytes);
    REQUIRE(robot.links.size() == 1);
    CHECK(robot.links[0].name == "caf\xc3\xa9");
    CHECK(robot.links[0].at.line == 2);
    CHECK(robot.warnings.size() == warnings);
  };
  check(text, 0);
  check("\xef\xbb\xbf" + text, 0);
  check("<?xml version=\"1.0\" encoding=\"UTF-8\"?>" + text, 0);

  const std::string latin1 = "<robot name=\"r\">\n<link name=\"caf\xe9\"/>\n</robot>";
  check(latin1, 1);
  CHECK(read(latin1).warnings[0].find("first in line 2: read as Latin-1") != std::string::npos);

  std::string little, big;
  for (const char c : latin1)
    little += c, little += '\0', big += '\0', big += c;
  check("\xff\xfe" + little, 0);
  check("\xfe\xff" + big, 0);
  check(little, 0);
  check(big, 0);
}

TEST_CASE("a comma locale changes nothing") {
  struct comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
  };
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new comma));
  CHECK(joint_with("fixed", "<origin xyz=\"0.5 1e-1 2.25\"/>").placement.t.z == 2.25);
  std::locale::global(before);
}

TEST_CASE("inertias that no body can have are warnings, or errors when strict") {
  const std::string text =
      "<robot>\n<link name=\"a\"><inertial><mass value=\"1\"/>"
      "<inertia ixx=\"3\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link></robot>";
  const auto robot = read(text);
  REQUIRE(robot.warnings.size() == 1);
  CHECK(robot.warnings[0] ==
        "link a (line 2): principal moments 3, 1, 1: the largest exceeds the sum of the other two by 1");
  read_options strict;
  strict.strict = true;
  test::check_message(test::refusal(text, strict), {"r.urdf: link a (line 2): principal moments 3, 1, 1", "correct"});
}

TEST_CASE("visual and collision elements are geometry") {
  const auto robot =
      read("<robot><link name=\"a\"><visual/></link><link name=\"b\"/><link name=\"c\"><collision/></link>"
           "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>"
           "<joint name=\"k\" type=\"fixed\"><parent link=\"a\"/><child link=\"c\"/></joint></robot>");
  CHECK((robot.links[0].has_geometry && !robot.links[1].has_geometry && robot.links[2].has_geometry));
}

TEST_CASE("a file is read as its text is") {
  const std::string path = "load_test_robot.urdf";
  std::FILE *file = std::fopen(path.c_str(), "wb");
  REQUIRE(file);
  std::fputs("<robot name=\"r\"><link name=\"a\"/></robot>", file);
  std::fclose(file);
  const auto robot = read_urdf(path);
  std::remove(path.c_str());
  CHECK(robot.file == path);
  CHECK(robot.links.size() == 1);
}
