// The builder: links and joints as a program gives them, checked as they come.
//
//     at once              names, numbers, axes, limits, physics; the links of a joint are there
//     description()        the tree, loops and drives, leaders of mimic joints, inertias
//     build(), model_of    masses of links that move, with payloads
#include "ksl/builder.hpp"

#include "description/structure/check.hpp"
#include "description/parts/given.hpp"
#include "description/structure/mimic.hpp"
#include "description/parts/rigid_pose.hpp"
#include "description/parts/items.hpp"
#include "ksl/surgery.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace ksl {

namespace {

using surgery::refuse;
using text::quoted;
using text::shown;

bool finite(const vec3<double> &x) { return std::isfinite(x.x) && std::isfinite(x.y) && std::isfinite(x.z); }

/// Refuses a name that is empty or known already, or that can't be an attribute of a file, to which the model may be written.
template <class Map> void check_name(const std::string &name, const std::string &kind, const Map &known) {
  if (name.empty())
    refuse("a " + kind + " has no name; give it one");
  if (text::printable(name) != name)
    refuse(kind + " " + quoted(name) + ": its name has a control character, or is not UTF-8; give it another name");
  if (known.count(name))
    refuse("a second " + kind + " is named " + quoted(name) + "; rename one of them");
}

/// Refuses a mass that is negative and a matrix that is no inertia.  If moments violate the triangle inequality, so that no body can
/// have them, that is a warning of the whole robot, as it is in a file.
void check_mass(const std::string &name, const link_mass &of) {
  const std::string who = "link " + name + ": ";
  const mat3x3<double> &I = of.inertia;
  const double all[] = {of.mass, I.m00, I.m10, I.m20, I.m01, I.m11, I.m21, I.m02, I.m12, I.m22};
  if (!std::all_of(std::begin(all), std::end(all), [](double x) { return std::isfinite(x); }) ||
      !finite(of.center_of_mass))
    refuse(who + "its mass, its centre of mass or its inertia is not finite; mend its numbers");
  if (of.mass < 0)
    refuse(who + "its mass is " + shown(of.mass) + ", negative; a mass is zero or more, in kg");
  double largest = 0;
  for (const double *x = all + 1; x != std::end(all); ++x)
    largest = std::max(largest, std::fabs(*x));
  const double skew = std::max({std::fabs(I.m01 - I.m10), std::fabs(I.m02 - I.m20), std::fabs(I.m12 - I.m21)});
  if (skew > 1e-6 * largest)
    refuse(who + "its inertia is not symmetric, two elements differ by " + shown(skew) +
           "; give Ixy = Iyx, Ixz = Izx, Iyz = Izy");
  // of a mass of 1 with its centre in the origin, so that no share of the mass is taken off the matrix
  const double least = principal_moments({1, {0, 0, 0}, I.m00, I.m11, I.m22, I.m01, I.m12, I.m02})[0];
  if (least < -1e-6 * largest)
    refuse(who +
           "its inertia about the centre of mass is not positive semidefinite, its smallest principal moment is " +
           shown(least) + "; give the inertia about the centre of mass, with off-diagonal elements −∫xy dm");
}

/// Must the kind's first axis be given?  The normal of a planar joint may be left out, and is z then.
bool needs_axis(const joint_kind_row &row) { return row.has_axis && row.nv < 3; }

/// The axis that is given, or zero if it is left out.  Refuses an axis that the kind doesn't have, and a missing one that it needs.
/// Axes may have any length, which is kept beside the unit vector (given), so that a file that is written has the program's numbers.
vec3<double> checked_axis(const std::string &who, const joint_kind_row &row, const char *what, bool has, bool needs,
                          const std::optional<vec3<double>> &axis) {
  if (axis && !has)
    refuse(who + "a " + row.name + " joint has no " + what + "; leave it out");
  if (!axis) {
    if (needs)
      refuse(who + "a " + row.name + " joint needs an " + what +
             ", a vector in the joint's frame, (0, 0, 1) for example");
    return {0, 0, 0};
  }
  if (!finite(*axis))
    refuse(who + "its " + what + " is not finite; mend its numbers");
  if (axis->x == 0 && axis->y == 0 && axis->z == 0)
    refuse(who + "its " + what + " is zero; give the direction of motion, (0, 0, 1) for example");
  return *axis;
}

/// Copies the limits that the kind can have, and refuses others.  An infinite limit counts as none.
void set_limits(const std::string &who, const joint_kind_row &row, const joint_options &from, joint_description &to) {
  //     number of q    0              1, 2                     how many a kind has: numbers_with_limits
  //     limits         lower, upper   further[0], further[1]
  const auto check = [&](const std::string &what, const optional_number &x, bool may_have) {
    if (!x)
      return;
    if (std::isnan(*x))
      refuse(who + "its " + what + " is not a number; mend it, or leave it out");
    if (!may_have)
      refuse(who + "a " + row.name + " joint has no " + what + "; leave it out");
  };
  const int numbers = numbers_with_limits(row);
  for (int c = 0; c < 3; ++c) {
    const auto [lower, upper] =
        c == 0 ? coordinate_limits{from.lower, from.upper} : from.further[static_cast<std::size_t>(c - 1)];
    const std::string which = c > 0 || numbers > 1 ? " of number " + std::to_string(c + 1) + " of its position" : "";
    check("lower limit" + which, lower, c < numbers);
    check("upper limit" + which, upper, c < numbers);
    if ((lower && *lower == std::numeric_limits<double>::infinity()) ||
        (upper && *upper == -std::numeric_limits<double>::infinity()))
      refuse(who + "limits" + which + " from " + shown(lower.value_or(-INFINITY)) + " to " +
             shown(upper.value_or(INFINITY)) + " leave no position; correct them");
    if (lower && upper && *lower > *upper)
      refuse(who + (which.empty() ? "" : "limits" + which + ": ") + "lower limit " + shown(*lower) +
             " is above upper limit " + shown(*upper) + "; exchange or correct them");
  }
  check("effort limit", from.effort, row.nv == 1);
  check("velocity limit", from.velocity, row.nv == 1);
  for (const optional_number &magnitude : {from.effort, from.velocity})
    if (magnitude && *magnitude < 0)
      refuse(who + "its effort or velocity limit is " + shown(*magnitude) +
             "; it is one of magnitudes, and not negative");
  const auto finite_or_none = [](const optional_number &x) { return x && std::isfinite(*x) ? x : std::nullopt; };
  to.lower = finite_or_none(from.lower), to.upper = finite_or_none(from.upper);
  for (std::size_t c = 0; c < 2; ++c)
    to.further[c] = {finite_or_none(from.further[c].lower), finite_or_none(from.further[c].upper)};
  to.effort = finite_or_none(from.effort), to.velocity = finite_or_none(from.velocity);
}

/// Copies damping, friction, rotor and spring, and refuses those that the kind can't have.
void set_physics(const std::string &who, const joint_kind_row &row, const joint_options &from, joint_description &to) {
  for (const double x : {from.damping, from.friction, from.armature, from.rotor_inertia, from.spring_stiffness})
    if (!(x >= 0 && std::isfinite(x)))
      refuse(who + "its damping, friction, armature, rotor inertia or stiffness is " + shown(x) +
             "; a finite number that is not negative is expected");
  if (!finite({from.gear_ratio, from.spring_rest, 0}) ||
      (from.friction_width && !(*from.friction_width > 0 && std::isfinite(*from.friction_width))))
    refuse(who + "gear ratio and rest position must be finite, and a width of friction positive; correct them");
  if (row.nv == 0 && (from.damping != 0 || from.friction != 0 || from.armature != 0 || from.rotor_inertia != 0))
    refuse(who + "a " + row.name + " joint has neither damping nor friction, nor a drive; leave them out");
  if (row.nv != 1 && from.spring_stiffness != 0)
    refuse(who + "only joints with one coordinate have springs, and a " + row.name +
           " joint hasn't one; leave its stiffness out");
  to.damping = from.damping, to.friction = from.friction, to.friction_width = from.friction_width;
  to.armature = from.armature, to.rotor_inertia = from.rotor_inertia, to.gear_ratio = from.gear_ratio;
  to.spring_stiffness = from.spring_stiffness, to.spring_rest = from.spring_rest;
}

/// A pitch of zero is a revolute joint's, and allowed.
void set_pitch(const std::string &who, const joint_kind_row &row, const joint_options &from, joint_description &to) {
  if (from.pitch && !row.has_pitch)
    refuse(who + "a " + row.name + " joint has no pitch; leave it out, or name the kind helical");
  if (row.has_pitch && !from.pitch)
    refuse(who + "a " + row.name + " joint needs its pitch, the advance along the axis in metres a radian");
  if (from.pitch && !std::isfinite(*from.pitch))
    refuse(who + "its pitch is not finite; give the advance along the axis in metres a radian");
  to.pitch = from.pitch;
}

void set_axes(const std::string &who, const joint_kind_row &row, const joint_options &from, joint_description &to) {
  to.given.axis = checked_axis(who, row, "axis", row.has_axis, needs_axis(row), from.axis);
  if (from.axis)
    to.axis = given::direction_of(to.given.axis);
  to.given.axis2 = checked_axis(who, row, "axis2", row.has_axis2, row.has_axis2, from.axis2);
  if (from.axis2)
    to.axis2 = given::direction_of(to.given.axis2);
}

/// Adds an item to the list and to the index of names; to neither if memory runs out.
/// So a call of the builder that throws leaves the robot as it was.
template <class Item> void append(std::vector<Item> &items, Item item, std::map<std::string, int> &index) {
  items.push_back(std::move(item));
  try {
    index[items.back().name] = static_cast<int>(items.size()) - 1;
  } catch (...) {
    items.pop_back();
    throw;
  }
}

/// Removes the last items from the list and from the index, until n are left.
template <class Item> void cut(std::vector<Item> &items, std::size_t n, std::map<std::string, int> &index) {
  for (; items.size() > n; items.pop_back())
    index.erase(items.back().name);
}

} // namespace

