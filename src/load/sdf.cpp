// Reads SDF 1.4 to 1.10: http://sdformat.org/spec, with frames as "Pose frame semantics" there has them, for 1.4 to 1.6 as "Pose frame
// semantics: legacy behavior", and <drake:joint> as Drake's documentation of SDF describes it.
//
// Poses are relative to frames that may come later in a file, so that it is read twice:
//
//     collect_model    names, frames and their poses, model in model; what has a frame is noted in links_, joints_, other_frames_
//     place_by         models that are placed by a frame of theirs
//     read_…           links, frames, joints, with all frames known
//     connect_all      the graph of links and joints becomes a tree and loops
//     add_floating     links that nothing carries float on the world, which is link 0
//
// Names inside a nested model are prefixed by those of the models around it: "arm::hand".
#include "load/sdf.hpp"

#include "ksl/engine/model/joints.hpp"

#include "description/structure/check.hpp"
#include "description/parts/given.hpp"
#include "description/structure/loops.hpp"
#include "description/structure/mimic.hpp"
#include "load/drake_elements.hpp"
#include "load/mesh_scales.hpp"
#include "load/sdf_frames.hpp"
#include "load/unread.hpp"
#include "text/limits.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace ksl {

namespace {

using readers::sdf::frame_graph;
using readers::sdf::own_frame;
using text::element;
using text::listed;
using text::quoted;

class sdf_reader {
public:
  sdf_reader(const text::xml_file &file, const read_options &options)
      : file_(file), options_(options), root_(file, unused_, file.root(), {"file", ""}) {}

  robot_description read();

private:
  /// A link, joint or frame, to be read when all frames are known.
  struct part {
    std::string scope, name; ///< "arm::", "arm::hand"
    std::string frame;       ///< full name of its frame: `name`, unless a link has that name, too
    element at;
  };
  /// A joint that has been read, and the links and the frame that it connects.
  struct connection {
    joint_description joint;
    std::string parent, child, frame;
  };

  element in_file(pugi::xml_node node, const std::string &kind, const std::string &name) const {
    return {file_, unused_, node, {kind, name}};
  }
  std::string name_of(pugi::xml_node node) const;
  void check_version();
  pugi::xml_node chosen_model();
  void collect_model(pugi::xml_node node, const std::string &scope, const std::string &name,
                     const std::string &full_name);
  std::string collect_part(pugi::xml_node child, const std::string &scope);
  readers::sdf::given_pose pose_of(const element &at);
  void read_gravity(const element &holder);
  void check_content(const element &model);
  void read_link(const part &link);
  void read_frame(const part &frame);
  void read_joint(const part &joint);
  joint_kind kind_of(const element &joint);
  std::string end_of(const part &joint, const char *tag) const;
  void read_motion(const part &joint, joint_description &out);
  vec3<double> axis_in(const part &joint, const char *tag, vec3<double> &given);
  std::string frame_of_axis(const element &axis, const element &xyz);
  double pitch_in(const element &joint, double &metres_a_revolution) const;
  void read_limit(const element &axis, int number, joint_description &out);
  void read_dynamics(const element &axis, const std::string &scope, joint_description &out);
  void read_mimic(const element &mimic, const std::string &scope, joint_description &out);
  void read_drake_mimic(const part &joint, joint_description &out);
  void read_drake_elements();
  void read_plugins_and_check_unread();
  const connection &turning_on(const part &gearbox, const std::string &reference, const std::string &link,
                               const std::vector<bool> &in_tree) const;
  double sense_of(const part &gearbox, const char *tag, const connection &turning);
  void couple(const part &gearbox, const std::vector<bool> &in_tree);
  void connect_all();
  void connect(joint_description joint, const std::string &parent, const std::string &child, const std::string &frame);
  void close_loop(const joint_description &joint, const std::string &parent, const std::string &child,
                  const std::string &frame);
  void add_floating();
  void warn();
  int add_link(const std::string &name);
  int weld(const std::string &name, int parent, int child, const SE3<double> &pose);
  std::string free_joint_name(const std::string &name) const;

