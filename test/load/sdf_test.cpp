// SDF files: where frames are, what joints become, and each way in which a file can be wrong.
#include "refusal.hpp"

#include "load/robot_file.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

using namespace ksl;
using ksl::test::check_message;

namespace {

robot_description read(const std::string &text, const read_options &options = {}) {
  return read_robot_text(text, "r.sdf", options);
}

std::string refusal(const std::string &text, const read_options &options = {}) {
  return test::refusal_of([&] { read(text, options); });
}

/// A model that holds `inside`, from line 3 on.
std::string model(const std::string &inside, const std::string &attributes = "", const std::string &version = "1.10") {
  return "<sdf version=\"" + version + "\">\n<model name=\"m\" " + attributes + ">\n" + inside + "\n</model>\n</sdf>\n";
}

const std::string inertial =
    "<inertial><mass>2</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>";

std::string link(const std::string &name, const std::string &inside = "") {
  return "<link name=\"" + name + "\">" + inside + inertial + "</link>\n";
}
std::string pose(const std::string &numbers, const std::string &relative_to = "") {
  return "<pose" + (relative_to.empty() ? "" : " relative_to=\"" + relative_to + "\"") + ">" + numbers + "</pose>";
}
/// A joint from a to b, in line 5 of a model with these links, that holds `inside`.
std::string joint(const std::string &inside, const std::string &type = "revolute", const std::string &in_b = "") {
  return model(link("a") + link("b", in_b) + "<joint name=\"j\" type=\"" + type +
               "\"><parent>a</parent><child>b</child>" + inside + "</joint>");
}
const std::string about_z = "<axis><xyz>0 0 1</xyz></axis>";
/// A joint from a to b as above: b is 2 above a and turned about x, the joint's frame along y of b and turned about z.
std::string old_joint(const std::string &version, const std::string &inside) {
  return model(link("a") + link("b", pose("0 0 2 1.5707963267948966 0 0")) +
                   "<joint name=\"j\" type=\"revolute\"><parent>a</parent><child>b</child>" +
                   pose("0 0.25 0 0 0 1.5707963267948966") + inside + "</joint>",
               "", version);
}

const joint_description &joint_named(const robot_description &robot, const std::string &name) {
  const auto found = std::find_if(robot.joints.begin(), robot.joints.end(),
                                  [&](const joint_description &j) { return j.name == name; });
  REQUIRE(found != robot.joints.end());
  return *found;
}
std::string link_name(const robot_description &robot, int i) { return robot.links[static_cast<std::size_t>(i)].name; }

void check_vector(const vec3<double> &found, double x, double y, double z) {
  CHECK(found.x == doctest::Approx(x).epsilon(1e-14));
  CHECK(found.y == doctest::Approx(y).epsilon(1e-14));
  CHECK(found.z == doctest::Approx(z).epsilon(1e-14));
}

/// One line of the unused contents, or of the warnings, says all of this.
void check_said(const std::vector<std::string> &lines, std::initializer_list<const char *> parts) {
  const bool found = std::any_of(lines.begin(), lines.end(), [&](const std::string &line) {
    return std::all_of(parts.begin(), parts.end(), [&](const char *part) { return line.find(part) != line.npos; });
  });
  std::string all;
  for (const std::string &line : lines)
    all += line + "\n";
  CAPTURE(all);
  CHECK(found);
}

void check_all(const std::vector<test::wrong_text> &cases) {
  test::check_all(cases, [](const std::string &text) { return refusal(text); });
}

} // namespace

TEST_CASE("a model floats on the world unless a joint connects it") {
  const auto robot = read(joint(about_z));
  CHECK(robot.name == "m");
  CHECK(robot.links[0].name == "world");
  const auto &free = joint_named(robot, "floating_base");
  CHECK(free.kind == joint_kind::floating);
  CHECK(link_name(robot, free.child) == "a");

  const auto two = read(model(link("a", pose("1 2 3 0 0 0")) + link("b")));
  CHECK(link_name(two, joint_named(two, "a_floating").child) == "a");
  check_vector(joint_named(two, "a_floating").placement.t, 1, 2, 3);
  CHECK(joint_named(two, "b_floating").kind == joint_kind::floating);

  const std::string held = "<joint name=\"j\" type=\"fixed\"><parent>world</parent><child>a</child></joint>";
  const auto fixed = read(model(link("a") + held));
  CHECK(fixed.joints.size() == 1);
  read_options floating;
  floating.floating_base = true;
  CHECK(read(model(link("a")), floating).joints.size() == 1);
  check_message(refusal(model(link("a") + held), floating),
                {"r.sdf:4: joint j: a floating base is asked for", "link a", "remove the joint"});
}