joint_kind joint_kind_named(const std::string &name) {
  std::vector<std::string> names;
  for (const joint_kind kind : joint_kinds) {
    const joint_kind_row row = row_of(kind);
    if (name == row.name || (row.other_name && name == row.other_name))
      return kind;
    names.push_back(row.name);
  }
  const std::string known = text::listed(names, names.size());
  refuse("joint kind " + quoted(name) + " is unknown, expected one of " + known +
         text::suggestion(name, names, "write one of these"));
}

builder::builder(std::string name, std::array<double, 3> gravity) {
  if (!finite({gravity[0], gravity[1], gravity[2]}))
    refuse("robot " + quoted(name) + ": its gravity is not finite; give three numbers in m/s²");
  if (text::printable(name) != name)
    refuse("robot " + quoted(name) + ": its name has a control character, or is not UTF-8; give it another name");
  robot_.name = std::move(name);
  robot_.gravity = gravity;
}

builder &builder::read_from(const std::string &file, const std::vector<std::string> &unused,
                            const std::vector<std::string> &warnings) {
  std::string name = file;
  std::vector<std::string> lines = unused, doubts = warnings; // all copied before anything is changed
  robot_.file.swap(name);
  robot_.unused.swap(lines);
  robot_.warnings.swap(doubts);
  return *this;
}

