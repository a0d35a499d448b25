// Each way in which a file can be wrong, and what the message must say: file, line, name, fault and mend.
#include "refusal.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

using namespace ksl;
using ksl::test::check_message;
using ksl::test::refusal;

namespace {

void check_all(const std::vector<test::wrong_text> &cases) {
  test::check_all(cases, [](const std::string &text) { return refusal(text); });
}

/// A robot whose joint j, in line 4, is of the type given and holds `inside`, in line 6.
std::string joint(const std::string &inside, const std::string &type = "revolute", const std::string &version = "1.2") {
  return "<robot name=\"r\" version=\"" + version +
         "\">\n<link name=\"base_link\"/>\n<link name=\"tool\"/>\n<joint name=\"j\" type=\"" + type +
         "\">\n<parent link=\"base_link\"/><child link=\"tool\"/>\n" + inside + "\n</joint>\n</robot>\n";
}

/// A robot whose link a holds `inside`, in line 3.
std::string link(const std::string &inside) {
  return "<robot name=\"r\">\n<link name=\"a\">\n" + inside + "\n</link>\n</robot>\n";
}

std::string inertial(const std::string &mass, const std::string &inertia) {
  return link("<inertial>" + mass + inertia + "</inertial>");
}

const std::string unit = "<inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/>";
const std::string links = "<robot>\n<link name=\"a\"/>\n<link name=\"b\"/>\n<link name=\"c\"/>\n";

std::string ends(const std::string &name, const std::string &parent, const std::string &child) {
  return "<joint name=\"" + name + "\" type=\"fixed\"><parent link=\"" + parent + "\"/><child link=\"" + child +
         "\"/></joint>\n";
}

} // namespace

TEST_CASE("no file") {
  const auto file_refusal = [](const std::string &path) { return test::refusal_of([&] { read_urdf(path); }); };
  check_message(file_refusal("no/such/robot.urdf"), {"no/such/robot.urdf: there is no such file", "check the path"});
  check_message(file_refusal("."), {".: this is a folder", "give the path of a URDF file"});
  check_message(file_refusal(""), {"the path of the file is empty"});
  const std::string path = "load_test_empty.urdf";
  std::fclose(std::fopen(path.c_str(), "wb"));
  const std::string message = file_refusal(path);
  std::remove(path.c_str());
  check_message(message, {"load_test_empty.urdf: the file is empty", "expected a <robot>"});
}

TEST_CASE("no XML") {
  check_all({
      {"nothing", "", {"r.urdf: the file is empty", "<robot>"}},
      {"blanks", "  \n ", {"r.urdf: the file holds no XML element", "<robot>", "give a URDF file"}},
      {"words", "hello", {"r.urdf: the file holds no XML element"}},
      {"mismatch", "<robot>\n<link name=\"a\">\n</robot>", {"r.urdf:3: broken XML", "mismatch", "close the tag"}},
      {"truncated", "<robot>\n<link name=\"a\"", {"r.urdf:2: broken XML"}},
      {"unclosed", "<robot>\n<link name=\"a\"/>\n", {"r.urdf:", "broken XML", "close the tag"}},
      {"bad attribute", "<robot>\n<link name=a/></robot>", {"r.urdf:2: broken XML", "attribute", "correct it"}},
      {"bad comment", "<robot>\n<!-- x </robot>", {"r.urdf:2: broken XML", "comment"}},
      {"second root", "<robot><link name=\"a\"/></robot>\n<robot/>", {"r.urdf:2: broken XML", "second root", "remove"}},
      {"text behind",
       "<robot><link name=\"a\"/></robot>\n\n <!-- x -->\n junk",
       {"r.urdf:4: broken XML, text outside of <robot>", "remove"}},
      {"text before",
       "<!-- x -->\njunk\n<robot><link name=\"a\"/></robot>",
       {"r.urdf:2: broken XML, text outside of <robot>"}},
      {"a character behind",
       "<robot><link name=\"a\"/></robot>\n&#65;",
       {"r.urdf:2: broken XML, text outside of <robot>"}},
      {"CDATA behind",
       "<robot><link name=\"a\"/></robot>\n<![CDATA[ ]]>",
       {"r.urdf:2: broken XML, text outside of <robot>"}},
      {"words and comments", "hello <!-- x -->", {"r.urdf: the file holds no XML element"}},
      {"zero byte",
       std::string("<robot>\n<link name=\"a\"/></robot>\0<x>", 37),
       {"r.urdf:2: a zero byte", "save it as UTF-8"}},
  });
  check_message(refusal("<robot>\n<link name=\"a\" name=\"b\"/></robot>"),
                {"r.urdf:2: link a: broken XML", "gives name twice", "keep one"});
}

