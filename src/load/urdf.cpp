// Reads URDF 1.0 to 1.2: https://wiki.ros.org/urdf/XML, and versions 1.1 and 1.2 as urdfdom has them.  Two extensions are read,
// with a warning: <joint> of any kind that the engine has, and <drake:joint> as Drake's documentation of URDF describes it.  Rotors are
// read from attributes of <dynamics>, or as Drake has them.
//
//     robot                     name, version
//       link                    name: inertial (origin, mass, inertia); visual and collision are listed
//       joint, drake:joint      name, type: origin, parent, child, axis, axis2, limit, limit1 … limit3, screw_thread_pitch, dynamics, mimic
//       constraint, loop_joint, loop, coupling                          close loops, couple joints (urdf_loops.hpp)
//       force_element, drake:ball_constraint, drake:linear_spring_damper
//       transmission            rotors and gears; an actuator says that its joint has a motor
//       ros2_control            mimics, limits, motors (urdf_control.hpp)
//       gazebo                  plugins that couple joints; the rest is listed
//
// What a file holds besides is listed as unused, unless it joins links or couples joints (unread.hpp): then the robot would be another machine.
#include "load/urdf.hpp"

#include "ksl/engine/model/joints.hpp"

#include "description/structure/check.hpp"
#include "description/parts/given.hpp"
#include "description/structure/mimic.hpp"
#include "load/drake_elements.hpp"
#include "load/mesh_scales.hpp"
#include "load/unread.hpp"
#include "load/urdf_control.hpp"
#include "load/urdf_drives.hpp"
#include "load/urdf_loops.hpp"
#include "load/urdf_values.hpp"
#include "text/limits.hpp"
#include "text/regular_file.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

namespace ksl {

namespace {

using text::element;
using text::quoted;

class urdf_reader {
public:
  urdf_reader(const text::xml_file &file, const read_options &options)
      : file_(file), options_(options), root_(file, unused_, file.root(), {"robot", ""}) {}

  robot_description read();

private:
  void check_root() const;
  void check_expanded() const;
  void check_joint_elements() const;
  void read_loops();
  void check_gazebo_joints() const;
  void name_parts();
  void read_mimics_elsewhere();
  void check_unread() const;
  void list_weightless();
  void read_drake_elements();
  int minor_version() const;
  void read_link(pugi::xml_node node);
  void read_joint(pugi::xml_node node);
  joint_kind drake_kind_of(const element &joint) const;
  void read_motion(const element &joint, joint_description &out);
  void read_drake_motion(const element &joint, joint_description &out);
  static void read_axis(const element &joint, joint_description &out);
  static void read_pitch(const element &joint, const char *tag, joint_description &out);
  void ignore(const element &joint, const char *tag, const joint_description &out);
  void warn();
  void read_limit(const element &joint, joint_description &out);
  void read_limits_of_several(const element &joint, joint_description &out);
  void read_dynamics(const element &joint, joint_description &out);
  void read_mimic(const element &joint, joint_description &out);
  void read_transmission(pugi::xml_node node);
  void read_ros_rotor(pugi::xml_node transmission);
  bool names_drive(pugi::xml_node transmission) const;
  void read_rotor(const element &actuator, joint_description &out);
  void set_rotor(optional_number inertia, optional_number ratio, const std::string &what, joint_description &out);
  void drop_what_has_no_effect(joint_description &out);