builder &builder::add_link(const std::string &name, const link_mass &mass) {
  check_name(name, "link", links_);
  check_mass(name, mass);
  const mat3x3<double> &I = mass.inertia;
  link_description link;
  link.name = name;
  if (mass.mass > 0 || I.m00 != 0 || I.m11 != 0 || I.m22 != 0) {
    // without mass and moments it has no <inertial> where the model is written
    link.has_inertial = true;
    const auto mean = [](double x, double y) { return x == y ? x : (x + y) / 2; };
    link.given = {mass.mass,
                  mass.center_of_mass,
                  {},
                  {I.m00, I.m11, I.m22, mean(I.m10, I.m01), mean(I.m21, I.m12), mean(I.m20, I.m02)}};
    link.inertia = given::inertia_of(*link.given);
  }
  append(robot_.links, std::move(link), links_);
  return *this;
}

builder &builder::add_joint(const std::string &name, joint_kind kind, const std::string &parent,
                            const std::string &child, const SE3<double> &pose, const joint_options &options) {
  check_name(name, "joint", joints_);
  const std::string who = "joint " + name + ": ";
  const joint_kind_row row = row_of(kind);
  joint_description joint;
  joint.name = name;
  joint.kind = kind;
  joint.parent = link_named("joint " + name, "parent", parent);
  joint.child = link_named("joint " + name, "child", child);
  joint.placement = rigid_pose(who + "its pose", pose);
  set_axes(who, row, options, joint);
  set_pitch(who, row, options, joint);
  set_limits(who, row, options, joint);
  set_physics(who, row, options, joint);
  joint.mimic = options.mimic; // checked when all joints are known
  append(robot_.joints, std::move(joint), joints_);
  return *this;
}