TEST_CASE("poses are relative to what the file says") {
  const double quarter = 1.5707963267948966;
  const std::string turned = "1 0 0 0 0 1.5707963267948966";
  const auto robot =
      read(model(link("a", pose(turned)) + link("b", pose("0 2 0 0 0 0", "a")) + link("c", pose("0 0 3 0 0 0", "f")) +
                 "<frame name=\"f\" attached_to=\"b\">" + pose("0 0 1 0 0 0") + "</frame>" +
                 "<joint name=\"ab\" type=\"continuous\"><parent>a</parent><child>b</child>" + about_z + "</joint>" +
                 "<joint name=\"bc\" type=\"continuous\"><parent>f</parent><child>c</child>" + about_z + "</joint>"));
  check_vector(joint_named(robot, "floating_base").placement.t, 1, 0, 0);
  const auto &ab = joint_named(robot, "ab").placement;
  CHECK(ab.t.y == 2); // as the file gives it, to the last bit
  CHECK(ab.R.m00 == 1);
  const auto &bc = joint_named(robot, "bc");
  CHECK(link_name(robot, bc.parent) == "b"); // that frame f moves with
  check_vector(bc.placement.t, 0, 0, 4);
  check_vector(joint_named(robot, "f_joint").placement.t, 0, 0, 1);

  SUBCASE("of a model in the world, and by a placement frame") {
    const std::string inside = pose("0 0 5 0 0 0") + link("a", pose("0 1 0 0 0 0"));
    check_vector(joint_named(read(model(inside)), "floating_base").placement.t, 0, 1, 5);
    check_vector(joint_named(read(model(inside, "placement_frame=\"a\"")), "floating_base").placement.t, 0, 0, 5);
  }
  SUBCASE("in degrees and as quaternions") {
    const auto R = [](const std::string &given) {
      return joint_named(read(model(link("a", given))), "floating_base").placement.R;
    };
    // R_z(yaw) R_y(pitch) R_x(roll), with sines 1/2 and 1/2 and 1
    const auto rolled = R("<pose degrees=\"true\">0 0 0 30 150 90</pose>");
    CHECK(rolled.m00 == doctest::Approx(0).epsilon(1e-12));
    CHECK(rolled.m20 == doctest::Approx(-0.5));
    CHECK(rolled.m21 == doctest::Approx(-std::sqrt(0.75) / 2));
    CHECK(rolled.m22 == doctest::Approx(-0.75));
    CHECK(rolled.m10 == doctest::Approx(-std::sqrt(0.75)));
    CHECK(R("<pose rotation_format=\"quat_xyzw\">0 0 0 0.6 0 0 0.8</pose>").m21 == doctest::Approx(0.96));
    CHECK(R("<pose>0 0 0 0 0 " + std::to_string(quarter) + "</pose>").m10 == doctest::Approx(1));
    CHECK(R("<pose rotation_format=\"quat_xyzw\">0 0 0 0 0 0.7071067811865476 0.7071067811865476</pose>").m10 ==
          doctest::Approx(1));
  }
}

TEST_CASE("a joint's frame that is not its child's is a massless link") {
  const auto robot = read(joint(about_z + pose("0 0 -1 0 0 0"), "revolute", pose("0 0 3 0 0 0")));
  const auto &j = joint_named(robot, "j");
  CHECK(link_name(robot, j.child) == "j_frame");
  check_vector(j.placement.t, 0, 0, 2);
  const auto &weld = joint_named(robot, "j_frame_joint");
  CHECK(link_name(robot, weld.child) == "b");
  check_vector(weld.placement.t, 0, 0, 1);
  // any other frame, however it differs; not a rounding
  for (const char *other : {"1e-9 0 0 0 0 0", "0 1e-9 0 0 0 0", "0 0 1e-9 0 0 0", "0 0 0 1e-9 0 0", "0 0 0 0 1e-9 0",
                            "0 0 0 0 0 1e-9", "0 0 0 3.141592653589793 0 0"})
    CHECK(read(joint(about_z + pose(other))).links.size() == robot.links.size());
  CHECK(read(joint(about_z + pose("1e-13 0 0 0 1e-13 0"))).links.size() == robot.links.size() - 1);
}

TEST_CASE("axes are in the frame that the file says") {
  const std::string turned = pose("0 0 0 0 0 1.5707963267948966");
  const auto axis = [&](const std::string &xyz) {
    return joint_named(read(joint("<axis>" + xyz + "</axis>", "revolute", turned)), "j").axis;
  };
  check_vector(axis("<xyz>2 0 0</xyz>"), 1, 0, 0);
  check_vector(axis("<xyz expressed_in=\"__model__\">2 0 0</xyz>"), 0, -1, 0);
  check_vector(axis("<xyz expressed_in=\"a\">0 1 0</xyz>"), 1, 0, 0);
  const double long_ = std::sqrt(14.0); // about x and then z by quarters: x of b is y of a, y is z, z is x
  const auto &permuted = joint_named(read(joint("<axis><xyz expressed_in=\"a\">1 2 3</xyz></axis>", "revolute",
                                                pose("0 0 0 1.5707963267948966 0 1.5707963267948966"))),
                                     "j");
  check_vector(permuted.axis, 2 / long_, 3 / long_, 1 / long_);
}

TEST_CASE("types of joints") {
  for (const auto &[type, kind] : {std::pair{"revolute", joint_kind::revolute},
                                   {"continuous", joint_kind::continuous},
                                   {"prismatic", joint_kind::prismatic},
                                   {"fixed", joint_kind::fixed},
                                   {"ball", joint_kind::spherical}})
    CHECK(joint_named(read(joint(kind == joint_kind::fixed || kind == joint_kind::spherical ? "" : about_z, type)), "j")
              .kind == kind);
  for (const char *type : {"universal", "revolute2"}) {
    const auto robot = read(joint(about_z + "<axis2><xyz>0 3 4</xyz></axis2>", type));
    CHECK(joint_named(robot, "j").kind == joint_kind::universal);
    check_vector(joint_named(robot, "j").axis2, 0, 0.6, 0.8);
  }
  const double turn = 6.283185307179586;
  CHECK(*joint_named(read(joint(about_z + "<screw_thread_pitch>0.02</screw_thread_pitch>", "screw")), "j").pitch ==
        doctest::Approx(0.02 / turn));
  CHECK(*joint_named(read(joint(about_z + "<thread_pitch>-50</thread_pitch>", "screw")), "j").pitch ==
        doctest::Approx(0.02)); // left-handed positive
  const auto planar = read(model(
      link("a") + link("b") +
      "<drake:joint name=\"j\" type=\"planar\"><drake:parent>a</drake:parent><drake:child>b</drake:child></drake:joint>"));
  CHECK(joint_named(planar, "j").kind == joint_kind::planar);
  check_said(planar.warnings, {"joint j", "drake:joint", "Drake's along the parent's"});
}