  const text::xml_file &file_;
  const read_options &options_;
  text::unused_list unused_;
  element root_;
  robot_description robot_;
  int minor_ = 0; ///< version 1.minor
  readers::links_by_name links_{robot_, {}};
  readers::part_names names_;
  std::map<std::string, std::size_t> joint_index_;
  std::set<std::string> drives_, types_beyond_urdf_;
  std::vector<std::string> joints_beyond_urdf_;
  std::map<std::string, std::vector<std::string>> drake_joints_;    ///< what is said of a type: the names of its joints
  std::map<std::string, std::vector<std::string>> negative_limits_; ///< effort or velocity: the names of joints
};

bool is_drake(const element &joint) { return joint.tag() == "drake:joint"; }

robot_description urdf_reader::read() {
  check_root();
  check_expanded();
  check_joint_elements();
  root_.expect({"name", "version"}, {"link", "joint", "drake:joint", "constraint", "loop_joint", "loop", "coupling",
                                     "force_element", "drake:ball_constraint", "drake:linear_spring_damper", "material",
                                     "transmission", "gazebo", "ros2_control"});
  minor_ = minor_version();
  robot_.name = root_.text("name");
  robot_.file = file_.name();
  if (!file_.guessed_encoding().empty())
    robot_.warnings.push_back(file_.guessed_encoding());

  // links first: joints refer to them by name, wherever they are in the file
  for (const pugi::xml_node link : root_.node().children("link"))
    read_link(link);
  if (robot_.links.empty())
    root_.refuse("no <link> in <robot>; a robot needs at least one, <link name=\"base\"/> for example");
  for (const pugi::xml_node child : root_.node().children())
    if (child.name() == std::string_view("joint") || child.name() == std::string_view("drake:joint"))
      read_joint(child);
  for (std::size_t j = 0; j < robot_.joints.size(); ++j)
    joint_index_.try_emplace(robot_.joints[j].name, j);
  // from here on all links and joints have names: what stands beside them says more of them
  name_parts();
  read_mimics_elsewhere();
  readers::read_limits_of_control(file_, robot_, unused_);
  list_weightless();
  for (const pugi::xml_node transmission : root_.node().children("transmission"))
    read_transmission(transmission);
  for (const pugi::xml_node transmission : root_.node().children("transmission"))
    read_ros_rotor(transmission);
  // joint_index_ holds up to here: joints that close loops leave the list, and the others move up
  read_loops();
  check_unread();
  for (const pugi::xml_node other : root_.node().children())
    for (const char *tag : {"material", "transmission", "gazebo", "ros2_control"})
      if (other.name() == std::string_view(tag) && !(tag == std::string_view("transmission") && names_drive(other)))
        unused_.in_robot(tag);

  warn();
  // the structure is judged last, when all lines have been read, so that a fault in one of them is told by its line
  check_tree(robot_);
  leaders_of(robot_);
  warn_of_links(robot_, check_inertias(robot_), options_.strict, "correct these inertias");
  for (std::string &line : readers::mesh_scale_warnings(root_.node()))
    robot_.warnings.push_back(std::move(line));
  robot_.unused = unused_.lines();
  return std::move(robot_);
}

void urdf_reader::check_root() const {
  const std::string tag = root_.tag();
  if (tag == "robot")
    return;
  std::string mend = "give a URDF or SDF file";
  if (tag == "mujoco")
    mend = "this is MJCF, which ksl.load reads in Python, and Model.to_urdf writes as URDF";
  if (tag == "sdf")
    mend = "this looks like SDF: convert it to URDF first";
  if (tag == "SimscapeMultibodyImportXML" || tag == "PhysicalModelingXMLFile")
    mend =
        "this is an assembly for Simscape Multibody, whose mates become joints in MATLAB alone: export URDF from the CAD program";
  if (tag.substr(0, 6) == "xacro:")
    mend = "run xacro first: xacro FILE > robot.urdf";
  file_.refuse(root_.node(), "the root element is <" + tag + ">, expected <robot>; " + mend);
}

/// Refuses xacro elements, which would be ignored without notice.  A declaration of xacro's namespace alone is harmless: the
/// program xacro leaves it in its output.
void urdf_reader::check_expanded() const {
  struct finder : pugi::xml_tree_walker {
    pugi::xml_node found;
    bool for_each(pugi::xml_node &node) override {
      if (std::string_view(node.name()).substr(0, 6) != "xacro:")
        return true;
      found = node;
      return false;
    }
  } xacro;
  pugi::xml_node root = root_.node();
  root.traverse(xacro);
  if (xacro.found)
    file_.refuse(xacro.found,
                 "<" + std::string(xacro.found.name()) + "> is not expanded; run xacro first: xacro FILE > robot.urdf");
}

/// Refuses elements that would be joints to another reader.  If they were only listed, their freedoms would be lost.
void urdf_reader::check_joint_elements() const {
  for (const pugi::xml_node child : root_.node().children()) {
    const std::string name = child.name(), local = name.substr(name.find(':') == name.npos ? 0 : name.find(':') + 1);
    const bool is_joint = local.size() == 5 && (local == "joint" || local == "Joint" || local == "JOINT");
    if (is_joint && name != "joint" && name != "drake:joint")
      file_.refuse(child,
                   "<" + name +
                       "> is a joint that KSL doesn't know; write <joint name=\"...\" type=\"...\">, or <drake:joint>");
    if (!options_.cut_loops && readers::is_foreign_loop(name))
      file_.refuse(
          child,
          "<" + name + "> would close a loop, and is no element that KSL knows; write <constraint name=\"...\" " +
              "type=\"...\">; --loops cut (loops=\"cut\" in Python, cut_loops in C++) reads the file without loops");
  }
}

/// What closes loops, which needs all links; couplings, which need the tree; and drives.
void urdf_reader::read_loops() {
  const auto in_file = [&](pugi::xml_node node) {
    return element(file_, unused_, node, {"loop joint", node.attribute("name").value()});
  };
  for (const pugi::xml_node child : root_.node().children())
    if (!options_.cut_loops && readers::is_loop(child.name())) {
      text::check_count(file_, child, robot_.joints.size() + robot_.loops.size(), text::limits::joints, "joints");
      robot_.loops.push_back(readers::loop_in(in_file(child), links_, minor_, unused_));
    }
  for (const pugi::xml_node child : root_.node().children("force_element")) {
    text::check_count(file_, child, robot_.force_elements.size(), text::limits::joints, "force elements");
    robot_.force_elements.push_back(
        readers::force_element_in({file_, unused_, child, {"force element", child.attribute("name").value()}}, links_));
  }
  // behind all others, since their names are made so that nothing else has them
  read_drake_elements();
  // of the joints that stand as <joint> some may close loops; a coupling needs the tree, which is known from here on
  readers::split_loops(robot_, readers::joints_with_motors(root_.node()), unused_);
  const std::vector<int> moving = root_.node().child("coupling") ? readers::moving_joints(robot_) : std::vector<int>();
  for (const pugi::xml_node coupling : root_.node().children("coupling"))
    if (options_.mimic_independent)
      unused_.in_robot("coupling");
    else
      readers::read_coupling({file_, unused_, coupling, {"coupling", coupling.attribute("name").value()}}, robot_,
                             links_, moving);
  if (options_.cut_loops) {
    robot_.loops.clear();
    return;
  }
  check_gazebo_joints();
  // also where there are no loops, which a program may add
  if (std::vector<std::string> drives = readers::driven_joints(root_.node(), robot_, unused_); !drives.empty()) {
    drives_ = {drives.begin(), drives.end()};
    robot_.drives = std::move(drives);
  }
}

void urdf_reader::read_drake_elements() {
  std::set<std::string> taken;
  const auto take = [&](const auto &items) {
    for (const auto &item : items)
      taken.insert(item.name);
  };
  take(robot_.joints), take(robot_.loops), take(robot_.force_elements);
  const auto link = [&](const element &child, const std::string &name) {
    if (const auto found = links_.index.find(name); found != links_.index.end())
      return found->second;
    child.refuse("link " + quoted(name) + " does not exist; name one of the robot's links");
  };
  for (const pugi::xml_node child : root_.node().children())
    if (readers::is_drake_element(child.name())) {
      text::check_count(file_, child, taken.size(), 2 * text::limits::joints, "joints and force elements");
      readers::add_drake_element({file_, unused_, child, {"robot", ""}}, link, !options_.cut_loops, taken, robot_);
    }
}

/// The names by which elements that are not read may mean links and joints.  A <frame> is Drake's: a name for a place on a link.
void urdf_reader::name_parts() {
  for (const link_description &link : robot_.links)
    names_.add_link(link.name, link.name);
  for (const pugi::xml_node frame : root_.node().children("frame"))
    if (const auto found = links_.index.find(frame.attribute("link").value()); found != links_.index.end())
      names_.add_link(frame.attribute("name").value(), found->first);
  for (const joint_description &joint : robot_.joints)
    names_.add_joint(joint.name);
}

/// Mimics that <ros2_control> and plugins in <gazebo> state.
void urdf_reader::read_mimics_elsewhere() {
  const readers::left_out option = {.links = options_.cut_loops, .joints = options_.mimic_independent};
  std::vector<readers::stated_mimic> mimics = readers::mimics_of_control(file_, names_, option);
  for (const pugi::xml_node gazebo : root_.node().children("gazebo"))
    for (const pugi::xml_node plugin : gazebo.children())
      if (!readers::is_plugin(plugin))
        continue;
      else if (const auto named = readers::read_plugin(file_, names_, plugin, option, mimics); !named.empty())
        unused_.in_robot("plugin " + std::string(plugin.attribute("name").value()) + " of the simulator, which names " +
                         text::listed(named));
  for (const readers::stated_mimic &mimic : mimics) {
    const auto leader = joint_index_.find(mimic.leader), follower = joint_index_.find(mimic.follower);
    if (leader == joint_index_.end())
      file_.refuse(mimic.at, "joint " + mimic.follower + ": it mimics joint " + quoted(mimic.leader) +
                                 ", which does not exist; correct the name");
    joint_description &joint = robot_.joints[follower->second];
    if (joint.kind == joint_kind::fixed)
      unused_.in_joint("mimic stated elsewhere", "no effect on a fixed joint", mimic.follower);
    else if (options_.mimic_independent)
      unused_.in_joint("mimic", "the coupling is not applied: each has a coordinate of its own", mimic.follower);
    else
      readers::follow(file_, mimic, joint, robot_.joints[leader->second]);
  }
  for (const std::string &name : readers::followers_denied(file_))
    if (const auto joint = joint_index_.find(name); joint != joint_index_.end() && robot_.joints[joint->second].mimic)
      unused_.in_joint(
          "mimic=\"false\" of <ros2_control>",
          "it follows as its <mimic> says, without a motor; load with mimic=\"independent\" where nothing couples them",
          name);
}

/// Refuses what no reader knows, and what is in <gazebo>, where it joins links or couples joints.
void urdf_reader::check_unread() const {
  const readers::left_out option = {.links = options_.cut_loops, .joints = options_.mimic_independent};
  for (const pugi::xml_node node : unused_.elements)
    readers::refuse_if_joining(file_, names_, node, option);
  for (const auto &[node, attribute] : unused_.attributes)
    if (node.name() == std::string_view("joint") || node.name() == std::string_view("drake:joint"))
      readers::refuse_if_joining(file_, names_, node, attribute, option);
  for (const pugi::xml_node gazebo : root_.node().children("gazebo"))
    for (const pugi::xml_node child : gazebo.children())
      if (child.type() == pugi::node_element && !readers::is_plugin(child))
        readers::refuse_if_joining(file_, names_, child, option);
}

/// Links on which gravity doesn't act in Gazebo.
void urdf_reader::list_weightless() {
  std::vector<std::string> links;
  for (const pugi::xml_node gazebo : root_.node().children("gazebo"))
    for (const auto &[tag, yes, one] : {std::tuple{"turnGravityOff", "true", "1"}, {"gravity", "false", "0"}})
      if (const std::string_view said = text::trimmed(gazebo.child_value(tag)); said == yes || said == one)
        links.push_back(gazebo.attribute("reference").value());
  if (!links.empty())
    robot_.warnings.push_back(
        text::printable("link " + text::listed(links) + ": <gazebo> turns gravity off, but gravity acts on all links"));
}

/// Refuses joints between links of the robot in <gazebo>, which Gazebo adds to those of the tree.
void urdf_reader::check_gazebo_joints() const {
  for (const pugi::xml_node gazebo : root_.node().children("gazebo"))
    for (const pugi::xml_node joint : gazebo.children("joint")) {
      const auto is_link = [&](const char *tag) {
        return links_.index.count(std::string(text::trimmed(joint.child_value(tag)))) > 0;
      };
      if (is_link("parent") && is_link("child"))
        file_.refuse(joint, "joint " + quoted(joint.attribute("name").value()) +
                                " in <gazebo> closes a loop; state it as <constraint>, or read the file without loops: "
                                "--loops cut, loops=\"cut\" in Python, cut_loops in C++");
    }
}

int urdf_reader::minor_version() const {
  if (!root_.has("version"))
    return 0;
  const std::string version = root_.text("version");
  if (version == "1.0")
    return 0;
  if (version == "1.1")
    return 1;
  if (version == "1.2")
    return 2;
  root_.refuse("URDF version " + quoted(version) +
               " is unknown, expected 1.0, 1.1 or 1.2; if the file needs nothing newer, write version=\"1.2\"");
}

void urdf_reader::read_link(pugi::xml_node node) {
  text::check_count(file_, node, robot_.links.size(), text::limits::links, "links");
  const element link(file_, unused_, node, {"link", node.attribute("name").value()});
  if (link.where().name.empty())
    link.refuse("<link> has no name; write <link name=\"...\">");
  link.expect({"name"}, {"inertial", "visual", "collision"});
  link_description out;
  out.name = link.where().name;
  out.at = {link.line()};
  for (const char *tag : {"visual", "collision"})
    if (node.child(tag)) {
      unused_.in_link(tag);
      out.has_geometry = true;
    }
  if (const element inertial = link.child("inertial")) {
    out.has_inertial = true;
    out.given = readers::inertia_in(inertial, minor_);
    out.inertia = given::inertia_of(*out.given);
  }
  links_.index.try_emplace(out.name, static_cast<int>(robot_.links.size()));
  robot_.links.push_back(std::move(out));
}

///
///     parent link ── origin ──▸ joint's frame ── motion of the kind about axis ──▸ child link, whose frame it is at zero
void urdf_reader::read_joint(pugi::xml_node node) {
  text::check_count(file_, node, robot_.joints.size(), text::limits::joints, "joints");
  const element joint(file_, unused_, node, {"joint", node.attribute("name").value()});
  if (joint.where().name.empty())
    joint.refuse("<" + joint.tag() + "> has no name; write <" + joint.tag() + " name=\"...\" type=\"...\">");
  joint.expect({"name", "type"}, {"origin", "parent", "child", "axis", "axis2", "limit", "limit1", "limit2", "limit3",
                                  "dynamics", "mimic", "drake:mimic", "safety_controller", "calibration",
                                  "screw_thread_pitch", "drake:screw_thread_pitch"});
  joint_description out;
  out.name = joint.where().name;
  out.at = {joint.line()};
  out.kind = is_drake(joint) ? drake_kind_of(joint) : readers::kind_in(joint);
  out.parent = readers::link_in(joint, "parent", links_);
  out.child = readers::link_in(joint, "child", links_);
  for (const char *tag : {"parent", "child"})
    joint.child(tag).expect({"link"}, {});
  out.placement = readers::origin_in(joint, minor_, out.given.rotation);
  if (is_drake(joint))
    read_drake_motion(joint, out);
  else
    read_motion(joint, out);
  read_dynamics(joint, out);
  read_mimic(joint, out);
  for (const char *tag : {"safety_controller", "calibration"})
    if (node.child(tag))
      unused_.in_joint(tag, "not used", out.name);
  robot_.joints.push_back(std::move(out));
}

/// Drake reads its own types in <drake:joint> only.
joint_kind urdf_reader::drake_kind_of(const element &joint) const {
  const std::string type = joint.text("type");
  for (const auto &[name, kind] : {std::pair{"ball", joint_kind::spherical},
                                   {"universal", joint_kind::universal},
                                   {"planar", joint_kind::planar},
                                   {"screw", joint_kind::helical}})
    if (type == name)
      return kind;
  joint.refuse("<drake:joint> type " + quoted(type) +
               " is unknown, expected one of ball, universal, planar, screw; other types are written as <joint>");
}

/// Reads what the joint's kind needs: axes, limits, pitch.  <limit> has one number for each bound, and is for joints with one
/// coordinate.
void urdf_reader::read_motion(const element &joint, joint_description &out) {
  const joint_kind_row row = row_of(out.kind);
  if (row.has_axis)
    read_axis(joint, out);
  else
    ignore(joint, "axis", out);
  if (row.has_axis2) {
    out.given.axis2 = readers::axis2_in(joint);
    out.axis2 = given::direction_of(out.given.axis2);
  } else {
    ignore(joint, "axis2", out);
  }
  if (row.nv == 1)
    read_limit(joint, out);
  else
    ignore(joint, "limit", out);
  read_limits_of_several(joint, out);
  if (row.has_pitch)
    read_pitch(joint, "screw_thread_pitch", out);
  else
    ignore(joint, "screw_thread_pitch", out);
  ignore(joint, "drake:screw_thread_pitch", out);
  const std::string type = joint.text("type");
  for (const char *standard : {"fixed", "revolute", "continuous", "prismatic", "floating", "planar"})
    if (type == standard)
      return;
  types_beyond_urdf_.insert(type), joints_beyond_urdf_.push_back(out.name);
}

/// Drake's joints: axes are fixed but for screws and the normal of planar joints, which Drake reads since 2023, and some
/// coordinates differ from those of the same kind here.
void urdf_reader::read_drake_motion(const element &joint, joint_description &out) {
  // Drake has axes of its own for most types, and coordinates that differ: the same numbers of q and v mean another motion there
  std::string differs;
  if (out.kind == joint_kind::helical) {
    read_axis(joint, out);
    read_pitch(joint, "drake:screw_thread_pitch", out);
    read_limit(joint, out);
  } else {
    if (out.kind == joint_kind::planar)
      read_axis(joint, out);
    else
      ignore(joint, "axis", out);
    for (const char *tag : {"limit", "drake:screw_thread_pitch"})
      ignore(joint, tag, out);
    read_limits_of_several(joint, out);
  }
  for (const char *tag : {"axis2", "screw_thread_pitch"})
    ignore(joint, tag, out);
  if (out.kind == joint_kind::universal)
    out.axis = {1, 0, 0}, out.axis2 = {0, 1, 0};
  if (out.kind == joint_kind::planar)
    differs =
        "; its normal is <axis>, x where there is none, as Drake has it since 2023, and was z before; v is along the "
        "child's axes, Drake's along the parent's, and where the normal isn't z, x and y are other axes of the plane";
  if (out.kind == joint_kind::spherical)
    differs =
        "; q is a quaternion [x y z w] and v in the child's axes, Drake's are roll, pitch, yaw and in the parent's axes";
  drake_joints_["<drake:joint> type " + joint.text("type") + ", an extension of URDF" + differs].push_back(out.name);
}

void urdf_reader::read_axis(const element &joint, joint_description &out) {
  out.given.axis = readers::axis_in(joint);
  out.axis = given::direction_of(out.given.axis);
}

void urdf_reader::read_pitch(const element &joint, const char *tag, joint_description &out) {
  out.given.pitch = readers::pitch_in(joint, tag);
  out.pitch = given::pitch_of(out.given.pitch);
}

void urdf_reader::ignore(const element &joint, const char *tag, const joint_description &out) {
  if (joint.child(tag))
    unused_.in_joint(tag, "no effect on a " + std::string(row_of(out.kind).name) + " joint", out.name);
}

void urdf_reader::warn() {
  if (!joints_beyond_urdf_.empty())
    robot_.warnings.push_back(text::printable("joint " + text::listed(joints_beyond_urdf_) + ": " +
                                              text::listed({types_beyond_urdf_.begin(), types_beyond_urdf_.end()}) +
                                              (types_beyond_urdf_.size() > 1 ? " are types" : " is a type") +
                                              " beyond URDF, which other readers may refuse"));
  for (const auto &[what, joints] : drake_joints_)
    robot_.warnings.push_back(text::printable("joint " + text::listed(joints) + ": " + what));
  for (const auto &[what, joints] : negative_limits_)
    robot_.warnings.push_back(text::printable("joint " + text::listed(joints) + ": the limit of " + what +
                                              " is negative, and none is taken: it is a magnitude; correct it"));
}

void urdf_reader::read_limit(const element &joint, joint_description &out) {
  const element limit = joint.child("limit");
  if (!limit)
    return;
  limit.expect({"lower", "upper", "effort", "velocity", "acceleration", "deceleration", "jerk"}, {});
  const auto magnitude = [&](const char *name) {
    const optional_number x = limit.number(name);
    if (x && *x < 0)
      negative_limits_[name].push_back(out.name);
    return x && *x < 0 ? std::nullopt : x;
  };
  out.effort = magnitude("effort"), out.velocity = magnitude("velocity");
  for (const char *name : {"acceleration", "deceleration", "jerk"})
    if (limit.has(name))
      unused_.in_joint("limit " + std::string(name), "not used", out.name);
  if (!row_of(out.kind).has_limits) {
    for (const char *name : {"lower", "upper"})
      if (limit.has(name))
        unused_.in_joint("limit " + std::string(name),
                         "no effect on a " + std::string(row_of(out.kind).name) + " joint", out.name);
    return;
  }
  // the page has 0 for a bound that is left out; here there is none then
  out.lower = limit.number("lower");
  out.upper = limit.number("upper");
  if (out.lower && out.upper && *out.lower > *out.upper)
    limit.refuse("lower limit " + text::shown(*out.lower) + " is above upper limit " + text::shown(*out.upper) +
                 "; exchange or correct them");
}

/// <limit1>, <limit2>, <limit3>: of the numbers of a position that has several.
void urdf_reader::read_limits_of_several(const element &joint, joint_description &out) {
  const int numbers = row_of(out.kind).nv > 1 ? numbers_with_limits(row_of(out.kind)) : 0;
  for (int c = 0; c < 3; ++c) {
    const std::string tag = "limit" + std::to_string(c + 1);
    const element limit = joint.child(tag.c_str());
    if (c >= numbers)
      ignore(joint, tag.c_str(), out);
    if (!limit || c >= numbers)
      continue;
    limit.expect({"lower", "upper"}, {});
    const coordinate_limits given = {limit.number("lower"), limit.number("upper")};
    if (given.lower && given.upper && *given.lower > *given.upper)
      limit.refuse("lower limit " + text::shown(*given.lower) + " is above upper limit " + text::shown(*given.upper) +
                   "; exchange or correct them");
    if (c == 0)
      out.lower = given.lower, out.upper = given.upper;
    else
      out.further[static_cast<std::size_t>(c - 1)] = given;
  }
}

/// damping and friction are URDF's; the others KSL's own attributes, which other readers pass over.
void urdf_reader::read_dynamics(const element &joint, joint_description &out) {
  const element dynamics = joint.child("dynamics");
  if (!dynamics)
    return;
  if (is_drake(joint)) { // as many numbers as its kind has coordinates
    unused_.in_joint("dynamics", "not used", out.name);
    return;
  }
  dynamics.expect({"damping", "friction", "friction_width", "armature", "rotor_inertia", "gear_ratio",
                   "spring_stiffness", "spring_reference"},
                  {});
  const auto read = [&](const char *name, double &value) { value = dynamics.number(name).value_or(value); };
  read("damping", out.damping);
  read("friction", out.friction);
  read("armature", out.armature);
  read("rotor_inertia", out.rotor_inertia);
  read("gear_ratio", out.gear_ratio);
  read("spring_stiffness", out.spring_stiffness);
  read("spring_reference", out.spring_rest);
  out.friction_width = dynamics.number("friction_width");
  drop_what_has_no_effect(out);
}

/// Many files give every joint the same <dynamics>.  What a joint of this kind can't use is listed.
void urdf_reader::drop_what_has_no_effect(joint_description &out) {
  const joint_kind_row kind = row_of(out.kind);
  const std::string why = "no effect on a " + std::string(kind.name) + " joint";
  const bool has_rotor = kind.nv != 0 && !kind.is_free;
  const struct {
    const char *name;
    double *value;
    bool is_usable;
  } numbers[] = {{"armature", &out.armature, has_rotor},
                 {"rotor_inertia", &out.rotor_inertia, has_rotor},
                 {"spring_stiffness", &out.spring_stiffness, kind.nv == 1}};
  for (const auto &[name, value, is_usable] : numbers)
    if (!is_usable && *value != 0) {
      unused_.in_joint(name, why, out.name);
      *value = 0;
    }
}

void urdf_reader::read_mimic(const element &joint, joint_description &out) {
  const element plain = joint.child("mimic"), of_drake = joint.child("drake:mimic"), mimic = plain ? plain : of_drake;
  if (!mimic)
    return;
  if (plain && of_drake)
    of_drake.refuse("it has <mimic> and <drake:mimic>; keep one of both");
  if (out.kind == joint_kind::fixed)
    return unused_.in_joint("mimic", "no effect on a fixed joint", out.name);
  if (options_.mimic_independent)
    return unused_.in_joint("mimic", "the coupling is not applied: each has a coordinate of its own", out.name);
  mimic.expect({"joint", "multiplier", "offset"}, {});
  if (mimic.text("joint").empty())
    mimic.refuse("<mimic> names no joint; write <mimic joint=\"...\"/>");
  out.mimic = {
      mimic.text("joint"), mimic.number("multiplier").value_or(1), mimic.number("offset").value_or(0), {mimic.line()}};
}

/// The rotor that Drake's documentation of URDF describes, <drake:rotor_inertia value="..."/> and <drake:gear_ratio value="..."/> in
/// an <actuator> of a transmission for one joint.
///
///     Drake    <transmission> <joint name="j"/> <actuator> <drake:rotor_inertia value/> <drake:gear_ratio value/> </actuator>
///     ROS      <transmission> <joint name="j"/> <actuator> <motorInertia>… <mechanicalReduction>… </actuator>         (read_ros_rotor)
void urdf_reader::read_transmission(pugi::xml_node node) {
  const element transmission(file_, unused_, node, {"robot", ""});
  std::vector<pugi::xml_node> actuators;
  for (const pugi::xml_node actuator : node.children("actuator"))
    if (actuator.child("drake:rotor_inertia") || actuator.child("drake:gear_ratio"))
      actuators.push_back(actuator);
  if (actuators.empty())
    return;
  const element joint = transmission.child("joint"); // two are an error
  const std::string name = joint ? joint.text("name") : "";
  const auto found = joint_index_.find(name);
  if (found == joint_index_.end())
    transmission.refuse("its actuator has a rotor, and its joint " + quoted(name) +
                        " does not exist; name the joint in <joint name=\"...\"/>");
  if (actuators.size() > 1)
    transmission.refuse("two actuators have rotors for joint " + quoted(name) + "; keep one");
  read_rotor(element(file_, unused_, actuators.front(), {"joint", name}), robot_.joints[found->second]);
}

/// Into a joint whose <dynamics> has no rotor, if it can have one.
void urdf_reader::read_rotor(const element &actuator, joint_description &out) {
  const auto value = [&](const char *tag) {
    const element given = actuator.child(tag);
    return given ? optional_number(given.required_number("value", "write value=\"...\"")) : std::nullopt;
  };
  set_rotor(value("drake:rotor_inertia"), value("drake:gear_ratio"), "drake:rotor_inertia, drake:gear_ratio", out);
}

/// Rotors are read in three steps, each of which leaves what those before it have set: <dynamics>, Drake's actuators, transmissions of ROS.
/// A rotor that stands elsewhere than in <dynamics>, which comes first.
void urdf_reader::set_rotor(optional_number inertia, optional_number ratio, const std::string &what,
                            joint_description &out) {
  const joint_kind_row kind = row_of(out.kind);
  if (kind.nv == 0 || kind.is_free)
    return unused_.in_joint(what, "no effect on a " + std::string(kind.name) + " joint", out.name);
  // 0 and 1 stand where nothing was given
  const bool has_rotor = out.rotor_inertia != 0 || out.gear_ratio != 1;
  if (has_rotor && (inertia.value_or(0) != out.rotor_inertia || ratio.value_or(1) != out.gear_ratio))
    return unused_.in_joint(what, "differs from <dynamics>, which is used", out.name);
  out.rotor_inertia = inertia.value_or(0), out.gear_ratio = ratio.value_or(1);
}

/// Rotor and gear as transmissions of ROS have them: <motorInertia>, kg m², and <mechanicalReduction>, revolutions of the motor for
/// one of the joint.  They stand in the actuator, in the joint or beside them, of a transmission between one of each.
void urdf_reader::read_ros_rotor(pugi::xml_node node) {
  const pugi::xml_node actuator = node.child("actuator"), joint = node.child("joint");
  // between several actuators and joints, as of a differential gear, one number for each says too little
  const bool is_plain = !actuator.next_sibling("actuator") && !joint.next_sibling("joint");
  const auto found = joint_index_.find(joint.attribute("name").value());
  // in each place where it may stand; two that differ say nothing
  optional_number inertia, ratio;
  for (const auto &[tag, value] : {std::pair{"motorInertia", &inertia}, {"mechanicalReduction", &ratio}})
    for (const pugi::xml_node parent : {actuator, joint, node}) {
      const pugi::xml_node given = parent.child(tag);
      if (!given)
        continue;
      const optional_number number = text::number_in(text::trimmed(given.child_value()));
      const bool is_possible = number && (value == &ratio ? *number != 0 : *number >= 0);
      if (!is_plain || !is_possible || found == joint_index_.end() || (*value && *value != number))
        unused_.in_robot(std::string(tag) + " of <transmission>");
      else
        *value = number;
    }
  if (!inertia && ratio.value_or(1) == 1)
    return;
  joint_description &out = robot_.joints[found->second];
  if (!inertia && out.rotor_inertia == 0 && out.gear_ratio == 1) // kept for those who size drives
    unused_.in_joint("mechanicalReduction", "read as gear_ratio, no effect without a rotor's inertia", out.name);
  if (!inertia && ratio == out.gear_ratio)
    return;
  if (inertia && out.armature != 0) // most likely the same inertia, reflected
    return unused_.in_joint("motorInertia", "not used, since <dynamics> has an armature", out.name);
  set_rotor(inertia, ratio, inertia ? "motorInertia, mechanicalReduction" : "mechanicalReduction", out);
}

/// Is it there only to say that a joint of a mechanism with loops has a motor?
bool urdf_reader::names_drive(pugi::xml_node transmission) const {
  return !robot_.loops.empty() && drives_.count(transmission.child("joint").attribute("name").value()) > 0;
}

} // namespace

robot_description read_urdf(const std::string &path, const read_options &options) {
  return read_urdf_text(text::bytes_of_file(path), path, options);
}

robot_description read_urdf_text(const std::string &text, const std::string &name, const read_options &options) {
  return read_urdf(text::xml_file(text, name), options);
}

robot_description read_urdf(const text::xml_file &file, const read_options &options) {
  return urdf_reader(file, options).read();
}

} // namespace ksl
