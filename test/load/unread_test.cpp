// Elements that no reader knows: those that name two links or two joints are refused, in each format, but for those that join none; and
// couplings that are stated elsewhere than in <joint> are read.
#include "refusal.hpp"

#include "load/robot_file.hpp"

#include <algorithm>

using namespace ksl;
using ksl::test::check_message;

namespace {

/// Links base, a and b on joints ja and jb, which holds `in_jb`; and what is given, from line 3 on.  In both formats.
std::string urdf(const std::string &inside, const std::string &in_jb = "") {
  const auto arm = [](const std::string &link, const std::string &more) {
    return "<link name=\"" + link + "\"/><joint name=\"j" + link +
           "\" type=\"continuous\"><parent link=\"base\"/><child link=\"" + link + "\"/><axis xyz=\"0 0 1\"/>" + more +
           "</joint>";
  };
  return "<robot name=\"r\"><link name=\"base\"/>\n" + arm("a", "") + arm("b", in_jb) + "\n" + inside + "</robot>";
}
std::string sdf(const std::string &inside, const std::string &in_jb = "") {
  const auto arm = [](const std::string &link, const std::string &more) {
    return "<link name=\"" + link + "\"/><joint name=\"j" + link +
           "\" type=\"continuous\"><parent>world</parent><child>" + link + "</child><axis><xyz>0 0 1</xyz></axis>" +
           more + "</joint>";
  };
  return "<sdf version=\"1.10\"><model name=\"m\">\n" + arm("a", "") + arm("b", in_jb) + "\n" + inside +
         "</model></sdf>";
}

robot_description read(const std::string &text, const read_options &options = {}) {
  return read_robot_text(text, "r.xml", options);
}
std::string refusal(const std::string &text) {
  return test::refusal_of([&] { read(text); });
}

const mimic_description *mimic_of(const robot_description &robot, const std::string &joint) {
  const auto found =
      std::find_if(robot.joints.begin(), robot.joints.end(), [&](const auto &j) { return j.name == joint; });
  REQUIRE(found != robot.joints.end());
  return found->mimic ? &*found->mimic : nullptr;
}

std::string control(const std::string &in_joint, const std::string &joint = "jb") {
  return "<ros2_control name=\"c\" type=\"system\"><joint name=\"" + joint + "\">" + in_joint +
         "</joint></ros2_control>";
}
std::string param(const std::string &name, const std::string &value) {
  return "<param name=\"" + name + "\">" + value + "</param>";
}
std::string plugin(const std::string &file, const std::string &inside) {
  return "<plugin name=\"p\" filename=\"" + file + "\">" + inside + "</plugin>";
}
const std::string mimic_plugin = plugin("libgazebo_mimic_joint_plugin.so",
                                        "<joint>ja</joint><mimicJoint>jb</mimicJoint><multiplier>-2</multiplier>");

} // namespace

TEST_CASE("unread: what names two links or two joints is refused") {
  const char *two_links[] = {
      "<rope from=\"a\" to=\"b\"/>", "<x:rope><end>a</end><end><at>m::b</at></end></x:rope>", "<rope links=\"a, b\"/>",
      "<drake:linear_bushing_rpy><drake:bushing_frameA name=\"a\">a</drake:bushing_frameA><drake:bushing_frameC name=\"b\">b</drake:bushing_frameC></drake:linear_bushing_rpy>"};
  for (const char *each : two_links)
    for (const std::string &text : {urdf(each), sdf(each)}) {
      CAPTURE(text);
      check_message(refusal(text), {"r.xml:3: <", "names links a, b", "another machine", "--loops cut"});
      read_options cut;
      cut.cut_loops = true;
      CHECK(!read(text, cut).unused.empty());
    }
  for (const char *each : {"<gear joint1=\"ja\" joint2=\"jb\"/>", "<gear><of>ja</of><of>jb</of></gear>"})
    for (const std::string &text : {urdf(each), sdf(each)}) {
      check_message(refusal(text), {"r.xml:3: <gear> names joints ja, jb", "<mimic>", "--mimic independent"});
      read_options independent;
      independent.mimic_independent = true;
      CHECK(!read(text, independent).unused.empty());
    }
  // inside a joint or a link the other one suffices
  for (const std::string &text : {urdf("", "<follows>ja</follows>"), sdf("", "<follows joint=\"ja\"/>")})
    check_message(refusal(text), {"r.xml:2: <follows> names joints ja, jb"});
  check_message(
      refusal(urdf(
          "<link name=\"d\"><tied to=\"b\"/></link><joint name=\"jd\" type=\"fixed\"><parent link=\"a\"/><child link=\"d\"/></joint>")),
      {"<tied> names links b, d"});
  check_message(
      refusal(
          "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"fixed\" mimic=\"k\"><parent link=\"a\"/><child link=\"b\"/></joint>\n"
          "<link name=\"c\"/><joint name=\"k\" type=\"continuous\"><parent link=\"b\"/><child link=\"c\"/></joint></robot>"),
      {"mimic of <joint> names joints j, k"});
  check_message(refusal(urdf("<gazebo reference=\"a\"><strut to=\"b\"/></gazebo>")), {"<strut> names links a, b"});
  check_message(
      refusal(urdf("<frame name=\"f\" link=\"a\"/><frame name=\"g\" link=\"b\"/><rope from=\"f\" to=\"g\"/>")),
      {"<rope> names links a, b"});
  check_message(refusal(urdf("<gazebo>" + plugin("libweld.so", "<link1>a</link1><link2>b</link2>") + "</gazebo>")),
                {"plugin \"p\" names links a, b"});
  check_message(refusal(urdf(control(param("gear", "ja")))), {"<param> names joints ja, jb"});
}