TEST_CASE("limits and dynamics") {
  const auto limited = [](const std::string &limit) {
    return joint_named(read(joint("<axis><xyz>0 0 1</xyz><limit>" + limit + "</limit></axis>")), "j");
  };
  const auto j = limited("<lower>-1</lower><upper>2</upper><effort>30</effort><velocity>4</velocity>");
  CHECK(*j.lower == -1);
  CHECK(*j.upper == 2);
  CHECK(*j.effort == 30);
  CHECK(*j.velocity == 4);
  const auto free = limited("<lower>-1e16</lower><upper>inf</upper><effort>-1</effort><velocity>-1</velocity>");
  CHECK(!free.lower);
  CHECK(!free.upper);
  CHECK(!free.effort);
  CHECK(!free.velocity);
  const auto robot = read(joint(
      "<axis><xyz>0 0 1</xyz><dynamics><damping>0.5</damping><friction>0.25</friction><spring_stiffness>3</spring_stiffness>"
      "<spring_reference>0.1</spring_reference></dynamics></axis>"));
  CHECK(joint_named(robot, "j").damping == 0.5);
  CHECK(joint_named(robot, "j").friction == 0.25);
  CHECK(joint_named(robot, "j").spring_stiffness == 3);
  CHECK(joint_named(robot, "j").spring_rest == 0.1);
}

TEST_CASE("damping of two axes is used if it is the same") {
  const auto axes = [](const std::string &first, const std::string &second) {
    const auto axis = [](const std::string &xyz, const std::string &damping) {
      return "<xyz>" + xyz + "</xyz>" +
             (damping.empty() ? "" : "<dynamics><damping>" + damping + "</damping></dynamics>");
    };
    return read(
        joint("<axis>" + axis("1 0 0", first) + "</axis><axis2>" + axis("0 1 0", second) + "</axis2>", "universal"));
  };
  CHECK(joint_named(axes("0.5", "0.5"), "j").damping == 0.5);
  for (const auto &robot : {axes("0.5", "0.25"), axes("0.5", ""), axes("", "0.5")}) {
    CHECK(joint_named(robot, "j").damping == 0);
    check_said(robot.unused, {"joint j: dynamics", "differ"});
  }
  CHECK(axes("", "").unused.empty());
}

TEST_CASE("joints that mimic others") {
  const std::string text = model(
      link("a") + link("b") + link("c") + "<joint name=\"i\" type=\"continuous\"><parent>a</parent><child>b</child>" +
          about_z +
          "</joint><joint name=\"j\" type=\"continuous\"><parent>b</parent><child>c</child><axis><xyz>0 0 1</xyz><mimic joint=\"i\">"
          "<multiplier>2</multiplier><offset>3</offset><reference>0.5</reference></mimic></axis></joint>",
      "", "1.11");
  const auto robot = read(text);
  const auto &j = joint_named(robot, "j");
  REQUIRE(j.mimic);
  CHECK(j.mimic->joint == "i");
  CHECK(j.mimic->multiplier == 2);
  CHECK(j.mimic->offset == 2);
  CHECK(!joint_named(read(text, {.mimic_independent = true}), "j").mimic);
}

/// Two gears, a and b, on a carrier; `more` is beside a gearbox from a to b, or `of_gearbox` instead of what it has.
std::string geared(const std::string &of_gearbox, const std::string &more = "",
                   const std::string &axis_of_b = "0 0 2") {
  const auto turning = [](const std::string &name, const std::string &child, const std::string &axis) {
    return "<joint name=\"" + name + "\" type=\"revolute\"><parent>carrier</parent><child>" + child +
           "</child><axis><xyz>" + axis + "</xyz></axis></joint>\n";
  };
  return model(link("carrier") + link("a") + link("b", pose("1 0 0 1.5707963267948966 0 0")) +
               turning("A", "a", "0 0 1") + turning("B", "b", axis_of_b) +
               "<joint name=\"g\" type=\"gearbox\"><parent>a</parent><child>b</child>" + of_gearbox + "</joint>\n" +
               more);
}
const std::string on_carrier = "<gearbox_reference_body>carrier</gearbox_reference_body>",
                  axes_of_gearbox = about_z + "<axis2><xyz>0 0 1</xyz></axis2>";

TEST_CASE("a gearbox couples the joints on its reference body, θ₂ = −ratio θ₁ about its axes") {
  const auto multiplier = [](const std::string &text) {
    const auto robot = read(text);
    CHECK(robot.joints.size() == 3); // with the floating base: a gearbox holds nothing
    CHECK(robot.loops.empty());
    const auto &mimic = joint_named(robot, "B").mimic;
    REQUIRE(mimic);
    CHECK(mimic->joint == "A");
    CHECK(mimic->offset == 0);
    return mimic->multiplier;
  };
  const std::string ratio = "<gearbox_ratio>0.25</gearbox_ratio>";
  const auto axes_at_b = [](const std::string &one,
                            const std::string &two) { // a's axis z is y of b, whose frame the gearbox has
    return "<axis><xyz>" + one + "</xyz></axis><axis2><xyz>" + two + "</xyz></axis2>";
  };
  CHECK(multiplier(geared(on_carrier + ratio + axes_at_b("0 1 0", "0 0 1"))) == -0.25);
  CHECK(multiplier(geared(on_carrier + ratio + axes_at_b("0 -1 0", "0 0 1"))) == 0.25);
  CHECK(multiplier(geared(on_carrier + ratio + axes_at_b("0 1 0", "0 0 -1"))) == 0.25);
  CHECK(multiplier(geared(on_carrier + ratio + axes_at_b("0 1 0", "0 0 1"), "", "0 0 -2")) == 0.25);
  CHECK(multiplier(geared(on_carrier + axes_at_b("0 1 0", "0 0 1"))) == -1);
  CHECK(multiplier(geared("<pose relative_to=\"carrier\"/>" + on_carrier + ratio + axes_at_b("0 0 1", "0 -1 0"))) ==
        -0.25);

  const std::string text = geared(on_carrier + ratio + axes_at_b("0 1 0", "0 0 1"));
  CHECK(!joint_named(read(text, {.mimic_independent = true}), "B").mimic);
  check_said(read(text, {.mimic_independent = true}).unused, {"joint g: gearbox", "a coordinate of its own"});
  const std::string limited =
      "<axis><xyz>0 1 0</xyz><limit><lower>0</lower></limit></axis><axis2><xyz>0 0 1</xyz></axis2>";
  check_said(read(geared(on_carrier + limited)).unused, {"joint g: limit", "the joints that it couples"});
}

