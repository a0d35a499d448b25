// Writes descriptions as URDF: the numbers that were read, where they still give the description's, otherwise such that
// reading them gives the description's to rounding.
//
// Files and descriptions have different numbers: angles and matrices, axes of any length and unit vectors, moments about the centroid and about the
// origin.  A description keeps those of the file, `given`, which are written as long as they still make the description's numbers bit by bit.
// Otherwise:
//
//     rotation      roll, pitch, yaw by arctangents, exact to rounding        angles_of
//     inertia       moments about the centroid, in the link's axes            inertia_as_given
//     axis          the unit vector                                           axis_as_given
//     pitch         metres a revolution, one that divides to the same bits    pitch_as_given
//
// Decimal numbers are the shortest that are read as the same double.  What URDF can't say, gravity and a floating root, stands in comments.
#include "ksl/urdf.hpp"

#include "description/parts/given.hpp"
#include "description/parts/joint_numbers.hpp"
#include "description/structure/loops.hpp"
#include "ksl/engine/model/joints.hpp"
#include "text/whole_file.hpp"
#include "text/words.hpp"

#include <pugixml.hpp>

#include <charconv>
#include <cmath>
#include <new>
#include <tuple>
#include <utility>

namespace ksl {

namespace {

/// The shortest decimal numbers that are read as these doubles.
std::string words(std::initializer_list<double> numbers) {
  std::string text;
  for (const double x : numbers) {
    char digits[40];
    text += (text.empty() ? "" : " ") + std::string(digits, std::to_chars(digits, digits + sizeof digits, x).ptr);
  }
  return text;
}
std::string words(const vec3<double> &v) { return words({v.x, v.y, v.z}); }

bool same(const vec3<double> &a, const vec3<double> &b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
bool same(const mat3x3<double> &A, const mat3x3<double> &B) { return std::equal(&A.m00, &A.m00 + 9, &B.m00); }
bool same(const spatial_inertia<double> &a, const spatial_inertia<double> &b) {
  return a.m == b.m && same(a.h, b.h) && a.Ixx == b.Ixx && a.Iyy == b.Iyy && a.Izz == b.Izz && a.Ixy == b.Ixy &&
         a.Iyz == b.Iyz && a.Izx == b.Izx;
}
bool is_zero(const vec3<double> &v) { return same(v, {0, 0, 0}); }
bool has_minus(const vec3<double> &v) { return std::signbit(v.x) || std::signbit(v.y) || std::signbit(v.z); }

/// Roll, pitch, yaw of a rotation.  Yaw is found first, and the others in axes turned back by it, so that the product
/// is accurate even where pitch is a right angle.
///
///     Rz(−yaw) R = Ry(pitch) Rx(roll) = [  cp  sp sr  sp cr ]
///                                       [  0    cr     −sr  ]
///                                       [ −sp  cp sr  cp cr ]
given_rotation angles_of(const mat3x3<double> &R) {
  const double yaw = std::atan2(R.m10, R.m00), c = std::cos(yaw), s = std::sin(yaw);
  const double pitch = std::atan2(-R.m20, c * R.m00 + s * R.m10);
  const double roll = std::atan2(s * R.m02 - c * R.m12, c * R.m11 - s * R.m01);
  return {given_rotation::rpy, {roll, pitch, yaw}};
}

/// The rotation in the numbers that were given, if these still give this rotation.
given_rotation rotation_as_given(const mat3x3<double> &R, const given_rotation &given) {
  if (same(given::rotation_of(given), R))
    return given;
  return same(given::rotation_of({}), R) ? given_rotation{} : angles_of(R);
}

given_inertia inertia_as_given(const link_description &link) {
  const spatial_inertia<double> &I = link.inertia;
  if (link.given && same(given::inertia_of(*link.given), I))
    return *link.given;
  if (I.m == 0)
    return {0, {0, 0, 0}, {}, {I.Ixx, I.Iyy, I.Izz, I.Ixy, I.Iyz, I.Izx}};
  // back to the centroid: I_o − m (c·c 1 − c cᵀ)
  const vec3<double> &h = I.h, c = {h.x / I.m, h.y / I.m, h.z / I.m};
  return {I.m,
          c,
          {},
          {I.Ixx - (h.y * c.y + h.z * c.z), I.Iyy - (h.z * c.z + h.x * c.x), I.Izz - (h.x * c.x + h.y * c.y),
           I.Ixy + h.x * c.y, I.Iyz + h.y * c.z, I.Izx + h.z * c.x}};
}

vec3<double> axis_as_given(const vec3<double> &axis, const vec3<double> &given) {
  return !is_zero(given) && same(given::direction_of(given), axis) ? given : axis;
}

/// Metres a revolution that are read as this pitch, if there are any.
double pitch_as_given(double pitch, double given) {
  if (given::pitch_of(given) == pitch)
    return given;
  // 2π times the pitch, divided by 2π, may round to a neighbour of it: one of the next numbers may not
  const double near = pitch * 6.283185307179586;
  for (const double p : {near, std::nextafter(near, 0.0), std::nextafter(near, 2 * near)})
    if (given::pitch_of(p) == pitch)
      return p;
  return near;
}

/// If memory runs out, pugixml adds nothing and returns null.
pugi::xml_node added(pugi::xml_node node) {
  if (!node)
    throw std::bad_alloc();
  return node;
}
void require_added(bool is_added) {
  if (!is_added)
    throw std::bad_alloc();
}

/// A string in memory.  A stream would swallow the exception where memory runs out.
struct string_writer : pugi::xml_writer {
  std::string text;
  void write(const void *bytes, std::size_t n) override { text.append(static_cast<const char *>(bytes), n); }
};

class urdf_writer {
public:
  explicit urdf_writer(const robot_description &robot) : robot_(robot) {}

  std::string text() {
    set(added(document_.append_child(pugi::node_declaration)), "version", "1.0");
    root_ = added(document_.append_child("robot"));
    set(root_, "name", robot_.name);
    if (has_quaternions())
      set(root_, "version", "1.1");
    write_losses();
    std::vector<bool> is_rotor(robot_.links.size(), false); // a reader makes it from the numbers of its joint
    for (const joint_description &joint : robot_.joints)
      if (joint.is_rotor && joint.mimic)
        is_rotor[static_cast<std::size_t>(joint.child)] = true;
    for (std::size_t l = 0; l < robot_.links.size(); ++l)
      if (!is_rotor[l])
        write_link(robot_.links[l]);
    for (const joint_description &joint : robot_.joints)
      if (!is_rotor[static_cast<std::size_t>(joint.child)])
        write_joint(joint);
    for (const loop_description &loop : robot_.loops)
      write_loop(loop);
    for (const force_element_description &of : robot_.force_elements)
      write_force_element(of);
    if (!robot_.loops.empty())
      for (const std::string &joint : robot_.drives.value_or(std::vector<std::string>()))
        if (!robot_.floating_base || joint != floating_base_name(robot_)) // which a file doesn't have
          write_drive(joint);
    string_writer out;
    document_.save(out, "  ", pugi::format_default, pugi::encoding_utf8);
    return out.text;
  }

private:
  static void set(pugi::xml_node node, const char *attribute, const std::string &value) {
    require_added(node.append_attribute(attribute).set_value(value.c_str()));
  }

  /// Are there quaternions, which came with URDF 1.1?
  bool has_quaternions() const {
    const auto is_one = [](const given_rotation &r) { return r.by == given_rotation::quaternion; };
    for (const link_description &link : robot_.links)
      if (link.has_inertial && is_one(inertia_as_given(link).axes))
        return true;
    for (const joint_description &joint : robot_.joints)
      if (is_one(rotation_as_given(joint.placement.R, joint.given.rotation)))
        return true;
    for (const loop_description &loop : robot_.loops)
      if (is_one(rotation_as_given(loop.predecessor_pose.R, loop.given.predecessor)) ||
          is_one(rotation_as_given(loop.successor_pose.R, loop.given.successor)))
        return true;
    return false;
  }

  /// Lists in a comment what the text doesn't contain.
  void write_losses() {
    if (robot_.floating_base)
      comment("the root floats");
    if (robot_.gravity != robot_description().gravity)
      comment("gravity " + words({robot_.gravity[0], robot_.gravity[1], robot_.gravity[2]}));
    for (const std::string &line : robot_.unused)
      if (line.find("read, not applied") == line.npos)
        comment("not written: " + line);
  }
  void comment(const std::string &words) {
    require_added(root_.append_child(pugi::node_comment).set_value((" " + words + " ").c_str()));
  }

  void write_origin(pugi::xml_node parent, const vec3<double> &t, const given_rotation &rotation,
                    const char *tag = "origin") {
    if (is_zero(t) && !has_minus(t) && rotation.by == given_rotation::none) // −0 is written: readers take 0 without it
      return;
    pugi::xml_node origin = added(parent.append_child(tag));
    const auto &[a, b, c, d] = rotation.numbers;
    set(origin, "xyz", words(t));
    if (rotation.by == given_rotation::rpy)
      set(origin, "rpy", words({a, b, c}));
    if (rotation.by == given_rotation::quaternion)
      set(origin, "quat_xyzw", words({a, b, c, d}));
  }

  void write_link(const link_description &link) {
    pugi::xml_node node = added(root_.append_child("link"));
    set(node, "name", link.name);
    if (!link.has_inertial)
      return;
    const given_inertia given = inertia_as_given(link);
    pugi::xml_node inertial = added(node.append_child("inertial"));
    write_origin(inertial, given.center_of_mass, given.axes);
    set(added(inertial.append_child("mass")), "value", words({given.mass}));
    pugi::xml_node inertia = added(inertial.append_child("inertia"));
    const auto &[xx, yy, zz, xy, yz, zx] = given.moments;
    const std::pair<const char *, double> elements[] = {{"ixx", xx}, {"ixy", xy}, {"ixz", zx},
                                                        {"iyy", yy}, {"iyz", yz}, {"izz", zz}};
    for (const auto &[name, moment] : elements)
      set(inertia, name, words({moment}));
  }

  /// Numbers are left out where a reader takes the same without them: 0, a gear ratio of 1, limits that a joint hasn't.
  void write_joint(const joint_description &joint) {
    const joint_kind_row row = row_of(joint.kind);
    pugi::xml_node node = added(root_.append_child("joint"));
    set(node, "name", joint.name);
    set(node, "type", row.name);
    write_origin(node, joint.placement.t, rotation_as_given(joint.placement.R, joint.given.rotation));
    set(added(node.append_child("parent")), "link", robot_.links[static_cast<std::size_t>(joint.parent)].name);
    set(added(node.append_child("child")), "link", robot_.links[static_cast<std::size_t>(joint.child)].name);
    if (row.has_axis)
      set(added(node.append_child("axis")), "xyz", words(axis_as_given(axis_of(joint), joint.given.axis)));
    if (row.has_axis2)
      set(added(node.append_child("axis2")), "xyz", words(axis_as_given(joint.axis2, joint.given.axis2)));
    if (row.has_pitch)
      set(added(node.append_child("screw_thread_pitch")), "value",
          words({pitch_as_given(joint.pitch.value_or(0), joint.given.pitch)}));
    if (row.nv == 1)
      write_numbers(
          node, "limit",
          {{"lower", joint.lower}, {"upper", joint.upper}, {"effort", joint.effort}, {"velocity", joint.velocity}});
    for (int c = 0; row.nv > 1 && c < numbers_with_limits(row); ++c)
      write_numbers(node, ("limit" + std::to_string(c + 1)).c_str(),
                    {{"lower", limits_of(joint, c).lower}, {"upper", limits_of(joint, c).upper}});
    if (joint.mimic) {
      pugi::xml_node mimic = added(node.append_child("mimic"));
      set(mimic, "joint", joint.mimic->joint);
      set(mimic, "multiplier", words({joint.mimic->multiplier}));
      set(mimic, "offset", words({joint.mimic->offset}));
    }
    const auto unless_zero = [](double x) { return x == 0 ? std::nullopt : optional_number(x); };
    write_numbers(node, "dynamics",
                  {{"damping", unless_zero(joint.damping)},
                   {"friction", unless_zero(joint.friction)},
                   {"friction_width", joint.friction_width},
                   {"armature", unless_zero(joint.armature)},
                   {"rotor_inertia", unless_zero(joint.rotor_inertia)},
                   {"gear_ratio", joint.gear_ratio == 1 ? std::nullopt : optional_number(joint.gear_ratio)},
                   {"spring_stiffness", unless_zero(joint.spring_stiffness)},
                   {"spring_reference", unless_zero(joint.spring_rest)}});
  }

  /// Both sides have the same components of its axes.
  void write_loop(const loop_description &loop) {
    const joint_kind_row row = row_of(loop.kind);
    pugi::xml_node node = added(root_.append_child("constraint"));
    set(node, "name", loop.name);
    set(node, "type", row.name);
    const auto write_side = [&](const std::string &side, int link, const SE3<double> &pose,
                                const given_rotation &given) {
      set(added(node.append_child(side.c_str())), "link", robot_.links[static_cast<std::size_t>(link)].name);
      write_origin(node, pose.t, rotation_as_given(pose.R, given), (side + "_origin").c_str());
      if (row.has_axis)
        set(added(node.append_child((side + "_axis").c_str())), "xyz",
            words(axis_as_given(axis_of(as_tree_joint(loop)), loop.given.axis)));
      if (row.has_axis2)
        set(added(node.append_child((side + "_axis2").c_str())), "xyz",
            words(axis_as_given(loop.axis2, loop.given.axis2)));
    };
    write_side("parent", loop.predecessor, loop.predecessor_pose, loop.given.predecessor);
    write_side("child", loop.successor, loop.successor_pose, loop.given.successor);
    if (row.has_pitch)
      set(added(node.append_child("screw_thread_pitch")), "value",
          words({pitch_as_given(loop.pitch.value_or(0), loop.given.pitch)}));
  }

  void write_force_element(const force_element_description &of) {
    pugi::xml_node node = added(root_.append_child("force_element"));
    set(node, "name", of.name);
    const force_element_numbers &x = of.numbers;
    for (const auto &[name, value] : {std::pair{"stiffness", x.stiffness},
                                      {"free_length", x.free_length},
                                      {"damping", x.damping},
                                      {"preload", x.preload},
                                      {"stop_stiffness", x.stop_stiffness}})
      if (value != 0)
        set(node, name, words({value}));
    for (const auto &[name, value] : {std::pair{"lower", x.lower}, {"upper", x.upper}})
      if (value)
        set(node, name, words({*value}));
    for (const auto &[tag, link, p] : {std::tuple{"link1", of.link1, of.point1}, {"link2", of.link2, of.point2}}) {
      pugi::xml_node end = added(node.append_child(tag));
      set(end, "link", robot_.links[static_cast<std::size_t>(link)].name);
      set(end, "xyz", words({p.x, p.y, p.z}));
    }
  }

  /// That a joint has a motor, as the reader looks for it; others refuse a transmission without a type.
  void write_drive(const std::string &joint) {
    pugi::xml_node node = added(root_.append_child("transmission"));
    set(node, "name", joint + "_transmission");
    added(node.append_child("type")).text().set("transmission_interface/SimpleTransmission");
    set(added(node.append_child("joint")), "name", joint);
    set(added(node.append_child("actuator")), "name", joint + "_motor");
  }

  /// An element with those attributes that have a number; none if none has.
  static void write_numbers(pugi::xml_node parent, const char *tag,
                            std::initializer_list<std::pair<const char *, optional_number>> attributes) {
    pugi::xml_node node;
    for (const auto &[name, value] : attributes) {
      if (!value)
        continue;
      if (!node)
        node = added(parent.append_child(tag));
      set(node, name, words({*value}));
    }
  }

  const robot_description &robot_;
  pugi::xml_document document_;
  pugi::xml_node root_;
};

} // namespace

std::string urdf_text(const robot_description &robot) { return urdf_writer(robot).text(); }

void write_urdf(const robot_description &robot, const std::string &path) {
  if (!text::write_whole_file(path, urdf_text(robot)))
    text::refuse(path, 0, "the robot can't be written there; give a file in a folder that can be written");
}

} // namespace ksl