TEST_CASE("no URDF") {
  check_all({
      {"root", "<html/>", {"r.urdf:1:", "<html>, expected <robot>", "give a URDF or SDF file"}},
      {"MJCF", "\n<mujoco/>", {"r.urdf:2:", "<mujoco>, expected <robot>", "MJCF"}},
      {"SDF", "<sdf/>", {"r.urdf:1:", "<sdf>", "convert"}},
      {"Simscape", "<SimscapeMultibodyImportXML/>", {"r.urdf:1:", "an assembly for Simscape Multibody", "export URDF"}},
      {"xacro's root", "<xacro:robot xmlns:xacro=\"x\"/>", {"r.urdf:1:", "<xacro:robot>", "run xacro first"}},
      {"joint in capitals",
       "<robot>\n<link name=\"a\"/>\n<JOINT name=\"j\"/></robot>",
       {"r.urdf:3: <JOINT> is a joint that KSL doesn't know"}},
      {"joint with a capital",
       "<robot>\n<link name=\"a\"/>\n<Joint name=\"j\"/></robot>",
       {"r.urdf:3: <Joint> is a joint that KSL doesn't know"}},
      {"another word of five letters", "<robot>\n<link name=\"a\"/>\n<other/></robot>", {"accepted"}},
      {"quaternion of three numbers",
       joint("<origin quat_xyzw=\"0 0 1\"/>"),
       {"needs 4 numbers, found 3", "quat_xyzw=\"0 0 0 1\""}},
      {"xacro",
       "<robot xmlns:xacro=\"x\">\n<link name=\"a\"/>\n<gazebo><xacro:macro/></gazebo></robot>",
       {"r.urdf:3: <xacro:macro> is not expanded", "run xacro first"}},
      {"xacro's namespace alone", "<robot xmlns:xacro=\"x\"><link name=\"a\"/></robot>", {"accepted"}},
      {"version",
       "\n<robot version=\"2.0\"/>",
       {"r.urdf:2: robot: URDF version \"2.0\" is unknown", "1.0, 1.1 or 1.2", "write version"}},
      {"version 1.1", "<robot version=\"1.1\"><link name=\"a\"/></robot>", {"accepted"}},
      {"no links", "<robot name=\"r\"/>", {"r.urdf:1:", "no <link>", "at least one"}},
  });
}