TEST_CASE("inertias: rotated, and missing") {
  const auto robot =
      read(model("<link name=\"a\"><inertial><pose>1 0 0 0 0 1.5707963267948966</pose><mass>2</mass>"
                 "<inertia><ixx>1</ixx><iyy>2</iyy><izz>2.5</izz><ixy>0.1</ixy></inertia></inertial></link>"));
  const auto &I = robot.links[1].inertia;
  CHECK(I.m == 2);
  CHECK(I.h.x == 2);
  CHECK(I.Ixx == doctest::Approx(2));
  CHECK(I.Iyy == doctest::Approx(1 + 2));
  CHECK(I.Ixy == doctest::Approx(-0.1));
  CHECK(robot.warnings.empty());

  const std::string without = model("<link name=\"a\"/><link name=\"b\"><inertial><mass>1</mass></inertial></link>");
  const auto usual = read(without);
  CHECK(usual.links[1].inertia.m == 1); // as the format says
  CHECK(usual.links[1].inertia.Ixx == 1);
  check_said(usual.warnings, {"link a: no <inertial>", "1 kg", "write"});
  check_said(usual.warnings, {"link b (<inertia>)", "missing"});
  read_options strict;
  strict.strict = true;
  check_message(refusal(without, strict), {"link a: no <inertial>"});
}

TEST_CASE("nested models") {
  const std::string hand = "<model name=\"hand\">" + pose("0 0 1 0 0 0", "a") + link("palm", pose("0 0 2 0 0 0")) +
                           "<frame name=\"tip\" attached_to=\"palm\"/></model>";
  const auto robot = read(model(link("a", pose("5 0 0 0 0 0")) + hand +
                                "<joint name=\"j\" type=\"continuous\"><parent>a</parent><child>hand::palm</child>" +
                                about_z + "</joint>"));
  const auto &j = joint_named(robot, "j");
  CHECK(link_name(robot, j.child) == "hand::palm");
  check_vector(j.placement.t, 0, 0, 3);
  CHECK(link_name(robot, joint_named(robot, "hand::tip_joint").child) == "hand::tip");
}

TEST_CASE("worlds, and files with several models") {
  const std::string ground = "<model name=\"ground\"><static>true</static><link name=\"g\"/></model>",
                    one = "<model name=\"one\">" + link("a") + "</model>",
                    two = "<model name=\"two\">" + link("b") + "</model>";
  const auto world = [](const std::string &inside) {
    return "<sdf version=\"1.9\"><world name=\"w\"><gravity>0 0 -1.6</gravity><physics/>" + inside + "</world></sdf>";
  };
  const auto robot = read(world(ground + one));
  CHECK(robot.name == "one");
  CHECK(robot.gravity[2] == -1.6);
  check_said(robot.unused, {"model ground, static"});
  check_message(refusal(world(one + two)), {"several models, one, two", "model="});
  read_options options;
  options.model = "two";
  CHECK(read(world(one + two), options).name == "two");
  options.model = "twp";
  check_message(refusal(world(one + two), options), {"no model \"twp\"", "did you mean \"two\"?"});
  check_message(refusal(world(ground)), {"no <model> that moves"});
  options.model = "ground";
  check_message(refusal(world(ground), options), {"static"});
  check_message(
      test::refusal_of([] { read_robot_text("<robot><link name=\"a\"/></robot>", "r.urdf", {.model = "x"}); }),
      {"only SDF files"});
}

TEST_CASE("what is not used is listed") {
  const auto robot = read(model("<plugin name=\"p\" filename=\"f\"/><what/>" +
                                link("a", "<visual name=\"v\"/><sensor name=\"s\"/><gravity>false</gravity>") +
                                link("b") + "<joint name=\"j\" type=\"continuous\"><parent>a</parent><child>b</child>" +
                                about_z + "<physics/><odd/></joint>"));
  check_said(robot.unused, {"plugin"});
  check_said(robot.unused, {"unknown element <what>", "model m"});
  check_said(robot.unused, {"unknown element <odd>", "joint j"});
  check_said(robot.unused, {"visual (1 link)"});
  check_said(robot.unused, {"sensor (1 link)"});
  check_said(robot.unused, {"joint j: physics"});
  check_said(robot.warnings, {"link a", "<gravity> is false"});
}

TEST_CASE("meshes that are used in two units") {
  const auto visual = [](const std::string &scale) {
    return "<visual name=\"v\"><geometry><mesh><uri>arm.stl</uri>" +
           (scale.empty() ? "" : "<scale>" + scale + "</scale>") + "</mesh></geometry></visual>";
  };
  check_said(read(model(link("a", visual("0.001 0.001 0.001") + visual("")))).warnings,
             {"link a: mesh \"arm.stl\"", "scale 0.001 and at scale 1", "other units"});
  CHECK(read(model(link("a", visual("1 1 1") + visual("1 1 -2")))).warnings.empty());
  const auto urdf = [](const std::string &scale) {
    return read(
               "<robot><link name=\"a\"><visual><geometry><mesh filename=\"arm.stl\"/></geometry></visual></link><link name=\"b\"><collision><geometry>"
               "<mesh filename=\"arm.stl\" scale=\"" +
               scale +
               "\"/></geometry></collision></link><joint name=\"j\" type=\"fixed\"><parent link=\"a\"/>"
               "<child link=\"b\"/></joint></robot>")
        .warnings;
  };
  check_said(urdf("0.0254 0.0254 0.0254"), {"link b, a: mesh \"arm.stl\""});
  CHECK(urdf("0.5 0.5 0.5").empty());
}