TEST_CASE("unread: a word that couples counts before one that joins none") {
  for (const char *each : {"<gripper_mimic one=\"ja\" two=\"jb\"/>", "<actuator_coupling of=\"ja jb\"/>"})
    for (const std::string &text : {urdf(each), sdf(each)})
      check_message(refusal(text), {" names joints ja, jb"});
}

TEST_CASE("unread: what names two and joins none is listed") {
  const char *harmless[] = {
      "<disable_collisions link1=\"a\" link2=\"b\" reason=\"Adjacent\"/>",
      "<drake:collision_filter_group name=\"g\"><drake:member link=\"a\">a</drake:member><drake:member link=\"b\">b</drake:member></drake:collision_filter_group>",
      "<group name=\"arm\"><joint name=\"ja\"/><joint name=\"jb\"/></group>",
      "<force_sensor between=\"a b\"/>",
      "<note>a and b are arms</note>",
      "<size of=\"1 2\"/>",
      "<mount link=\"a\"/>",
      "<place frame=\"a\" again=\"a\" joint=\"jb\"/>"};
  for (const char *each : harmless)
    for (const std::string &text : {urdf(each), sdf(each)}) {
      CAPTURE(text);
      CHECK(!read(text).unused.empty());
    }
  const auto robot =
      read(urdf("<gazebo>" + plugin("libdiff_drive.so", "<left_joint>ja</left_joint><right_joint>jb</right_joint>") +
                "</gazebo>" + "<gazebo reference=\"a\"><bumper><with>b</with></bumper></gazebo>"));
  CHECK(
      !read(
           urdf(
               "<gazebo><controller:p3d name=\"c\" plugin=\"libp3d.so\"><bodyName>a</bodyName><frameName>b</frameName></controller:p3d></gazebo>"))
           .unused.empty());
  CHECK(std::find(robot.unused.begin(), robot.unused.end(), "plugin p of the simulator, which names ja, jb (1)") !=
        robot.unused.end());
}

TEST_CASE("unread: mimics that are stated elsewhere") {
  const std::string drake = "<drake:mimic joint=\"ja\" multiplier=\"-2\" offset=\"0.5\"/>";
  for (const std::string &text :
       {urdf("", drake), sdf("", drake),
        urdf(control(param("mimic", "ja") + param("multiplier", "-2") + param("offset", "0.5")))}) {
    const auto robot = read(text);
    const mimic_description *mimic = mimic_of(robot, "jb");
    REQUIRE(mimic);
    CHECK((mimic->joint == "ja" && mimic->multiplier == -2 && mimic->offset == 0.5 && !mimic_of(robot, "ja")));
    read_options independent;
    independent.mimic_independent = true;
    CHECK(!mimic_of(read(text, independent), "jb"));
  }
  for (const std::string &text : {urdf("<gazebo>" + mimic_plugin + "</gazebo>"), sdf(mimic_plugin)})
    CHECK((mimic_of(read(text), "jb")->joint == "ja" && mimic_of(read(text), "jb")->multiplier == -2));
  // what is stated twice, or from the other side, is the same; what differs is refused
  const std::string same = "<mimic joint=\"ja\" multiplier=\"-2\"/>", other = "<mimic joint=\"ja\"/>";
  CHECK(mimic_of(read(urdf("<gazebo>" + mimic_plugin + "</gazebo>", same)), "jb")->at.line == 2);
  const std::string from_b =
      "<gazebo>" + plugin("libmimic.so", "<joint>jb</joint><mimicJoint>ja</mimicJoint><multiplier>-0.5</multiplier>") +
      "</gazebo>";
  CHECK(!mimic_of(read(urdf(from_b, same)), "ja"));
  check_message(refusal(urdf(from_b, other)),
                {"r.xml:3: joint ja would follow joint jb by multiplier -0.5", "make both the same"});
  check_message(refusal(urdf("<gazebo>" + mimic_plugin + "</gazebo>", other)),
                {"joint jb would follow joint ja by multiplier -2", "by multiplier 1"});
  check_message(refusal(urdf(control(param("mimic", "jx")))),
                {"joint jb: it mimics joint \"jx\", which does not exist"});
  check_message(refusal(urdf(control(param("mimic", "ja") + param("multiplier", "two")))),
                {"joint jb: its <param name=\"multiplier\"> is \"two\""});
  const std::string still =
      "<link name=\"d\"/><joint name=\"jd\" type=\"fixed\"><parent link=\"a\"/><child link=\"d\"/></joint>";
  CHECK(!mimic_of(read(urdf(still + control(param("mimic", "ja"), "jd"))), "jd"));
  check_message(refusal(urdf("", same + drake)), {"it has <mimic> and <drake:mimic>"});
}