TEST_CASE("names and types of joints") {
  check_all({
      {"type",
       joint("", "revolut"),
       {"r.urdf:4: joint j: joint type \"revolut\" is unknown",
        "fixed, revolute, continuous, prismatic, helical, cylindrical", "did you mean \"revolute\"?"}},
      {"far type", joint("", "gearbox"), {"r.urdf:4: joint j:", "\"gearbox\" is unknown", "write one of these"}},
      {"no type", joint("", ""), {"r.urdf:4: joint j: <joint> has no type", "write type"}},
      {"helical without pitch",
       joint("", "helical"),
       {"r.urdf:4: joint j: a helical joint needs its pitch", "<screw_thread_pitch value=\"0.005\"/>"}},
      {"pitch without value",
       joint("<screw_thread_pitch/>", "screw"),
       {"r.urdf:", "<screw_thread_pitch> has no value", "metres for each revolution"}},
      {"universal with one axis",
       joint("<axis xyz=\"0 0 1\"/>", "universal"),
       {"r.urdf:4: joint j: a universal joint needs its second axis", "<axis2 xyz=\"0 1 0\"/>"}},
      {"second axis zero",
       joint("<axis2 xyz=\"0 0 0\"/>", "universal"),
       {"r.urdf:6: joint j: the axis is zero", "<axis2 xyz="}},
      {"second axis parallel",
       joint("<axis2 xyz=\"-2 0 0\"/>", "universal"),
       {"r.urdf:4: joint j: a universal joint needs two axes that are not parallel", "revolute"}},
      {"Drake's type",
       "<robot>\n<link name=\"a\"/><link name=\"b\"/>\n<drake:joint name=\"j\" type=\"revolute\"/></robot>",
       {"r.urdf:3: joint j: <drake:joint> type \"revolute\" is unknown", "ball, universal, planar, screw"}},
      {"Drake's screw without pitch",
       "<robot>\n<link name=\"a\"/><link name=\"b\"/>\n<drake:joint name=\"j\" type=\"screw\"><parent link=\"a\"/><child link=\"b\"/></drake:joint></robot>",
       {"r.urdf:3: joint j: a helical joint needs its pitch", "<drake:screw_thread_pitch value=\"0.005\"/>"}},
      {"another's joint",
       "<robot>\n<link name=\"a\"/><link name=\"b\"/>\n<other:joint name=\"j\" type=\"ball\"/></robot>",
       {"r.urdf:3: <other:joint> is a joint that KSL doesn't know", "<drake:joint>"}},
      {"joint without name",
       links + "<joint type=\"fixed\"/></robot>",
       {"r.urdf:5: joint: <joint> has no name", "write <joint name"}},
      {"joint with empty name",
       links + "<joint name=\"\" type=\"fixed\"/></robot>",
       {"r.urdf:5: joint: <joint> has no name"}},
      {"link without name", "<robot>\n<link/></robot>", {"r.urdf:2: link: <link> has no name", "write <link name"}},
      {"joint twice",
       links + ends("j", "a", "b") + ends("j", "b", "c") + "</robot>",
       {"r.urdf:6: a second joint is named \"j\"", "first is in line 5", "rename"}},
      {"link twice",
       "<robot>\n<link name=\"a\"/>\n<link name=\"a\"/></robot>",
       {"r.urdf:3: a second link is named \"a\"", "first is in line 2", "rename"}},
  });
}

TEST_CASE("ends of joints") {
  check_all({
      {"no parent",
       links + "<joint name=\"j\" type=\"fixed\"><child link=\"a\"/></joint></robot>",
       {"r.urdf:5: joint j: no <parent> in <joint>", "add <parent link="}},
      {"no child",
       links + "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/></joint></robot>",
       {"r.urdf:5: joint j: no <child> in <joint>", "add <child link="}},
      {"nameless parent",
       links + "<joint name=\"j\" type=\"fixed\">\n<parent/><child link=\"a\"/></joint></robot>",
       {"r.urdf:6: joint j: <parent> names no link", "write <parent link="}},
      {"two parents of a joint",
       joint("<parent link=\"tool\"/>"),
       {"r.urdf:6: joint j: a second <parent>", "the first is in line 5", "keep one"}},
      {"near link",
       "<robot>\n<link name=\"base_link\"/>\n<link name=\"tool\"/>\n" + ends("j", "base_lnk", "tool") + "</robot>",
       {"r.urdf:4: joint j: parent link \"base_lnk\" does not exist", "did you mean \"base_link\"?"}},
      {"far link",
       links + ends("j", "a", "elephant") + "</robot>",
       {"r.urdf:5: joint j: child link \"elephant\" does not exist", "add that link, or name one of a, b, c"}},
      {"own parent",
       links + ends("j", "a", "a") + "</robot>",
       {"r.urdf:5: joint j: link a is both its parent and its child", "name two links"}},
      {"two roots",
       links + ends("j", "a", "b") + "</robot>",
       {"r.urdf:4: links a (line 2), c (line 4) have no parent", "join them"}},
      {"cycle",
       links + ends("j", "b", "c") + ends("k", "c", "b") + "</robot>",
       {"r.urdf:6: links c, b form a cycle", "remove one of the joints"}},
  });
}