// Links a and b, b turned by 90° about x, and a joint whose frame is turned by 90° about z in b.  Columns of the turn from the model to
// b: x = (1,0,0), y = (0,0,1), z = (0,−1,0); from b to the joint: x = (0,1,0), y = (−1,0,0), z = (0,0,1).
TEST_CASE(
    "Axes of SDF 1.4 are in the model's frame, those of 1.5 and 1.6 in the joint's, unless use_parent_model_frame is true") {
  const auto axis = [](const std::string &version, const std::string &flag, const std::string &xyz = "0 0 1") {
    const std::string said = flag.empty() ? "" : "<use_parent_model_frame>" + flag + "</use_parent_model_frame>";
    const auto robot = read(old_joint(version, "<axis><xyz>" + xyz + "</xyz>" + said + "</axis>"));
    CHECK(robot.warnings.empty());
    CHECK(robot.unused.empty());
    const joint_description &j = joint_named(robot, "j");
    // the joint's frame is placed in its child, and where it is doesn't depend on the version
    check_vector(j.placement.t, 0, 0, 2 + 0.25); // b is 2 above a, and its y, along which the joint is, leads up
    return j.axis;
  };
  // z of the model is y of b, which is x of the joint; y of the model is −z of both
  for (const auto &[version, flag] : {std::pair{"1.4", ""}, {"1.4", "1"}, {"1.5", "true"}, {"1.6", "1"}}) {
    check_vector(axis(version, flag), 1, 0, 0);
    check_vector(axis(version, flag, "0 2 0"), 0, 0, -1);
  }
  for (const auto &[version, flag] : {std::pair{"1.4", "0"}, {"1.5", ""}, {"1.5", "false"}, {"1.6", ""}})
    check_vector(axis(version, flag), 0, 0, 1);
}

TEST_CASE("Names and frames that SDF allowed before 1.7") {
  SUBCASE("a link, its joint and a frame of the same name; links of included models") {
    const auto robot = read(
        model(link("arm") + "<joint name=\"arm::hand\" type=\"revolute\"><parent>arm</parent><child>arm::hand</child>" +
                  pose("0 0 1 0 0 0") + about_z + "</joint>" + link("arm::hand", pose("0 0 5 0 0 0")),
              "", "1.6"));
    check_vector(joint_named(robot, "arm::hand").placement.t, 0, 0, 6);
    CHECK(robot.warnings.empty());
  }
  SUBCASE("frame of a pose, which is empty in most files") {
    const auto in = [](const std::string &attribute) {
      return read(
          model(link("a", pose("1 0 0 0 0 0")) + link("b", "<pose " + attribute + ">0 2 0 0 0 0</pose>"), "", "1.6"));
    };
    check_vector(joint_named(in("frame=\"\""), "b_floating").placement.t, 0, 2, 0);
    CHECK(in("frame=\"\"").warnings.empty());
    check_vector(joint_named(in("frame=\"a\""), "b_floating").placement.t, 1, 2, 0);
    check_said(in("frame=\"a\"").warnings,
               {"link b: <pose frame=\"...\"> is read as relative_to", "SDF 1.6 may ignore it"});
    check_said(in("relative_to=\"a\"").warnings,
               {"link b: relative_to,", "came with SDF 1.7", "write version=\"1.7\""});
  }
  SUBCASE("gravity in the physics of a world, before 1.6") {
    const auto gravity = [](const std::string &version, const std::string &inside) {
      return read("<sdf version=\"" + version + "\"><world name=\"w\">" + inside + "<model name=\"m\">" + link("a") +
                  "</model></world></sdf>");
    };
    const std::string moon = "<physics><gravity>0.1 0.2 -1.62</gravity></physics>";
    CHECK(gravity("1.5", moon).gravity == std::array<double, 3>{0.1, 0.2, -1.62});
    CHECK(gravity("1.6", moon).gravity[2] == -9.81);
    check_said(gravity("1.6", moon).unused, {"gravity of physics"});
    CHECK(gravity("1.4", moon + "<gravity>0 0 -3</gravity>").gravity[2] == -3);
  }
}