TEST_CASE("unread: a follower is no drive") {
  const std::string
      closes = "<constraint name=\"c\" type=\"spherical\"><parent link=\"a\"/><child link=\"b\"/></constraint>",
      command = "<command_interface name=\"effort\"/>";
  const auto robot = read(urdf(closes + control(command, "ja") + control(command + param("mimic", "ja"))));
  CHECK(robot.drives == std::vector<std::string>{"ja"});
}

TEST_CASE("unread: Drake's ball constraints and springs") {
  const auto element = [](const std::string &kind, const std::vector<std::pair<std::string, std::string>> &values,
                          bool in_text) {
    std::string out = "<drake:" + kind + ">";
    for (const auto &[tag, value] : values) {
      const std::string name = "drake:" + kind + "_" + tag;
      out += in_text ? "<" + name + ">" + value + "</" + name + ">"
                     : "<" + name + (tag.substr(0, 4) == "body" ? " name=\"" : " value=\"") + value + "\"/>";
    }
    return out + "</drake:" + kind + ">";
  };
  const std::vector<std::pair<std::string, std::string>> ends = {
      {"body_A", "a"}, {"body_B", "b"}, {"p_AP", "1 2 3"}, {"p_BQ", "4 5 6"}};
  auto spring = ends;
  spring.insert(spring.end(), {{"free_length", "0.3"}, {"stiffness", "500"}, {"damping", "7"}});
  for (const bool in_text : {false, true}) {
    const auto in_file = [&](const std::string &inside) { return in_text ? sdf(inside) : urdf(inside); };
    const auto robot =
        read(in_file(element("ball_constraint", ends, in_text) + element("ball_constraint", ends, in_text) +
                     element("linear_spring_damper", spring, in_text)));
    REQUIRE((robot.loops.size() == 2 && robot.force_elements.size() == 1));
    const loop_description &loop = robot.loops[0];
    const auto name = [&](int link) { return robot.links[static_cast<std::size_t>(link)].name; };
    CHECK((loop.name == "a_b_ball" && robot.loops[1].name != "a_b_ball" && loop.kind == joint_kind::spherical));
    CHECK((name(loop.predecessor) == "a" && name(loop.successor) == "b"));
    CHECK((loop.predecessor_pose.t.x == 1 && loop.predecessor_pose.t.z == 3 && loop.successor_pose.t.y == 5 &&
           loop.successor_pose.R.m11 == 1));
    const force_element_description &strut = robot.force_elements[0];
    CHECK((name(strut.link1) == "a" && name(strut.link2) == "b" && strut.point1.y == 2 && strut.point2.x == 4));
    CHECK((strut.numbers.free_length == 0.3 && strut.numbers.stiffness == 500 && strut.numbers.damping == 7 &&
           strut.name == "a_b_spring"));
    read_options cut;
    cut.cut_loops = true;
    CHECK(read(in_file(element("ball_constraint", ends, in_text)), cut).loops.empty());
    check_message(refusal(in_file(element("ball_constraint", {ends[0], ends[1]}, in_text))),
                  {"no <drake:ball_constraint_p_AP>", "add it"});
    check_message(refusal(in_file(element("ball_constraint", {{"body_A", "x"}}, in_text))), {"\"x\""});
  }
}