TEST_CASE("numbers") {
  check_all({
      {"too few",
       joint("<origin xyz=\"0 1\"/>"),
       {"r.urdf:6: joint j: <origin> xyz needs 3 numbers, found 2", "write xyz="}},
      {"too many", joint("<origin rpy=\"0 1 2 3\"/>"), {"r.urdf:6: joint j: <origin> rpy needs 3 numbers, found 4"}},
      {"none", joint("<axis xyz=\"\"/>"), {"r.urdf:6: joint j: <axis> xyz needs 3 numbers, found 0"}},
      {"comma",
       joint("<origin xyz=\"0,5 0 0\"/>"),
       {"r.urdf:6: joint j: <origin> xyz holds \"0,5\", not a finite number", "write a point"}},
      {"commas between", joint("<origin xyz=\"0, 0, 0\"/>"), {"holds \"0,\"", "blanks between"}},
      {"not a number",
       joint("<origin xyz=\"0 nan 0\"/>"),
       {"r.urdf:6: joint j:", "\"nan\", not a finite number", "write a finite"}},
      {"a no-break space",
       joint("<origin xyz=\"0\u00a01 0 0\"/>"),
       {"not a finite number; it holds a character that only looks"}},
      {"units", joint("<limit effort=\"5\u00b5N\"/>"), {"write a finite"}},
      {"infinite", joint("<limit lower=\"-inf\"/>"), {"r.urdf:6: joint j: <limit> lower holds \"-inf\""}},
      {"rubbish after", joint("<limit effort=\"1.5Nm\"/>"), {"r.urdf:6: joint j: <limit> effort holds \"1.5Nm\""}},
      {"xacro", joint("<limit effort=\"${max}\"/>"), {"r.urdf:6: joint j:", "${max}", "run xacro"}},
      {"two", joint("<dynamics damping=\"1 2\"/>"), {"r.urdf:6: joint j: <dynamics> damping needs 1 number, found 2"}},
      {"zero axis", joint("<axis xyz=\"0 0 0\"/>"), {"r.urdf:6: joint j: the axis is zero", "give the direction"}},
      {"no axis", joint("<axis/>"), {"r.urdf:6: joint j: <axis> has no xyz", "write <axis xyz"}},
      {"limits",
       joint("<limit lower=\"2\" upper=\"-1.5\"/>"),
       {"r.urdf:6: joint j: lower limit 2 is above upper limit -1.5", "exchange or correct"}},
      {"equal limits", joint("<limit lower=\"0\" upper=\"0\"/>"), {"accepted"}},
      {"quaternion and angles",
       joint("<origin rpy=\"0 0 0\" quat_xyzw=\"0 0 0 1\"/>"),
       {"r.urdf:6: joint j: <origin> gives both rpy and quat_xyzw", "keep one"}},
      {"quaternion's length",
       joint("<origin quat_xyzw=\"0 0 0 1.01\"/>"),
       {"r.urdf:6: joint j: quat_xyzw has length 1.01, expected 1", "divide"}},
      {"quaternion of zeros", joint("<origin quat_xyzw=\"0 0 0 0\"/>"), {"r.urdf:6: joint j: quat_xyzw has length 0"}},
      {"quaternion in 1.0",
       joint("<origin quat_xyzw=\"0 0 0 1\"/>", "fixed", "1.0"),
       {"r.urdf:6: joint j: quat_xyzw came with URDF 1.1", "write version=\"1.1\""}},
  });
}