TEST_CASE("SDF files that are wrong") {
  check_all({
      {"old", model(link("a"), "", "1.3"), {"r.sdf:1:", "version \"1.3\"", "expected 1.4 to 1.10", "gz sdf"}},
      {"no version", "<sdf>" + model(link("a")).substr(20), {"no version"}},
      {"nothing", "<sdf version=\"1.9\"/>", {"no <model>"}},
      {"no link", model(""), {"r.sdf:2: model m: no <link>"}},
      {"no name", model("<link/>"), {"r.sdf:3: <link> has no name"}},
      {"reserved name", model(link("world")), {"r.sdf:3:", "\"world\"", "reserves"}},
      {"twice", model(link("a") + link("a")), {"r.sdf:4: link a: the name is given twice", "line 3", "rename"}},
      {"include", model("<include><uri>model://x</uri></include>"), {"r.sdf:3:", "<include> is not read", "gz sdf -p"}},
      {"unknown joint element",
       model(link("a") + "<x:joint name=\"j\"/>"),
       {"r.sdf:4:", "<x:joint> is a joint that KSL doesn't know"}},
      {"unknown type",
       joint("", "hinge"),
       {"r.sdf:5: joint j: joint type \"hinge\" is unknown", "expected one of revolute"}},
      {"misspelt type", joint("", "prismatc"), {"did you mean \"prismatic\"?"}},
      {"gearbox",
       geared(axes_of_gearbox),
       {"r.sdf:8: joint g: a gearbox has no <gearbox_reference_body>", "name the link"}},
      {"gearbox on nothing",
       geared("<gearbox_reference_body>carier</gearbox_reference_body>" + axes_of_gearbox),
       {"joint g: <gearbox_reference_body> names \"carier\"", "did you mean \"carrier\"?"}},
      {"gearbox on its gear",
       geared("<gearbox_reference_body>b</gearbox_reference_body>" + axes_of_gearbox),
       {"joint g: it couples links that turn on b", "but a does not", "<mimic>"}},
      {"gearbox without an axis", geared(on_carrier + about_z), {"joint g: its <axis> is not parallel", "joint A"}},
      {"gearbox without axis2",
       geared(on_carrier + "<axis><xyz>0 1 0</xyz></axis>"),
       {"joint g: a gearbox joint needs <axis2>"}},
      {"gearbox twice",
       geared(on_carrier + "<axis><xyz>0 1 0</xyz></axis><axis2><xyz>0 0 1</xyz></axis2>",
              "<joint name=\"h\" type=\"gearbox\"><parent>a</parent><child>b</child>" + on_carrier +
                  "<axis><xyz>0 1 0</xyz></axis><axis2><xyz>0 0 1</xyz></axis2></joint>"),
       {"joint h: joint B follows joint A already", "keep one"}},
      {"gearbox in a circle",
       geared(on_carrier + "<axis><xyz>0 1 0</xyz></axis><axis2><xyz>0 0 1</xyz></axis2>",
              "<joint name=\"h\" type=\"gearbox\"><parent>b</parent><child>a</child>" + on_carrier +
                  "<axis><xyz>0 -1 0</xyz></axis><axis2><xyz>0 0 1</xyz></axis2></joint>"),
       {"mimics", "joint A"}},
      {"no type",
       model(link("a") + link("b") + "<joint name=\"j\"><parent>a</parent><child>b</child></joint>"),
       {"no type"}},
      {"no child",
       model(link("a") + "<joint name=\"j\" type=\"fixed\"><parent>world</parent></joint>"),
       {"r.sdf:4: joint j: no <child>"}},
      {"unknown parent",
       model(link("arm") + "<joint name=\"j\" type=\"fixed\"><parent>arn</parent><child>arm</child></joint>"),
       {"joint j: <parent> names \"arn\"", "did you mean \"arm\"?"}},
      {"child is the world",
       model(link("a") + "<joint name=\"j\" type=\"fixed\"><parent>a</parent><child>world</child></joint>"),
       {"exchange"}},
      {"no axis", joint(""), {"joint j: a revolute joint needs <axis>", "<xyz>0 0 1</xyz>"}},
      {"no xyz", joint("<axis/>"), {"<axis> has no <xyz>"}},
      {"zero axis", joint("<axis><xyz>0 0 0</xyz></axis>"), {"the axis is zero"}},
      {"axis of words", joint("<axis><xyz>0 0 up</xyz></axis>"), {"<xyz> holds \"up\""}},
      {"axis of two", joint("<axis><xyz>0 1</xyz></axis>"), {"<xyz> needs 3 numbers, found 2"}},
      {"unknown expressed_in", joint("<axis><xyz expressed_in=\"q\">0 0 1</xyz></axis>"), {"expressed_in names \"q\""}},
      {"one axis of two", joint(about_z, "universal"), {"a universal joint needs <axis2>"}},
      {"parallel axes", joint(about_z + "<axis2><xyz>0 0 1</xyz></axis2>", "universal"), {"joint j", "not parallel"}},
      {"no pitch", joint(about_z, "screw"), {"a screw joint needs its pitch", "<screw_thread_pitch>"}},
      {"zero thread_pitch", joint(about_z + "<thread_pitch>0</thread_pitch>", "screw"), {"<thread_pitch> is zero"}},
      {"two pitches",
       joint(about_z + "<thread_pitch>3</thread_pitch><screw_thread_pitch>1</screw_thread_pitch>", "screw"),
       {"disagree"}},
      {"limits",
       joint("<axis><xyz>0 0 1</xyz><limit><lower>2</lower><upper>1</upper></limit></axis>"),
       {"lower limit 2 is above upper limit 1"}},
      {"old axis",
       joint("<axis><xyz>0 0 1</xyz><use_parent_model_frame>1</use_parent_model_frame></axis>"),
       {"expressed_in=\"__model__\""}},
      {"old pose", model(link("a", "<pose frame=\"x\">0 0 0 0 0 0</pose>")), {"frame=\"x\"", "relative_to"}},
      {"old pose in a frame that isn't there",
       model(link("a", "<pose frame=\"x\">0 0 0 0 0 0</pose>"), "", "1.6"),
       {"link a: relative_to names \"x\""}},
      {"two frames of a pose",
       model(link("a") + link("b", "<pose frame=\"a\" relative_to=\"c\">0 0 0 0 0 0</pose>"), "", "1.6"),
       {"link b: <pose> has frame=\"a\" and relative_to=\"c\"", "remove one"}},
      {"two frames of an axis",
       old_joint("1.6",
                 "<axis><xyz expressed_in=\"a\">0 0 1</xyz><use_parent_model_frame>1</use_parent_model_frame></axis>"),
       {"joint j: it has <use_parent_model_frame> and expressed_in"}},
      {"old flag of an axis",
       old_joint("1.5", "<axis><xyz>0 0 1</xyz><use_parent_model_frame>maybe</use_parent_model_frame></axis>"),
       {"<use_parent_model_frame> is \"maybe\", expected true or false"}},
      {"old frame of an inertial",
       model("<link name=\"a\"><inertial><pose frame=\"b\">0 0 0 0 0 0</pose></inertial></link>", "", "1.5"),
       {"link a", "relative to \"b\""}},
      {"a scope in a new name", model(link("a::b")), {"\"a::b\"", "reserves"}},
      {"a name of the format in an old file", model(link("__model__"), "", "1.4"), {"reserves"}},
      {"unknown child",
       model(link("a") + "<joint name=\"j\" type=\"fixed\"><parent>a</parent><child>bb</child></joint>"),
       {"joint j: <child> names \"bb\", which is no link"}},
      {"unknown frame of a joint",
       model(link("a") + link("b") + "<joint name=\"j\" type=\"fixed\"><parent>a</parent><child>b</child>" +
             pose("0 0 0 0 0 0", "c") + "</joint>"),
       {"joint j: relative_to names \"c\""}},
      {"unknown frame of a frame",
       model(link("a") + "<frame name=\"f\" attached_to=\"b\"/>"),
       {"frame f: attached_to names \"b\""}},
      {"unknown frame", model(link("a", pose("0 0 0 0 0 0", "b"))), {"r.sdf:3: link a: relative_to names \"b\""}},
      {"cycle",
       model(link("a", pose("0 0 0 0 0 0", "b")) + link("b", pose("0 0 0 0 0 0", "a"))),
       {"relative to itself", "correct one relative_to"}},
      {"attached to itself",
       model(link("a") + "<frame name=\"f\" attached_to=\"g\"/><frame name=\"g\" attached_to=\"f\"/>"),
       {"frame ", "itself"}},
      {"pose of five", model(link("a", pose("0 0 0 0 0"))), {"<pose> needs 6 numbers, found 5"}},
      {"two poses", model(link("a", pose("") + pose(""))), {"a second <pose>"}},
      {"pose format", model(link("a", "<pose rotation_format=\"matrix\">0</pose>")), {"rotation_format \"matrix\""}},
      {"quaternion", model(link("a", "<pose rotation_format=\"quat_xyzw\">0 0 0 0 0 0 2</pose>")), {"length 2"}},
      {"pose of an inertial",
       model("<link name=\"a\"><inertial>" + pose("0 0 0 0 0 0", "b") + "</inertial></link>"),
       {"link a", "relative_to"}},
      {"computed inertia",
       model("<link name=\"a\"><inertial auto=\"true\"/></link>", "", "1.11"),
       {"collision geometry", "auto"}},
      {"negative mass", model("<link name=\"a\"><inertial><mass>-1</mass></inertial></link>"), {"link a", "negative"}},
      {"static", model("<static>1</static>" + link("a")), {"no <model> that moves"}},
      {"static inside",
       model(link("a") + "<model name=\"n\"><static>1</static>" + link("b") + "</model>"),
       {"model n: it is static inside of a model that moves", "fixed joints"}},
      {"mimic",
       joint("<axis><xyz>0 0 1</xyz><mimic joint=\"i\"><multiplier>2</multiplier></mimic></axis>"),
       {"mimics joint \"i\"", "does not exist"}},
      {"canonical link", model(link("a"), "canonical_link=\"x\""), {"\"x\""}},
      {"drake",
       model(
           link("a") +
           "<drake:joint name=\"j\" type=\"ball\"><drake:child>a</drake:child><drake:parent>world</drake:parent></drake:joint>"),
       {"<drake:joint> type \"ball\"", "planar"}},
  });
}