builder &builder::add_loop(const std::string &name, joint_kind kind, const std::string &predecessor,
                           const std::string &successor, const SE3<double> &predecessor_pose,
                           const SE3<double> &successor_pose, const loop_options &options) {
  check_name(name, "joint", joints_);
  const std::string who = "loop joint " + name + ": ";
  const joint_kind_row row = row_of(kind);
  joint_options motion;
  motion.axis = options.axis, motion.axis2 = options.axis2, motion.pitch = options.pitch;
  joint_description joint;
  if (!row.is_free) { // a kind that closes nothing is refused with the description, whatever it is given
    set_axes(who, row, motion, joint);
    set_pitch(who, row, motion, joint);
  }
  loop_description loop;
  loop.name = name;
  loop.kind = kind;
  loop.predecessor = link_named("joint " + name, "predecessor", predecessor);
  loop.successor = link_named("joint " + name, "successor", successor);
  loop.predecessor_pose = rigid_pose(who + "its frame on the predecessor", predecessor_pose);
  loop.successor_pose = rigid_pose(who + "its frame on the successor", successor_pose);
  loop.axis = joint.axis, loop.axis2 = joint.axis2, loop.pitch = joint.pitch;
  append(robot_.loops, std::move(loop), joints_);
  return *this;
}

builder &builder::add_force_element(const std::string &name, const std::string &link1, const vec3<double> &point1,
                                    const std::string &link2, const vec3<double> &point2,
                                    const force_element_numbers &numbers) {
  force_element_description of;
  of.name = name;
  const std::string who = "force element " + quoted(name);
  of.link1 = link_named(who, "first", link1), of.link2 = link_named(who, "second", link2);
  of.point1 = point1, of.point2 = point2, of.numbers = numbers;
  robot_description next; // checked with the links' names, and the names of those that are there already
  next.links = robot_.links, next.force_elements = robot_.force_elements;
  robot_.force_elements = with_force_elements(std::move(next), {std::move(of)}).force_elements;
  return *this;
}

builder &builder::set_drives(const std::vector<std::string> &joints, const std::vector<double> &weights) {
  robot_.drives = joints, robot_.drive_weights = weights;
  return *this;
}

/// Back to fewer links and joints: what add_dh_chain has added, before a row of its table was refused.
void builder::cut_to(std::size_t links, std::size_t joints) noexcept {
  cut(robot_.links, links, links_);
  cut(robot_.joints, joints, joints_);
}

int builder::link_named(const std::string &who, const std::string &end, const std::string &name) const {
  if (const auto found = links_.find(name); found != links_.end())
    return found->second;
  std::vector<std::string> names;
  for (const link_description &link : robot_.links)
    names.push_back(link.name);
  refuse(
      who + ": " + end + " link " + quoted(name) + " does not exist" +
      text::suggestion(name, names,
                       "add that link before it" + (names.empty() ? "" : ", or name one of " + text::listed(names))));
}

/// leaders_of is called for its checks: leaders are found anew by whoever needs them.
robot_description builder::description(const check_options &how) const {
  robot_description robot = robot_;
  check_tree(robot);
  leaders_of(robot);
  warn_of_links(robot, check_inertias(robot), how.strict, "correct these inertias");
  return robot;
}

/// Payloads may be the only masses, and a floating root moves all links: what moves, and has mass, is known with the options of the model alone.
model model_of(robot_description robot, const model_options &options, const check_options &how) {
  std::set<std::string> with_payload;
  for (const payload &p : options.payloads)
    if (p.mass > 0)
      with_payload.insert(p.link);
  warn_of_links(robot,
                check_masses(robot, options.floating_base || robot.floating_base, with_payload, how.masses_optional),
                how.strict, mend_of_masses(robot));
  return model(std::move(robot), options);
}

model builder::build(const model_options &options, const check_options &how) const {
  builder whole = *this; // whose drives may name the floating base
  whole.robot_.floating_base |= options.floating_base;
  return model_of(whole.description(how), options, how);
}

} // namespace ksl