TEST_CASE("masses and inertias") {
  check_all({
      {"no mass", inertial("", unit), {"r.urdf:3: link a: <inertial> has no <mass>", "add <mass"}},
      {"no inertia",
       inertial("<mass value=\"1\"/>", ""),
       {"r.urdf:3: link a: <inertial> has no <inertia>", "add <inertia"}},
      {"no value", inertial("<mass/>", unit), {"r.urdf:3: link a: <mass> has no value", "write <mass value"}},
      {"no iyz",
       inertial("<mass value=\"1\"/>", "<inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" izz=\"1\"/>"),
       {"r.urdf:3: link a: <inertia> has no iyz", "give all of ixx"}},
      {"negative",
       inertial("<mass value=\"-1\"/>", unit),
       {"r.urdf:2: link a: its mass is -1, negative", "zero or more"}},
      {"bad mass", inertial("<mass value=\"heavy\"/>", unit), {"r.urdf:3: link a: <mass> value holds \"heavy\""}},
      {"bad origin",
       inertial("<origin xyz=\"1\"/><mass value=\"1\"/>", unit),
       {"r.urdf:3: link a: <origin> xyz needs 3"}},
      {"overflow",
       inertial("<origin xyz=\"1e200 0 0\"/><mass value=\"1\"/>", unit),
       {"r.urdf:2: link a:", "not finite"}},
      {"two", link("<inertial/>\n<inertial/>"), {"r.urdf:4: link a: a second <inertial>", "line 3", "keep one"}},
  });
}

TEST_CASE("mimic joints that can't be coupled are refused, with the way out") {
  check_message(refusal(joint("<mimic joint=\"k\" multiplier=\"2\"/>")),
                {"r.urdf:6: joint j: it mimics joint \"k\", which does not exist", "--mimic independent",
                 "mimic=\"independent\"", "coordinate of its own"});
  check_message(refusal(joint("<mimic joint=\"j\"/>")), {"r.urdf:6: joint j: it mimics joint \"j\"", "back to itself"});
  check_message(refusal(joint("<mimic joint=\"k\" multiplier=\"two\"/>")),
                {"r.urdf:6: joint j: <mimic> multiplier holds \"two\""});
  check_message(refusal(joint("<mimic multiplier=\"2\"/>")), {"r.urdf:6: joint j: <mimic> names no joint"});
}

TEST_CASE("strict refuses the first inertias that no body can have") {
  std::string text = "<robot><link name=\"l\"/>\n";
  for (int i = 0; i < 5; ++i) {
    const std::string name = "l" + std::to_string(i);
    text += "<link name=\"" + name + "\"><inertial><mass value=\"0\"/>" + unit + "</inertial></link>" +
            ends("j" + std::to_string(i), "l", name);
  }
  read_options strict;
  strict.strict = true;
  const std::string message = refusal(text + "</robot>", strict);
  check_message(message,
                {"r.urdf: link l0 (line 2): mass 0", "link l2 (line 4)", "2 more such links", "without strict"});
  CHECK(message.find("l3") == std::string::npos);
}