TEST_CASE("SDF: one limit alone, a name that begins as reserved ones do, and joints of a floating base") {
  const joint_description lower =
      joint_named(read(joint("<axis><xyz>0 0 1</xyz><limit><lower>-2</lower></limit></axis>")), "j");
  CHECK((lower.lower == -2.0 && lower.upper != lower.lower));
  const joint_description upper =
      joint_named(read(joint("<axis><xyz>0 0 1</xyz><limit><upper>2</upper></limit></axis>")), "j");
  CHECK(upper.upper == 2.0);
  CHECK(link_name(read(model(link("__a"))), 1) == "__a"); // after the world
  read_options floating;
  floating.floating_base = true;
  CHECK(joint_named(read(joint(about_z), floating), "j").kind == joint_kind::revolute);
  check_message(
      refusal(model(link("a") + "<joint name=\"j\" type=\"fixed\"><parent>world</parent><child>a</child></joint>"),
              floating),
      {"joint j", "a floating base is asked for"});
}

TEST_CASE("SDF: what has no effect is listed, with the joint that it is on") {
  const auto of = [](const std::string &inside, const std::string &type) { return read(joint(inside, type)).unused; };
  check_said(of(about_z, "fixed"), {"joint j: axis", "no effect on a fixed joint"});
  check_said(of(about_z + "<thread_pitch>1</thread_pitch>", "revolute"),
             {"joint j: thread_pitch", "no effect on a revolute joint"});
  check_said(of(about_z + "<axis2><xyz>1 0 0</xyz></axis2>", "revolute"),
             {"joint j: axis2", "no effect on a revolute joint"});
  check_said(of("<axis><xyz>0 0 1</xyz><limit><stiffness>1</stiffness></limit></axis>", "revolute"),
             {"joint j: limit stiffness", "not used"});
  check_said(of("<axis><xyz>0 0 1</xyz><limit><dissipation>1</dissipation></limit></axis>", "revolute"),
             {"joint j: limit dissipation", "not used"});
  const auto two = [&](const std::string &first) {
    return "<axis><xyz>1 0 0</xyz>" + first + "</axis><axis2><xyz>0 1 0</xyz></axis2>";
  };
  for (const char *tag : {"effort", "velocity"})
    check_said(of(two("<limit><" + std::string(tag) + ">3</" + tag + "></limit>"), "universal"),
               {"joint j: limit effort, velocity", "not used on a universal joint"});
  check_said(of(two("<dynamics><spring_stiffness>3</spring_stiffness></dynamics>"), "universal"),
             {"spring_stiffness", "only joints with one coordinate have springs"});
  for (const char *tag : {"lower", "upper"})
    check_said(
        of("<axis><xyz>0 0 1</xyz><limit><" + std::string(tag) + ">1</" + tag + "></limit></axis>", "continuous"),
        {"joint j: limit lower, upper", "no effect on a continuous joint"});
  CHECK(of("<axis><xyz>0 0 1</xyz><limit><effort>1</effort></limit></axis>", "continuous").empty());
  const auto friction = read(joint(
      "<axis><xyz>1 0 0</xyz><dynamics><friction>1</friction></dynamics></axis><axis2><xyz>0 1 0</xyz><dynamics><friction>2</friction>"
      "</dynamics></axis2>",
      "universal"));
  check_said(friction.unused, {"joint j: dynamics", "differ"});
  CHECK(joint_named(friction, "j").friction == 0);
  check_said(
      read(
          model(
              "<link name=\"a\"><inertial><mass>2</mass><fluid_added_mass/><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>"))
          .unused,
      {"fluid_added_mass"});
}