  const text::xml_file &file_;
  const read_options &options_;
  mutable text::unused_list unused_;
  element root_;
  readers::sdf::version version_;
  robot_description robot_;
  frame_graph frames_;
  std::vector<part> links_, joints_, other_frames_;
  std::vector<connection> connections_;
  std::vector<part> gearboxes_, drake_elements_, plugins_;
  std::vector<std::pair<std::string, element>> placed_; ///< models with a placement frame, inner ones first
  std::map<std::string, int> link_index_;
  std::set<std::string> joint_names_; ///< of the file
  std::set<int> carried_;
  std::vector<std::string> without_inertia_, incomplete_inertia_, without_weight_;
  std::vector<std::string> with_frame_, with_newer_frame_; ///< what an old file places by another frame, "link hand"
  std::map<std::string, std::vector<std::string>> drake_joints_; ///< what is said of a type: the names of its joints
};

bool is_drake(const element &joint) { return joint.tag() == "drake:joint"; }

bool is_identity(const SE3<double> &X) {
  const SE3<double> one = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  const auto near = [](double x, double y) {
    return std::fabs(x - y) <= 1e-12;
  }; // poses that cancel leave a few roundings
  return std::equal(&X.R.m00, &X.R.m00 + 9, &one.R.m00, near) && std::equal(&X.t.x, &X.t.x + 3, &one.t.x, near);
}

robot_description sdf_reader::read() {
  check_version();
  const pugi::xml_node model = chosen_model();
  robot_.name = name_of(model);
  robot_.file = file_.name();
  if (!file_.guessed_encoding().empty())
    robot_.warnings.push_back(file_.guessed_encoding());
  collect_model(model, "", robot_.name, own_frame);
  for (const auto &[name, at] : placed_) // what an inner model is placed by may place an outer one
    frames_.place_by(name, at.text("placement_frame"), at);

  // link 0 is the world; frames come behind all links, since they are welded to these, and joints behind both
  add_link("world");
  for (const part &link : links_)
    read_link(link);
  for (const part &frame : other_frames_)
    read_frame(frame);
  for (const part &joint : joints_)
    read_joint(joint);
  read_plugins_and_check_unread();
  connect_all();
  read_drake_elements();
  add_floating();
  warn();
  leaders_of(robot_);
  check_tree(robot_);
  warn_of_links(robot_, check_inertias(robot_), options_.strict, "correct these inertias");
  for (std::string &line : readers::mesh_scale_warnings(model))
    robot_.warnings.push_back(std::move(line));
  robot_.unused = unused_.lines();
  return std::move(robot_);
}

void sdf_reader::check_version() {
  const std::string version = root_.text("version");
  for (int minor = 4; minor <= 10; ++minor)
    if (version == "1." + std::to_string(minor)) {
      version_.minor = minor;
      return;
    }
  const std::string said = version.empty() ? "no version" : "version " + quoted(version);
  if (version == "1.11" || version == "1.12")
    robot_.warnings.push_back("SDF " + said + " is newer than 1.10, and read as that");
  else
    root_.refuse("<sdf> has " + said +
                 ", expected 1.4 to 1.10; gz sdf -p FILE writes an older file as the newest version");
}

/// The only model that isn't static, or the one that an option names.
/// Static models are surroundings: a world with one other model has one robot.
pugi::xml_node sdf_reader::chosen_model() {
  root_.expect({"version"}, {"model", "world", "actor", "light"});
  element holder = root_;
  if (const element world = root_.child("world")) {
    holder = world;
    world.expect({"name"}, {"model", "gravity", "physics", "light", "scene", "plugin", "gui", "state", "population",
                            "wind", "atmosphere", "magnetic_field", "spherical_coordinates", "road", "audio", "actor",
                            "frame", "include", "joint"});
    for (const char *tag : {"include", "joint"})
      if (const pugi::xml_node found = world.node().child(tag))
        file_.refuse(
            found,
            "<" + std::string(tag) +
                "> in <world> is not read; put the robot in a <model> of its own (gz sdf -p FILE expands includes)");
    read_gravity(world);
  }
  // a world has surroundings, too, which are static
  std::vector<std::string> names, all;
  pugi::xml_node model;
  for (const pugi::xml_node each : holder.node().children("model")) {
    const bool is_static =
        readers::sdf::flag_in(in_file(each, "model", each.attribute("name").value()), "static", false);
    all.push_back(name_of(each));
    if (options_.model.empty() ? is_static : all.back() != options_.model) {
      unused_.in_robot(is_static ? "model " + all.back() + ", static" : "model " + all.back());
      continue;
    }
    if (is_static)
      file_.refuse(each, "model " + all.back() + " is static, so nothing in it moves; write <static>false</static>");
    model = each;
    names.push_back(all.back());
  }
  if (names.size() == 1)
    return model;
  if (!options_.model.empty())
    root_.refuse("no model " + quoted(options_.model) + " in <" + holder.tag() + ">" +
                 text::suggestion(options_.model, all, all.empty() ? "there is none" : "name one of " + listed(all)));
  if (names.empty())
    root_.refuse("no <model> that moves in <" + holder.tag() + ">; a robot is a <model> with links");
  root_.refuse("several models, " + listed(names) +
               "; say which: --model NAME on the command line, model=\"NAME\" in Python");
}

/// The <gravity> of a world; before SDF 1.6 that of its <physics>.
void sdf_reader::read_gravity(const element &world) {
  element gravity = world.child("gravity");
  for (const pugi::xml_node physics : world.node().children("physics")) {
    const element inside = in_file(physics, "world", world.text("name")).child("gravity");
    if (!inside)
      continue;
    if (!version_.has_gravity_in_physics() || gravity)
      unused_.in_robot("gravity of physics");
    else
      gravity = inside;
  }
  if (!gravity)
    return;
  gravity.expect_text({});
  const auto g = gravity.content_numbers(3, "0 0 -9.81");
  robot_.gravity = {g[0], g[1], g[2]};
}

/// world and __model__ mean frames always; from SDF 1.7 on all of __…__ are reserved, and :: is between scopes.
std::string sdf_reader::name_of(pugi::xml_node node) const {
  std::string name = node.attribute("name").value();
  if (name.empty())
    file_.refuse(node, "<" + std::string(node.name()) + "> has no name; write <" + node.name() + " name=\"...\">");
  const bool has_scope = name.find("::") != name.npos; // programs wrote links of included models so before SDF 1.7
  const bool is_marked = name.size() > 3 && name.substr(0, 2) == "__" && name.substr(name.size() - 2) == "__";
  if (name == "world" || name == own_frame || (!version_.has_old_frames() && (has_scope || is_marked)))
    file_.refuse(node, "<" + std::string(node.name()) + "> is called " + quoted(name) +
                           ", a name that SDF reserves; choose one without ::, without __ around it, and not world");
  return name;
}

/// The pose of a model, link, joint or frame.  Notes frames that programs read in different ways.
readers::sdf::given_pose sdf_reader::pose_of(const element &at) {
  readers::sdf::given_pose pose = readers::sdf::pose_in(at, version_);
  if (version_.has_old_frames() && !pose.relative_to.empty())
    (at.child("pose").has("frame") ? with_frame_ : with_newer_frame_).push_back(at.where().words());
  return pose;
}

/// Adds the frames of a model and of all in it.  The model's own frame is already named, in the scope that it is in.
void sdf_reader::collect_model(pugi::xml_node node, const std::string &scope, const std::string &name,
                               const std::string &full_name) {
  const element model = in_file(node, "model", name);
  check_content(model);
  const bool outermost = full_name == own_frame;
  const std::string inner = outermost ? "" : scope + name + "::";
  if (!outermost && readers::sdf::flag_in(model, "static", false))
    model.refuse("it is static inside of a model that moves; hold its links by fixed joints, whose <parent> is world "
                 "or a link that moves, and remove <static>");
  const auto pose = pose_of(model);
  if (outermost && !pose.relative_to.empty() && pose.relative_to != "world")
    model.refuse("its pose is relative to " + quoted(pose.relative_to) +
                 ", but only world is read here; give the pose in the world");

  // a model's own frame moves with its canonical link: the one that is named, the first, or that of the first model in it
  std::string canonical = node.attribute("canonical_link").value();
  std::vector<pugi::xml_node> parts(node.begin(), node.end());
  if (version_.has_old_frames()) // joints last: a joint gives way to a link of the same name, which others may refer to
    std::stable_partition(parts.begin(), parts.end(),
                          [](const pugi::xml_node &element) { return element.name() != std::string_view("joint"); });
  for (const pugi::xml_node child : parts) {
    const std::string tag = child.name();
    if (tag == "model") {
      const std::string nested = name_of(child);
      collect_model(child, inner, nested, inner + nested + "::" + own_frame);
    } else if (tag == "plugin") {
      plugins_.push_back({inner, "", "", in_file(child, "model", name)});
    } else if (readers::is_drake_element(tag)) {
      text::check_count(file_, child, drake_elements_.size(), text::limits::joints, "joints and force elements");
      drake_elements_.push_back({inner, "", "", in_file(child, "model", name)});
    } else if (tag == "link" || tag == "frame" || tag == "joint" || tag == "drake:joint") {
      const std::string found = collect_part(child, inner);
      if (tag == "link" && canonical.empty())
        canonical = found;
    }
  }
  if (canonical.empty()) // the first nested model moves with it
    if (const pugi::xml_node nested = node.child("model"))
      canonical = nested.attribute("name").value();
  if (canonical.empty())
    model.refuse("no <link> in <model>; a model needs at least one, <link name=\"base\"/> for example");
  frames_.found(inner, canonical, model, "canonical_link");
  // the frame of a nested model is in that of the model around it, unless its pose says otherwise
  const std::string relative_to = outermost ? "world" : pose.relative_to.empty() ? own_frame : pose.relative_to;
  frames_.add(full_name, {scope, relative_to, outermost ? canonical : name + "::" + canonical, pose.pose, model});
  if (node.attribute("placement_frame") && model.text("placement_frame") != own_frame)
    placed_.push_back({full_name, model});
}

/// Adds the frame of a link, joint or frame, and notes it.  Returns its name.
///
///                its pose is in, unless relative_to says     it moves with
///     link       the model's frame                           itself
///     joint      its child                                   its child
///     frame      attached_to, or the model's frame           the same
std::string sdf_reader::collect_part(pugi::xml_node child, const std::string &scope) {
  const std::string tag = child.name(), kind = tag == "drake:joint" ? "joint" : tag;
  std::string name = name_of(child);
  const element at = in_file(child, kind, scope + name);
  const auto pose = pose_of(at);
  std::string usual = own_frame, attached_to, frame = scope + name;
  if (kind == "joint") {
    usual = attached_to = end_of({scope, scope + name, frame, at}, "child");
    if (version_.has_old_frames())
      frame = text::free_name(
          frame, [&](const std::string &other) { return frames_.has(other) && !joint_names_.count(other); });
  } else if (kind == "frame") {
    attached_to = at.text("attached_to").empty() ? own_frame : at.text("attached_to");
    usual = attached_to;
  }
  frames_.add(frame, {scope, pose.relative_to.empty() ? usual : pose.relative_to, attached_to, pose.pose, at});
  if (kind == "joint") {
    text::check_count(file_, child, joints_.size(), text::limits::joints, "joints");
    joint_names_.insert(scope + name);
  } else {
    text::check_count(file_, child, links_.size() + other_frames_.size(), text::limits::links, "links");
  }
  (kind == "link" ? links_ : kind == "joint" ? joints_ : other_frames_).push_back({scope, scope + name, frame, at});
  return name;
}

/// Lists what a model holds and KSL doesn't use.  Refuses what would be links or joints to another reader.
void sdf_reader::check_content(const element &model) {
  model.expect({"name", "canonical_link", "placement_frame"},
               {"link", "joint", "drake:joint", "frame", "model", "pose", "static", "include", "plugin", "gripper",
                "self_collide", "allow_auto_disable", "enable_wind", "drake:ball_constraint",
                "drake:linear_spring_damper"});
  for (const pugi::xml_node child : model.node().children()) {
    const std::string tag = child.name(), local = tag.substr(tag.find(':') == tag.npos ? 0 : tag.find(':') + 1);
    if (tag == "include")
      file_.refuse(child, model.where().words() +
                              ": <include> is not read; gz sdf -p FILE writes the file with everything in it");
    if (local == "joint" && tag != "joint" && tag != "drake:joint")
      file_.refuse(child,
                   model.where().words() + ": <" + tag +
                       "> is a joint that KSL doesn't know; write <joint name=\"...\" type=\"...\">, or <drake:joint>");
    for (const char *known : {"plugin", "gripper", "self_collide", "allow_auto_disable", "enable_wind"})
      if (tag == known)
        unused_.in_robot(tag);
  }
}

int sdf_reader::add_link(const std::string &name) {
  const int index = static_cast<int>(robot_.links.size());
  link_description out;
  out.name = name;
  robot_.links.push_back(std::move(out));
  link_index_.emplace(name, index);
  return index;
}

/// What a link leaves out is 1 kg and 1 kg m² about its origin in SDF, which is told: other formats have nothing there.
void sdf_reader::read_link(const part &link) {
  link.at.expect({"name"}, {"pose", "inertial", "visual", "collision", "gravity", "sensor", "light", "battery",
                            "audio_source", "audio_sink", "particle_emitter", "projector", "enable_wind",
                            "self_collide", "kinematic", "must_be_base_link", "velocity_decay"});
  link_description &out = robot_.links[static_cast<std::size_t>(add_link(link.name))];
  out.at = {link.at.line()};
  for (const pugi::xml_node child : link.at.node().children())
    for (const char *tag : {"sensor", "light", "battery", "audio_source", "audio_sink", "particle_emitter", "projector",
                            "enable_wind", "self_collide", "kinematic", "must_be_base_link", "velocity_decay"})
      if (child.name() == std::string_view(tag))
        unused_.in_link(tag);
  for (const char *tag : {"visual", "collision"})
    if (link.at.node().child(tag)) {
      unused_.in_link(tag);
      out.has_geometry = true;
    }
  if (!readers::sdf::flag_in(link.at, "gravity", true))
    without_weight_.push_back(link.name);
  out.has_inertial = true;
  std::vector<std::string> missing;
  if (const element inertial = link.at.child("inertial")) {
    out.given = readers::sdf::inertia_in(inertial, version_, missing);
    if (inertial.child("fluid_added_mass"))
      unused_.in_link("fluid_added_mass");
    if (!missing.empty())
      incomplete_inertia_.push_back(link.name + " (" + listed(missing) + ")");
  } else {
    out.given = given_inertia{1, {0, 0, 0}, {}, {1, 1, 1, 0, 0, 0}};
    without_inertia_.push_back(link.name);
  }
  out.inertia = given::inertia_of(*out.given);
}

/// A frame is a massless link that is welded to the link it moves with.
void sdf_reader::read_frame(const part &frame) {
  frame.at.expect({"name", "attached_to"}, {"pose"});
  if (version_.has_old_frames() && frame.at.has("attached_to"))
    with_newer_frame_.push_back(frame.at.where().words());
  const std::string link = frames_.link_of(frame.name);
  const SE3<double> pose = frames_.relative(link, frame.name);
  const int parent = link_index_.at(link);
  weld(frame.name + "_joint", parent, add_link(frame.name), pose);
}

int sdf_reader::weld(const std::string &name, int parent, int child, const SE3<double> &pose) {
  joint_description out;
  out.name = free_joint_name(name);
  out.parent = parent, out.child = child;
  out.placement = pose;
  carried_.insert(child);
  robot_.joints.push_back(std::move(out));
  return child;
}

/// A name that no joint of the file has.
std::string sdf_reader::free_joint_name(const std::string &name) const {
  return text::free_name(name, [&](const std::string &other) { return joint_names_.count(other) > 0; });
}

/// The name in <parent> or <child>; in a <drake:joint> also in <drake:parent> or <drake:child>.
std::string sdf_reader::end_of(const part &joint, const char *tag) const {
  std::string name = readers::sdf::text_in(joint.at, tag);
  if (name.empty() && is_drake(joint.at))
    name = readers::sdf::text_in(joint.at, ("drake:" + std::string(tag)).c_str());
  if (name.empty())
    joint.at.refuse("no <" + std::string(tag) + "> with a name in it; add <" + tag + ">...</" + tag + ">");
  return name;
}

joint_kind sdf_reader::kind_of(const element &joint) {
  const std::string type = joint.text("type");
  if (is_drake(joint)) {
    if (type == "planar") {
      drake_joints_
          ["<drake:joint> type planar, an extension of SDF; v is along the child's axes, Drake's along the parent's"]
              .push_back(joint.where().name);
      return joint_kind::planar;
    }
    joint.refuse("<drake:joint> type " + quoted(type) +
                 " is unknown, expected planar; other types are written as <joint>");
  }
  std::vector<std::string> names;
  // revolute2 is two revolute joints in series: a universal joint, whose axes may have any angle here
  for (const auto &[name, kind] : {std::pair{"revolute", joint_kind::revolute},
                                   {"continuous", joint_kind::continuous},
                                   {"prismatic", joint_kind::prismatic},
                                   {"fixed", joint_kind::fixed},
                                   {"ball", joint_kind::spherical},
                                   {"universal", joint_kind::universal},
                                   {"revolute2", joint_kind::universal},
                                   {"screw", joint_kind::helical}}) {
    if (type == name)
      return kind;
    names.push_back(name);
  }
  const std::string known = listed(names, names.size());
  if (type.empty())
    joint.refuse("<joint> has no type; write type=\"...\" with one of " + known);
  joint.refuse("joint type " + quoted(type) + " is unknown, expected one of " + known +
               text::suggestion(type, names, "write one of these"));
}

void sdf_reader::read_joint(const part &joint) {
  const element &at = joint.at;
  at.expect({"name", "type"}, {"parent", "child", "drake:parent", "drake:child", "pose", "axis", "axis2",
                               "screw_thread_pitch", "thread_pitch", "physics", "sensor", "gearbox_ratio",
                               "gearbox_reference_body", "drake:damping", "drake:mimic"});
  if (at.text("type") == "gearbox" && !is_drake(at)) {
    gearboxes_.push_back(joint);
    return;
  }
  joint_description out;
  out.name = joint.name;
  out.at = {at.line()};
  out.kind = kind_of(at);
  for (const char *tag : {"physics", "sensor", "gearbox_ratio", "gearbox_reference_body", "drake:damping"})
    if (at.node().child(tag))
      unused_.in_joint(tag, "not used", out.name);
  read_motion(joint, out);
  read_drake_mimic(joint, out);
  const std::string child = frames_.link_of(joint.frame);
  if (child == "world")
    at.refuse("its child is the world, which can only be a parent; exchange <parent> and <child>");
  const std::string parent = frames_.link_of(frames_.found(joint.scope, end_of(joint, "parent"), at, "<parent>"));
  if (options_.floating_base && parent == "world")
    at.refuse("a floating base is asked for, but this joint connects link " + child +
              " with the world; remove the joint, or don't ask for that");
  connections_.push_back({std::move(out), parent, child, joint.frame});
}

/// Axes, limits and pitch, as the kind needs them.
void sdf_reader::read_motion(const part &joint, joint_description &out) {
  const joint_kind_row row = row_of(out.kind);
  const bool has_axis = row.has_axis && out.kind != joint_kind::planar;
  const auto unless = [&](bool needed, const char *tag) {
    if (!needed && joint.at.node().child(tag))
      unused_.in_joint(tag, "no effect on a " + std::string(row.name) + " joint", out.name);
  };
  unless(has_axis, "axis"), unless(row.has_axis2, "axis2");
  unless(row.has_pitch, "screw_thread_pitch"), unless(row.has_pitch, "thread_pitch");
  if (has_axis)
    out.axis = axis_in(joint, "axis", out.given.axis);
  if (out.kind == joint_kind::planar)
    out.axis = {0, 0, 1};
  if (row.has_axis2)
    out.axis2 = axis_in(joint, "axis2", out.given.axis2);
  if (row.has_pitch)
    out.pitch = pitch_in(joint.at, out.given.pitch);
  for (const char *tag : {"axis", "axis2"})
    if (const element axis = joint.at.child(tag); axis && has_axis) {
      axis.expect({}, {"xyz", "limit", "dynamics", "mimic", "use_parent_model_frame"});
      read_limit(axis, tag == std::string_view("axis2"), out);
      read_dynamics(axis, joint.scope, out);
    }
}

/// The unit vector of an axis in the joint's frame, and the one that the file gives if it is in that frame.
vec3<double> sdf_reader::axis_in(const part &joint, const char *tag, vec3<double> &given) {
  const element axis = joint.at.child(tag);
  const std::string t = "<" + std::string(tag) + ">", example = t + "<xyz>0 0 1</xyz></" + tag + ">";
  if (!axis)
    joint.at.refuse("a " + joint.at.text("type") + " joint needs " + t + "; write " + example + " for example");
  const element xyz = axis.child("xyz");
  if (!xyz)
    axis.refuse(t + " has no <xyz>; write " + example + " for example");
  xyz.expect_text({"expressed_in"});
  const auto n = xyz.content_numbers(3, "0 0 1");
  vec3<double> u = {n[0], n[1], n[2]};
  if (u.x == 0 && u.y == 0 && u.z == 0)
    xyz.refuse("the axis is zero; give the direction of motion, <xyz>0 0 1</xyz> for example");
  const std::string expressed_in = frame_of_axis(axis, xyz);
  if (expressed_in.empty()) {
    given = u;
    return given::direction_of(u);
  }
  // components in the joint's frame: no number of the file is kept
  const mat3x3<double> R =
      frames_.relative(joint.frame, frames_.found(joint.scope, expressed_in, xyz, "expressed_in")).R;
  u = given::direction_of(u);
  return given::direction_of({R.m00 * u.x + R.m01 * u.y + R.m02 * u.z, R.m10 * u.x + R.m11 * u.y + R.m12 * u.z,
                              R.m20 * u.x + R.m21 * u.y + R.m22 * u.z});
}

/// The name of the frame in which an axis is given; empty for the joint's own.
///
///     SDF 1.4              the model's, unless <use_parent_model_frame> is false
///     1.5, 1.6             the joint's, unless that is true
///     from 1.7 on          the joint's, unless expressed_in names another
std::string sdf_reader::frame_of_axis(const element &axis, const element &xyz) {
  const bool has_flag = static_cast<bool>(axis.node().child("use_parent_model_frame"));
  if (has_flag && !version_.has_old_frames())
    axis.refuse("<use_parent_model_frame> was replaced in SDF 1.7; write <xyz expressed_in=\"__model__\">");
  std::string named = xyz.text("expressed_in");
  if (!version_.has_old_frames())
    return named;
  if (!named.empty() && has_flag)
    axis.refuse("it has <use_parent_model_frame> and expressed_in; remove one of them");
  if (!named.empty()) {
    with_newer_frame_.push_back(axis.where().words());
    return named;
  }
  return readers::sdf::flag_in(axis, "use_parent_model_frame", version_.has_axes_in_model()) ? own_frame : "";
}

/// m/rad, positive for a right-handed screw.  <screw_thread_pitch> is metres a revolution, right-handed positive; the older
/// <thread_pitch> is radians a metre, left-handed positive.
double sdf_reader::pitch_in(const element &joint, double &metres_a_revolution) const {
  const std::string mend =
      "write <screw_thread_pitch>0.005</screw_thread_pitch>, the advance along the axis in metres for each revolution";
  const auto pitch = readers::sdf::number_in(joint, "screw_thread_pitch"),
             older = readers::sdf::number_in(joint, "thread_pitch");
  if (pitch) {
    if (older && !(std::fabs(given::pitch_of(*pitch) * *older + 1) <= 1e-3))
      joint.refuse(
          "its <screw_thread_pitch> and <thread_pitch> disagree; remove <thread_pitch>, which is in radians a metre, left-handed positive");
    metres_a_revolution = *pitch;
    return given::pitch_of(*pitch);
  }
  if (!older)
    joint.refuse("a screw joint needs its pitch; " + mend);
  if (*older == 0)
    joint.refuse("its <thread_pitch> is zero, so it would advance without bound; " + mend);
  return -1 / *older;
}

/// <axis> is of number 0, <axis2> of number 1:
///
///     axis      xyz, expressed_in;  limit: lower, upper, effort, velocity;  dynamics: damping, friction, spring_…;  mimic
///
/// Limits of number 0 or 1 of the joint's position.  1e16, or −1 for an effort or a velocity, stands for no limit in older files.
void sdf_reader::read_limit(const element &axis, int number, joint_description &out) {
  const element limit = axis.child("limit");
  if (!limit)
    return;
  const joint_kind_row row = row_of(out.kind);
  limit.expect({}, {"lower", "upper", "effort", "velocity", "stiffness", "dissipation"});
  for (const char *tag : {"stiffness", "dissipation"})
    if (limit.node().child(tag))
      unused_.in_joint("limit " + std::string(tag), "not used", out.name);
  const auto read = [&](const char *tag) {
    const optional_number x = readers::sdf::limit_in(limit, tag);
    return x && std::fabs(*x) >= 1e16 ? std::nullopt : x;
  };
  const auto positive = [](const optional_number &x) { return x && *x < 0 ? std::nullopt : x; };
  if (row.nv == 1)
    out.effort = positive(read("effort")), out.velocity = positive(read("velocity"));
  else if (limit.node().child("effort") || limit.node().child("velocity"))
    unused_.in_joint("limit effort, velocity", "not used on a " + std::string(row.name) + " joint", out.name);
  const optional_number lower = read("lower"), upper = read("upper");
  if (number >= numbers_with_limits(row)) {
    if (lower || upper)
      unused_.in_joint("limit lower, upper", "no effect on a " + std::string(row.name) + " joint", out.name);
    return;
  }
  if (number == 0)
    out.lower = lower, out.upper = upper;
  else
    out.further[0] = {lower, upper};
  if (lower && upper && *lower > *upper)
    limit.refuse("lower limit " + text::shown(*lower) + " is above upper limit " + text::shown(*upper) +
                 "; exchange or correct them");
}

/// position = multiplier × (the other's − reference) + offset; SDF has it since version 1.11.
/// Descriptions have it as multiplier × the other's + (offset − multiplier × reference).
void sdf_reader::read_mimic(const element &mimic, const std::string &scope, joint_description &out) {
  if (options_.mimic_independent)
    return unused_.in_joint("mimic", "the coupling is not applied: each has a coordinate of its own", out.name);
  mimic.expect({"joint", "axis"}, {"multiplier", "offset", "reference"});
  if (mimic.text("joint").empty())
    mimic.refuse("<mimic> names no joint; write <mimic joint=\"...\">");
  const auto read = [&](const char *tag, double otherwise) {
    return readers::sdf::number_in(mimic, tag).value_or(otherwise);
  };
  const double multiplier = read("multiplier", 1);
  out.mimic = {
      scope + mimic.text("joint"), multiplier, read("offset", 0) - multiplier * read("reference", 0), {mimic.line()}};
}

/// Drake's, which is that of URDF.
void sdf_reader::read_drake_mimic(const part &joint, joint_description &out) {
  const element mimic = joint.at.child("drake:mimic");
  if (!mimic)
    return;
  if (options_.mimic_independent)
    return unused_.in_joint("mimic", "the coupling is not applied: each has a coordinate of its own", out.name);
  mimic.expect({"joint", "multiplier", "offset"}, {});
  if (mimic.text("joint").empty())
    mimic.refuse("<drake:mimic> names no joint; write <drake:mimic joint=\"...\" multiplier=\"1\" offset=\"0\"/>");
  if (out.mimic)
    mimic.refuse("it has <mimic> and <drake:mimic>; keep one of both");
  out.mimic = {joint.scope + mimic.text("joint"),
               mimic.number("multiplier").value_or(1),
               mimic.number("offset").value_or(0),
               {mimic.line()}};
}

/// Elements of Drake between two bodies.
void sdf_reader::read_drake_elements() {
  std::set<std::string> taken = joint_names_;
  for (const part &each : drake_elements_)
    readers::add_drake_element(
        each.at,
        [&](const element &child, const std::string &name) {
          return link_index_.at(frames_.link_of(frames_.found(each.scope, name, child, child.tag())));
        },
        !options_.cut_loops, taken, robot_);
}

/// Mimics that plugins state; and what no reader knows is refused where it joins links or couples joints.
void sdf_reader::read_plugins_and_check_unread() {
  const readers::left_out option = {.links = options_.cut_loops, .joints = options_.mimic_independent};
  readers::part_names names; // with the names of nested models around them, and without
  const auto local = [](const std::string &name) {
    return name.substr(name.rfind("::") == name.npos ? 0 : name.rfind("::") + 2);
  };
  std::map<std::string, std::size_t> index;
  for (const auto *parts : {&links_, &other_frames_})
    for (const part &each : *parts)
      for (const std::string &name : {each.name, local(each.name)})
        names.add_link(name, frames_.link_of(each.frame));
  for (std::size_t j = 0; j < connections_.size(); ++j)
    for (const std::string &name : {connections_[j].joint.name, local(connections_[j].joint.name)}) {
      names.add_joint(name);
      index.try_emplace(name, j);
    }
  std::vector<readers::stated_mimic> mimics;
  for (const part &plugin : plugins_)
    if (const auto named = readers::read_plugin(file_, names, plugin.at.node(), option, mimics); !named.empty())
      unused_.in_robot("plugin " + plugin.at.text("name") + " of the simulator, which names " + listed(named));
  for (const readers::stated_mimic &mimic : mimics)
    if (joint_description &follower = connections_[index.at(mimic.follower)].joint; follower.kind == joint_kind::fixed)
      unused_.in_joint("mimic stated elsewhere", "no effect on a fixed joint", follower.name);
    else if (options_.mimic_independent)
      unused_.in_joint("mimic", "the coupling is not applied: each has a coordinate of its own", follower.name);
    else
      readers::follow(file_, mimic, follower, connections_[index.at(mimic.leader)].joint);
  for (const pugi::xml_node node : unused_.elements)
    readers::refuse_if_joining(file_, names, node, option);
  for (const auto &[node, attribute] : unused_.attributes)
    if (node.name() == std::string_view("joint") || node.name() == std::string_view("drake:joint"))
      readers::refuse_if_joining(file_, names, node, attribute, option);
}

/// Springs are of joints with one coordinate.  A joint has one damping and one friction for all coordinates: of two axes they hold where they are
/// equal.
void sdf_reader::read_dynamics(const element &axis, const std::string &scope, joint_description &out) {
  if (const element mimic = axis.child("mimic"))
    read_mimic(mimic, scope, out);
  const element dynamics = axis.child("dynamics");
  if (!dynamics && axis.tag() == "axis")
    return;
  dynamics.expect({}, {"damping", "friction", "spring_reference", "spring_stiffness"});
  const auto read = [&](const char *tag) { return dynamics ? readers::sdf::number_in(dynamics, tag).value_or(0) : 0; };
  const double damping = read("damping"), friction = read("friction"), stiffness = read("spring_stiffness");
  if (row_of(out.kind).nv == 1) {
    out.damping = damping, out.friction = friction;
    out.spring_stiffness = stiffness, out.spring_rest = read("spring_reference");
    return;
  }
  // of two axes: a joint has one number for all its coordinates
  if (stiffness != 0)
    unused_.in_joint("spring_stiffness", "only joints with one coordinate have springs", out.name);
  if (axis.tag() == "axis") {
    out.damping = damping, out.friction = friction;
  } else if (damping != out.damping || friction != out.friction) {
    unused_.in_joint("dynamics", "not used, since those of its axes differ", out.name);
    out.damping = out.friction = 0;
  }
}

/// The joint by which a link turns on the reference body of a gearbox.
const sdf_reader::connection &sdf_reader::turning_on(const part &gearbox, const std::string &reference,
                                                     const std::string &link, const std::vector<bool> &in_tree) const {
  for (std::size_t j = 0; j < connections_.size(); ++j)
    if (const joint_kind kind = connections_[j].joint.kind;
        in_tree[j] && connections_[j].parent == reference && connections_[j].child == link &&
        (kind == joint_kind::revolute || kind == joint_kind::continuous))
      return connections_[j];
  gearbox.at.refuse("it couples links that turn on " + reference + ", its <gearbox_reference_body>, but " + link +
                    " does not: no revolute joint has " + reference + " as <parent> and " + link +
                    " as <child>; add one, or couple joints by <mimic> in <axis>");
}

/// 1 or −1: whether the gearbox counts the angle of a joint in the joint's own direction.
/// The sign of R own · axis, R leading from the gearbox's frame to that of the joint.
double sdf_reader::sense_of(const part &gearbox, const char *tag, const connection &turning) {
  vec3<double> ignored{};
  const vec3<double> own = axis_in(gearbox, tag, ignored), &axis = turning.joint.axis;
  gearbox.at.child(tag).expect({}, {"xyz", "limit", "dynamics", "use_parent_model_frame"});
  for (const char *inside : {"limit", "dynamics"})
    if (gearbox.at.child(tag).node().child(inside))
      unused_.in_joint(inside, "not used on a gearbox; the joints that it couples have their own", gearbox.name);
  const mat3x3<double> R = frames_.relative(turning.frame, gearbox.frame).R;
  const double along = axis.x * (R.m00 * own.x + R.m01 * own.y + R.m02 * own.z) +
                       axis.y * (R.m10 * own.x + R.m11 * own.y + R.m12 * own.z) +
                       axis.z * (R.m20 * own.x + R.m21 * own.y + R.m22 * own.z);
  if (std::fabs(along) < 1 - 1e-6)
    gearbox.at.refuse("its <" + std::string(tag) + "> is not parallel to the axis of joint " + turning.joint.name +
                      ", whose angle it couples; give both the same direction");
  return along < 0 ? -1 : 1;
}

/// A gearbox holds no link.  With θ₁ and θ₂ the angles from the reference body to the parent about <axis>, and to the child about <axis2>,
/// θ₂ = −ratio θ₁, as SDF states it: the joint of the child mimics that of the parent.
///
///     reference ─┬─ revolute, θ₁ ── parent          own axes of the gearbox count θ₁ and θ₂; joints may turn the other way (sense_of), so that
///                └─ revolute, θ₂ ── child           q₂ = −ratio s₁ s₂ q₁
void sdf_reader::couple(const part &gearbox, const std::vector<bool> &in_tree) {
  const element &at = gearbox.at;
  for (const char *tag : {"physics", "sensor"})
    if (at.node().child(tag))
      unused_.in_joint(tag, "not used", gearbox.name);
  if (options_.mimic_independent)
    return unused_.in_joint("gearbox", "the coupling is not applied: each has a coordinate of its own", gearbox.name);
  if (readers::sdf::text_in(at, "gearbox_reference_body").empty())
    at.refuse("a gearbox has no <gearbox_reference_body>; name the link that its gears turn on");
  const auto link = [&](const std::string &name, const char *tag) {
    return frames_.link_of(frames_.found(gearbox.scope, name, at, tag));
  };
  const std::string reference = link(readers::sdf::text_in(at, "gearbox_reference_body"), "<gearbox_reference_body>");
  const connection &of_parent = turning_on(gearbox, reference, link(end_of(gearbox, "parent"), "<parent>"), in_tree),
                   &of_child = turning_on(gearbox, reference, link(end_of(gearbox, "child"), "<child>"), in_tree);
  const double stated = readers::sdf::number_in(at, "gearbox_ratio").value_or(1);
  if (stated == 0)
    at.refuse("its <gearbox_ratio> is 0, so that the child would not turn; give the angle of the child for one of the "
              "parent's, or make the child's joint fixed");
  const double ratio = stated * sense_of(gearbox, "axis", of_parent) * sense_of(gearbox, "axis2", of_child);
  joint_description &follower = connections_[static_cast<std::size_t>(&of_child - connections_.data())].joint;
  if (follower.mimic)
    at.refuse("joint " + follower.name + " follows joint " + follower.mimic->joint + " already; keep one of both");
  follower.mimic = {of_parent.joint.name, -ratio, 0, {at.line()}};
}

/// An SDF model is a graph: joints that its tree doesn't need close loops.
void sdf_reader::connect_all() {
  std::vector<std::pair<int, int>> ends;
  for (const connection &each : connections_)
    ends.emplace_back(link_index_.at(each.parent), link_index_.at(each.child));
  // Roots are the world, link 0, and links that no joint carries, which then float on it (add_floating); a cycle that no root leads to is refused by
  // check_tree.
  const std::vector<bool> in_tree = spanning_tree(robot_.links.size(), ends);
  for (const part &gearbox : gearboxes_)
    couple(gearbox, in_tree);
  for (std::size_t j = 0; j < connections_.size(); ++j) {
    connection &each = connections_[j];
    if (in_tree[j])
      connect(std::move(each.joint), each.parent, each.child, each.frame);
    else if (!options_.cut_loops)
      close_loop(each.joint, each.parent, each.child, each.frame);
  }
}

/// The frames of both sides coincide where the links are as the file places them.
void sdf_reader::close_loop(const joint_description &joint, const std::string &parent, const std::string &child,
                            const std::string &frame) {
  for (const std::string &lost : lost_in_loop(joint))
    unused_.in_joint(lost, "not used, since the joint closes a loop", joint.name);
  loop_description loop = as_loop(joint);
  loop.predecessor = link_index_.at(parent), loop.successor = link_index_.at(child);
  loop.predecessor_pose = frames_.relative(parent, frame);
  loop.successor_pose = frames_.relative(child, frame);
  robot_.loops.push_back(std::move(loop));
}

/// Adds a joint between two links.  Where its frame is not that of its child, it carries a massless link at its frame, and the child
/// is welded to that.
///
///     parent ──placement──→ [joint] child                                     the joint's frame is the child's
///     parent ──placement──→ [joint] NAME_frame ──pose, welded──→ child        otherwise
void sdf_reader::connect(joint_description joint, const std::string &parent, const std::string &child,
                         const std::string &frame) {
  const int parent_index = link_index_.at(parent), child_index = link_index_.at(child);
  const SE3<double> in_child = frames_.relative(child, frame);
  const bool at_child = is_identity(in_child);
  joint.parent = parent_index;
  joint.placement = frames_.relative(parent, at_child ? child : frame);
  if (at_child) {
    joint.child = child_index;
    carried_.insert(child_index);
    robot_.joints.push_back(std::move(joint));
    return;
  }
  const std::string name =
      text::free_name(joint.name + "_frame", [&](const std::string &other) { return link_index_.count(other) > 0; });
  joint.child = add_link(name);
  const int carrier = joint.child;
  carried_.insert(carrier);
  robot_.joints.push_back(std::move(joint));
  weld(name + "_joint", carrier, child_index, frames_.relative(frame, child));
}

/// Links that no joint carries are free.
void sdf_reader::add_floating() {
  std::vector<std::string> free;
  for (const part &link : links_)
    if (!carried_.count(link_index_.at(link.name)))
      free.push_back(link.name);
  // if there is one only, it is named as floating bases are elsewhere
  for (const std::string &name : free) {
    joint_description out;
    out.kind = joint_kind::floating;
    out.name = free_joint_name(free.size() == 1 ? "floating_base" : name + "_floating");
    out.parent = 0, out.child = link_index_.at(name);
    out.placement = frames_.relative("world", name);
    robot_.joints.push_back(std::move(out));
  }
}

void sdf_reader::warn() {
  std::vector<std::string> lines;
  if (!without_inertia_.empty())
    lines.push_back(
        text::printable("link " + listed(without_inertia_) +
                        ": no <inertial>, which means 1 kg and 1 kg m² in SDF; write the mass that it has"));
  if (!incomplete_inertia_.empty())
    lines.push_back(text::printable("link " + listed(incomplete_inertia_) +
                                    ": missing in <inertial>, which means 1 kg or 1 kg m² in SDF; write the number"));
  warn_of_links(robot_, lines, options_.strict, "write these inertias");
  if (!without_weight_.empty())
    robot_.warnings.push_back(
        text::printable("link " + listed(without_weight_) + ": <gravity> is false, but gravity acts on all links"));
  if (!with_frame_.empty())
    robot_.warnings.push_back(text::printable(
        listed(with_frame_) +
        ": <pose frame=\"...\"> is read as relative_to, as gz sdf -p writes it; programs of the time of SDF 1." +
        std::to_string(version_.minor) + " may ignore it"));
  if (!with_newer_frame_.empty())
    robot_.warnings.push_back(text::printable(
        listed(with_newer_frame_) +
        ": relative_to, expressed_in and attached_to came with SDF 1.7, and are read as there; write version=\"1.7\""));
  for (const auto &[what, joints] : drake_joints_)
    robot_.warnings.push_back(text::printable("joint " + listed(joints) + ": " + what));
}

} // namespace

robot_description read_sdf(const text::xml_file &file, const read_options &options) {
  return sdf_reader(file, options).read();
}

} // namespace ksl
