#include "engine/joint_physics.hpp"

#include "load/unused.hpp"
#include "load/words.hpp"

#include <algorithm>
#include <cmath>

namespace ksl {
namespace {

/// Width of exact dry friction.  Its square is a number in single precision; from 1e-14 on, v / √(v² + w²) is ±1.
constexpr double narrowest = 1e-18;

[[noreturn]] void refuse(const robot_description &robot, const joint_description &j, const std::string &what) {
  load::refuse(robot.file, j.at.line, "joint " + load::quoted(j.name) + ": " + what);
}

void check(const robot_description &robot, const joint_description &j) {
  const struct { const char *name; double value; } numbers[] = {
      {"damping", j.damping}, {"friction", j.friction}, {"armature", j.armature}, {"rotor_inertia", j.rotor_inertia},
      {"spring_stiffness", j.spring_stiffness}};
  for (const auto &[name, value] : numbers)
    if (!(value >= 0 && std::isfinite(value)))
      refuse(robot, j, std::string(name) + " is " + load::shown(value) + "; expected a number that is not negative");
  if (j.friction_width && !(*j.friction_width > 0))
    refuse(robot, j, "friction_width is " + load::shown(*j.friction_width) +
                         "; expected the speed at which friction has 0.71 of its full strength");
  const joint_kind_row kind = row_of(j.kind);
  if (kind.nv != 1 && j.spring_stiffness != 0)
    refuse(robot, j, "a spring on a " + std::string(kind.name) + " joint; only joints with one coordinate can have one");
  if ((kind.is_free || kind.nv == 0) && (j.armature != 0 || j.rotor_inertia != 0))
    refuse(robot, j, "a rotor on a " + std::string(kind.name) + " joint; leave out armature and rotor_inertia");
}

void list_if_off(load::unused_list &unused, const joint_description &j, const physics_options &options) {
  const struct { const char *name; bool on; double value; } all[] = {
      {"damping", options.damping, j.damping}, {"friction", options.friction, j.friction},
      {"armature", options.armature, j.armature}, {"rotor", options.rotor, j.rotor_inertia},
      {"spring", options.spring, j.spring_stiffness}};
  for (const auto &[name, on, value] : all)
    if (!on && value != 0)
      unused.in_joint(name, "read, not applied", j.name);
}

coordinate_physics<double> physics_of(const joint_description &j, const physics_options &options, int q_index) {
  coordinate_physics<double> c{};
  c.armature = (options.armature ? j.armature : 0) + (options.rotor ? j.rotor_inertia * j.gear_ratio * j.gear_ratio : 0);
  c.damping = options.damping ? j.damping : 0;
  c.friction = options.friction ? j.friction : 0;
  c.friction_width = options.exact_friction ? narrowest : j.friction_width.value_or(options.friction_width);
  c.stiffness = options.spring ? j.spring_stiffness : 0;
  c.rest = j.spring_rest;
  c.q_index = q_index;
  return c;
}

} // namespace

std::vector<coordinate_physics<double>> joint_physics(robot_description &robot, const std::vector<joint_row> &joints, int nv) {
  const physics_options &options = robot.physics;
  load::unused_list unused;
  for (const joint_description &j : robot.joints) {
    check(robot, j);
    list_if_off(unused, j, options);
  }
  for (const std::string &line : unused.lines())
    if (std::find(robot.unused.begin(), robot.unused.end(), line) == robot.unused.end()) // the description of another model has them
      robot.unused.push_back(line);
  if (!(options.damping || options.friction || options.armature || options.rotor || options.spring))
    return {};
  std::vector<coordinate_physics<double>> all(static_cast<std::size_t>(nv), {0, 0, 0, 1, 0, 0, 0});
  for (const joint_row &j : joints)
    for (int k = 0; k < row_of(j.kind).nv; ++k)
      all[static_cast<std::size_t>(j.v_index + k)] =
          physics_of(robot.joints[static_cast<std::size_t>(j.description)], options, j.q_index);
  return all;
}

} // namespace ksl