TEST_CASE("limits of joints with several numbers, and rotors of transmissions") {
  check_message(refusal(joint("<limit1 lower=\"1\" upper=\"-1\"/>", "cylindrical")),
                {"r.urdf:6: joint j: lower limit 1 is above upper limit -1"});
  check_message(refusal(joint("<limit2 lower=\"1\" upper=\"-1\"/>", "cylindrical")),
                {"r.urdf:6: joint j: lower limit 1 is above upper limit -1"});
  const auto driven = [](const std::string &type, const std::string &dynamics, const std::string &actuators) {
    return "<robot>\n<link name=\"a\"/>\n<link name=\"b\"/>\n<joint name=\"j\" type=\"" + type +
           "\"><parent link=\"a\"/><child link=\"b\"/>" + dynamics + "</joint>\n<transmission name=\"t\">" + actuators +
           "</transmission></robot>";
  };
  const std::string
      rotor = "<actuator name=\"m\"><drake:rotor_inertia value=\"0.02\"/><drake:gear_ratio value=\"30\"/></actuator>",
      of_j = "<joint name=\"j\"/>";
  check_message(refusal(driven("revolute", "", of_j + rotor + rotor)),
                {"r.urdf:5:", "two actuators have rotors for joint \"j\"", "keep one"});
  check_message(refusal(driven("revolute", "", rotor)),
                {"r.urdf:5:", "its joint \"\" does not exist", "name the joint"});
  check_message(refusal(driven("revolute", "", "<joint name=\"k\"/>" + rotor)), {"its joint \"k\" does not exist"});
  const auto read = [&](const std::string &text) { return read_urdf_text(text, "r.urdf"); };
  const auto says = [](const robot_description &robot, const std::string &words) {
    for (const std::string &line : robot.unused)
      if (line.find(words) != line.npos)
        return true;
    return false;
  };
  const robot_description whole = read(driven("revolute", "", of_j + rotor));
  CHECK((whole.joints[0].rotor_inertia == 0.02 && whole.joints[0].gear_ratio == 30));
  const robot_description ratio =
      read(driven("revolute", "", of_j + "<actuator><drake:gear_ratio value=\"30\"/></actuator><actuator/>"));
  CHECK((ratio.joints[0].rotor_inertia == 0 && ratio.joints[0].gear_ratio == 30));
  const robot_description inertia =
      read(driven("revolute", "", of_j + "<actuator><drake:rotor_inertia value=\"0.02\"/></actuator>"));
  CHECK((inertia.joints[0].rotor_inertia == 0.02 && inertia.joints[0].gear_ratio == 1));
  for (const char *type : {"fixed", "floating"})
    CHECK(says(read(driven(type, "", of_j + rotor)), "no effect on a " + std::string(type) + " joint"));
  for (const char *other :
       {"rotor_inertia=\"0.01\" gear_ratio=\"30\"", "rotor_inertia=\"0.02\" gear_ratio=\"20\"", "gear_ratio=\"20\""}) {
    const robot_description kept = read(driven("revolute", "<dynamics " + std::string(other) + "/>", of_j + rotor));
    CHECK(says(kept, "differs from <dynamics>, which is used"));
    CHECK(!(kept.joints[0].rotor_inertia == 0.02 && kept.joints[0].gear_ratio == 30));
  }
  CHECK(
      !says(read(driven("revolute", "<dynamics rotor_inertia=\"0.02\" gear_ratio=\"30\"/>", of_j + rotor)), "differs"));
}

// What a default, a macro or a template gives every joint.
TEST_CASE("what a joint can't use is listed, and the file is read") {
  const auto read = [](const std::string &type, const std::string &dynamics) {
    return read_urdf_text("<robot><link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"" + type +
                              "\"><parent link=\"a\"/><child link=\"b\"/><dynamics " + dynamics + "/></joint></robot>",
                          "r.urdf");
  };
  const struct {
    const char *name;
    double joint_description::*member;
    std::vector<std::string> of;
  } cases[] = {
      {"armature", &joint_description::armature, {"fixed", "floating"}},
      {"rotor_inertia", &joint_description::rotor_inertia, {"fixed", "floating"}},
      {"spring_stiffness",
       &joint_description::spring_stiffness,
       {"fixed", "floating", "planar", "spherical", "cylindrical", "translation"}},
  };
  for (const auto &[name, member, kinds] : cases)
    for (const std::string &kind : kinds) {
      const robot_description robot = read(kind, std::string(name) + "=\"0.5\"");
      CHECK(robot.joints[0].*member == 0);
      CHECK(std::count(robot.unused.begin(), robot.unused.end(),
                       "joint j: " + std::string(name) + " (no effect on a " + kind + " joint)") == 1);
    }
  CHECK(read("revolute", "armature=\"0.5\" spring_stiffness=\"2\"").joints[0].armature == 0.5);
}