TEST_CASE("unread: limits of <ros2_control> are those of a joint where they are tighter, or alone") {
  const auto command = [](const std::string &name, const std::string &min, const std::string &max) {
    return "<command_interface name=\"" + name + "\">" + param("min", min) + param("max", max) + "</command_interface>";
  };
  const auto joint = [&](const std::string &limit, const std::string &commands) {
    auto robot = read(
        "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><joint name=\"jb\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/>" +
        limit + "</joint>" + control(commands) + "</robot>");
    CHECK(robot.warnings.size() <= 1);
    return std::pair{robot.joints[0], robot.warnings.size()};
  };
  const std::string limit = "<limit lower=\"-1\" upper=\"1\" effort=\"10\" velocity=\"0\"/>";
  const auto [tighter, said] =
      joint(limit, command("effort", "-7", "5") + command("velocity", "-3", "3") + command("position", "-2", "2"));
  CHECK((tighter.effort == 5.0 && tighter.velocity == 3.0 && tighter.lower == -1.0 && said == 1));
  const auto [wider, silent] = joint(limit, command("effort", "-20", "20"));
  CHECK((wider.effort == 10.0 && silent == 0));
  const auto [alone, positions] = joint("", command("position", "-2", "2") + command("effort", "0", "9"));
  CHECK((alone.lower == -2.0 && alone.upper == 2.0 && alone.effort == 9.0 && positions == 1));
  CHECK(!joint("", command("effort", "{-2*pi}", "3")).first.effort);
}

TEST_CASE("unread: a joint that <ros2_control> commands by itself follows all the same, and that is said") {
  const auto robot = [&](const std::string &denied, const std::string &in_joint) {
    return read("<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>"
                "<joint name=\"ja\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/></joint>"
                "<joint name=\"jb\" type=\"continuous\"><parent link=\"b\"/><child link=\"c\"/>" +
                in_joint + "</joint><ros2_control name=\"c\"><joint name=\"jb\" mimic=\"" + denied +
                "\"/></ros2_control></robot>");
  };
  const std::string follows = "<mimic joint=\"ja\"/>";
  const auto said = [](const robot_description &r) {
    return std::any_of(r.unused.begin(), r.unused.end(),
                       [](const std::string &line) { return line.find("mimic=\"independent\"") != std::string::npos; });
  };
  CHECK((said(robot("false", follows)) && mimic_of(robot("false", follows), "jb")));
  CHECK(!said(robot("true", follows)));
  CHECK(!said(robot("false", "")));
}

TEST_CASE("unread: gears that would not turn") {
  check_message(
      refusal(
          "<sdf version=\"1.10\"><model name=\"m\"><link name=\"r\"/><link name=\"a\"/><link name=\"b\"/>"
          "<joint name=\"ja\" type=\"revolute\"><parent>r</parent><child>a</child><axis><xyz>0 0 1</xyz></axis></joint>"
          "<joint name=\"jb\" type=\"revolute\"><parent>r</parent><child>b</child><axis><xyz>0 0 1</xyz></axis></joint>"
          "<joint name=\"g\" type=\"gearbox\"><parent>a</parent><child>b</child><gearbox_ratio>0</gearbox_ratio><gearbox_reference_body>r</gearbox_reference_body>"
          "<axis><xyz>0 0 1</xyz></axis><axis2><xyz>0 0 1</xyz></axis2></joint></model></sdf>"),
      {"joint g: its <gearbox_ratio> is 0"});
}

TEST_CASE("unread: limits that are negative, and gravity that a simulator turns off, are said") {
  const auto robot = read(urdf("<gazebo reference=\"a\"><turnGravityOff> true </turnGravityOff></gazebo>"
                               "<gazebo reference=\"b\"><gravity>0</gravity></gazebo>"
                               "<gazebo reference=\"r\"><gravity>1</gravity></gazebo>"));
  CHECK(robot.warnings ==
        std::vector<std::string>{"link a, b: <gazebo> turns gravity off, but gravity acts on all links"});
  const auto negative =
      read("<robot><link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"revolute\"><parent link=\"a\"/>"
           "<child link=\"b\"/><limit effort=\"-1\" velocity=\"-2\"/></joint></robot>");
  CHECK((!negative.joints[0].effort && !negative.joints[0].velocity));
  CHECK(negative.warnings ==
        std::vector<std::string>{
            "joint j: the limit of effort is negative, and none is taken: it is a magnitude; correct it",
            "joint j: the limit of velocity is negative, and none is taken: it is a magnitude; correct it"});
}