TEST_CASE("SDF: limits of the two axes of a universal joint") {
  const auto limits = [](const std::string &lower, const std::string &upper) {
    return joint(
        "<axis><xyz>1 0 0</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis><axis2><xyz>0 1 0</xyz><limit><lower>" +
            lower + "</lower><upper>" + upper + "</upper></limit></axis2>",
        "universal");
  };
  const auto j = joint_named(read(limits("-3", "4")), "j");
  CHECK((*j.lower == -1 && *j.upper == 2 && *j.further[0].lower == -3 && *j.further[0].upper == 4));
  check_message(refusal(limits("4", "-3")), {"joint j", "lower limit 4 is above upper limit -3"});
}

TEST_CASE("SDF: flags, poses, versions and worlds that are wrong, or unusual") {
  check_message(refusal(model(link("a"), "static=\"maybe\"")), {"accepted"}); // static is an element
  check_message(refusal(model("<link name=\"a\"><pose degrees=\"maybe\">0 0 0 0 0 90</pose></link>")),
                {"degrees of <pose> is \"maybe\"", "expected true or false"});
  check_message(
      refusal(model("<link name=\"a\"><pose degrees=\"1\" rotation_format=\"quat_xyzw\">0 0 0 0 0 0 1</pose></link>")),
      {"degrees and a quaternion", "remove degrees"});
  check_message(refusal(model("<link name=\"a\"><inertial auto=\"true\"/></link>")),
                {"computed from its collision geometry"});
  CHECK(refusal(model("<link name=\"a\"><inertial auto=\"0\"><mass>1</mass></inertial></link>")) == "accepted");
  const auto turned = [](const std::string &p) {
    return joint_named(read(joint(about_z, "revolute", p)), "j").placement.R;
  };
  CHECK(turned("<pose degrees=\"false\">0 0 0 0 0 1.5707963267948966</pose>").m10 == doctest::Approx(1));
  CHECK(turned("<pose degrees=\"true\">0 0 0 0 0 90</pose>").m10 == doctest::Approx(1));
  CHECK(turned("<pose>0 0 0 0 0.5 0</pose>").m20 == doctest::Approx(-std::sin(0.5)));
  CHECK(turned("<pose/>").m00 == 1);
  const auto strange = read(model(
      "<link name=\"a\"><pose>1 2 3 0 0 0<x/></pose><inertial><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>"));
  check_said(strange.unused, {"unknown element <x> in link a"});
  check_said(strange.warnings, {"a (<mass>)"});
  CHECK(turned("<pose>1 2 3 0 0 0</pose>").m00 == 1);
  for (const char *version : {"1.11", "1.12"})
    check_said(read(model(link("a"), "", version)).warnings, {"is newer than 1.10, and read as that"});
  const auto world = [](const std::string &inside) {
    return "<sdf version=\"1.10\"><world name=\"w\">" + inside + "<model name=\"m\">" + link("a") +
           "</model></world></sdf>";
  };
  for (const char *tag : {"include", "joint"})
    check_message(refusal(world("<" + std::string(tag) + "/>")),
                  {"in <world> is not read", "put the robot in a <model> of its own"});
  CHECK((read(world("")).gravity[2] == -9.81 && read(world("<gravity>1 2 3</gravity>")).gravity[0] == 1));
  const std::string nowhere = "<sdf version=\"1.10\"><world name=\"w\"/></sdf>";
  check_message(refusal(nowhere, {.model = "arm"}), {"no model \"arm\" in <world>", "there is none"});
  check_message(refusal(nowhere), {"no <model> that moves in <world>"});
  for (const char *name : {"world", "a::b", "__a__"})
    check_message(refusal(model(link(name))), {"a name that SDF reserves"});
  for (const char *name : {"__", "___", "__a", "a__"})
    CHECK(refusal(model(link(name))) == "accepted");
  check_message(refusal(model("<pose relative_to=\"a\">0 0 0 0 0 0</pose>" + link("a"))),
                {"its pose is relative to \"a\"", "give the pose in the world"});
  CHECK(refusal(model("<pose relative_to=\"world\">0 0 1 0 0 0</pose>" + link("a"))) == "accepted");
  check_message(refusal(model("<inertia/>")), {"no <link> in <model>"});
}

TEST_CASE("SDF: models of models, frames on the model's own frame") {
  const auto nested = read(model("<model name=\"inner\"><pose relative_to=\"shifted\">0 0 2 0 0 0</pose>" + link("a") +
                                 "</model><frame name=\"shifted\">" + pose("1 0 0 0 0 0") + "</frame>"));
  CHECK(std::any_of(nested.links.begin(), nested.links.end(),
                    [](const link_description &l) { return l.name == "inner::a"; }));
  CHECK(
      read(model("<frame name=\"f\" attached_to=\"a\"/>" + link("a"), "placement_frame=\"__model__\"")).links.size() >=
      1);
  check_message(
      refusal(joint(about_z + "<screw_thread_pitch>0.02</screw_thread_pitch><thread_pitch>50</thread_pitch>", "screw")),
      {"disagree", "remove <thread_pitch>"});
  CHECK(
      *joint_named(
           read(joint(
               about_z + "<screw_thread_pitch>0.02</screw_thread_pitch><thread_pitch>-314.1592653589793</thread_pitch>",
               "screw")),
           "j")
           .pitch == doctest::Approx(0.02 / 6.283185307179586));
  check_message(refusal(joint("<axis><xyz>0 0 1</xyz><mimic><multiplier>2</multiplier></mimic></axis>")),
                {"<mimic> names no joint", "write <mimic joint"});
}