TEST_CASE("rotors and gears of transmissions, as ROS has them") {
  const auto read = [](const std::string &transmission, const std::string &dynamics = "",
                       const std::string &type = "continuous") {
    return read_urdf_text("<robot><link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"" + type +
                              "\"><parent link=\"a\"/><child link=\"b\"/>" + dynamics +
                              "</joint><transmission name=\"t\">" + transmission + "</transmission></robot>",
                          "r.urdf");
  };
  const auto says = [](const robot_description &robot, const std::string &words) {
    return std::any_of(robot.unused.begin(), robot.unused.end(),
                       [&](const std::string &line) { return line.find(words) != line.npos; });
  };
  const std::string of_j = "<joint name=\"j\"/>", gear = "<mechanicalReduction>-50</mechanicalReduction>",
                    rotor = "<motorInertia> 2e-4 </motorInertia>";
  for (const std::string &text :
       {of_j + "<actuator name=\"m\">" + gear + rotor + "</actuator>",
        "<joint name=\"j\">" + gear + "</joint><actuator name=\"m\">" + gear + rotor + "</actuator>",
        of_j + "<actuator name=\"m\"/>" + gear + rotor}) {
    const robot_description robot = read(text);
    CHECK((robot.joints[0].rotor_inertia == 2e-4 && robot.joints[0].gear_ratio == -50));
  }
  const robot_description ratio = read(of_j + "<actuator>" + gear + "</actuator>");
  CHECK((ratio.joints[0].rotor_inertia == 0 && ratio.joints[0].gear_ratio == -50));
  CHECK(says(ratio, "joint j: mechanicalReduction (read as gear_ratio, no effect without a rotor's inertia)"));
  CHECK(!says(read(of_j + "<actuator><mechanicalReduction>1</mechanicalReduction></actuator>"), "mechanicalReduction"));
  CHECK(says(read(of_j + "<actuator>" + gear + rotor + "</actuator>", "<dynamics gear_ratio=\"20\"/>"),
             "differs from <dynamics>"));
  CHECK(says(read(of_j + "<actuator>" + rotor + "</actuator>", "<dynamics armature=\"2\"/>"),
             "<dynamics> has an armature"));
  CHECK(says(read(of_j + "<actuator>" + rotor + "</actuator>", "", "fixed"), "no effect on a fixed joint"));
  for (const std::string &text :
       {of_j + "<actuator>" + rotor + "</actuator><actuator/>", of_j + of_j + rotor, "<joint name=\"k\"/>" + rotor,
        rotor, of_j + "<motorInertia>-1</motorInertia>", of_j + "<motorInertia>many</motorInertia>"}) {
    const robot_description robot = read(text);
    CHECK(robot.joints[0].rotor_inertia == 0);
    CHECK(says(robot, "motorInertia of <transmission>"));
  }
}

TEST_CASE("joints that can't mimic, or be mimicked, and factors whose products overflow") {
  const auto chain = [](const char *first, const char *of_second, const std::string &of_third) {
    return "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><link name=\"c\"/><link name=\"d\"/>\n<joint "
           "name=\"i\" type=\"" +
           std::string(first) +
           "\"><parent link=\"a\"/><child link=\"b\"/></joint>\n<joint name=\"j\" type=\"continuous\"><parent "
           "link=\"b\"/>" +
           "<child link=\"c\"/><mimic joint=\"i\" multiplier=\"" + of_second +
           "\"/></joint>\n<joint name=\"k\" type=\"continuous\">" +
           "<parent link=\"c\"/><child link=\"d\"/><mimic joint=\"j\" " + of_third + "/></joint></robot>";
  };
  check_message(refusal(chain("spherical", "1", "")),
                {"r.urdf:3:", "joint j", "is a spherical joint, with 3 coordinates", "have one each"});
  check_message(refusal(chain("fixed", "1", "")), {"r.urdf:3:", "joint j", "is fixed", "name a moving joint"});
  check_message(refusal(chain("continuous", "1e200", "multiplier=\"1e200\"")),
                {"r.urdf:4:", "joint k", "its multiplier or offset is not finite"});
  const robot_description followed =
      read_urdf_text(chain("continuous", "1e100", "multiplier=\"1e100\" offset=\"3\""), "r.urdf");
  CHECK((followed.joints[2].mimic->joint == "j" && followed.joints[2].mimic->offset == 3));
}
