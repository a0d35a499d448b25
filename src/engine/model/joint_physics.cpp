// What becomes of a joint's numbers, with the option that turns each on (the law: ksl/engine/model/joint_physics.hpp):
//
//     of a description                  of a coordinate                    option
//     damping, spring_stiffness         damping, stiffness                 damping, spring
//     friction, friction_width w        friction, friction_width           friction, or exact friction with w = `narrowest`
//     armature                          armature                           armature
//     rotor_inertia I, gear_ratio n     armature += I n²                   rotor
//                                       a body JOINT_rotor with I a aᵀ     rotor bodies
//
// A rotor that turns by n q̇ about the joint's axis a, relative to a parent that turns by ω, has the energy ½ I (a · ω + n q̇)².  Armature has ½ I n²
// q̇² of it, and leaves out what the parent's motion does; the body, on the parent and with the position n q, has all of it.
#include "engine/model/joint_physics.hpp"

#include "description/structure/check.hpp"
#include "description/parts/joint_numbers.hpp"
#include "text/unused.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace ksl {
namespace {

/// The width w of exact dry friction.  w² isn't zero in single precision, and for speeds from 1e-14 on v / √(v² + w²) is ±1.
constexpr double narrowest = 1e-18;

[[noreturn]] void refuse(const robot_description &robot, const joint_description &j, const std::string &what) {
  text::refuse(robot.file, j.at.line, "joint " + text::quoted(j.name) + ": " + what);
}

/// Far beyond all gears: of 0 a rotor would not turn, and squares of such numbers stay within the range.
constexpr double least_gear_ratio = 1e-9, most_gear_ratio = 1e9;

void check(const robot_description &robot, const joint_description &j) {
  const struct {
    const char *name;
    double value;
  } numbers[] = {{"damping", j.damping},
                 {"friction", j.friction},
                 {"armature", j.armature},
                 {"rotor_inertia", j.rotor_inertia},
                 {"spring_stiffness", j.spring_stiffness}};
  for (const auto &[name, value] : numbers)
    if (!(value >= 0 && std::isfinite(value)))
      refuse(robot, j, std::string(name) + " is " + text::shown(value) + "; expected a number that is not negative");
  if (!(std::fabs(j.gear_ratio) >= least_gear_ratio && std::fabs(j.gear_ratio) <= most_gear_ratio))
    refuse(robot, j,
           "gear_ratio is " + text::shown(j.gear_ratio) +
               "; expected turns of the rotor for each of the joint, or rad/m, of a size from 1e-9 to 1e9");
  if (j.friction_width && !(*j.friction_width > 0))
    refuse(robot, j,
           "friction_width is " + text::shown(*j.friction_width) +
               "; expected the speed at which friction has 0.71 of its full strength");
  const joint_kind_row kind = row_of(j.kind);
  if (kind.nv != 1 && j.spring_stiffness != 0)
    refuse(robot, j,
           "a spring on a " + std::string(kind.name) + " joint; only joints with one coordinate can have one");
  if ((kind.is_free || kind.nv == 0) && (j.armature != 0 || j.rotor_inertia != 0))
    refuse(robot, j, "a rotor on a " + std::string(kind.name) + " joint; leave out armature and rotor_inertia");
}

/// What a joint has and the options leave off is told, since results would be other with it.
void list_if_off(text::unused_list &unused, const joint_description &j, const physics_options &options) {
  const struct {
    const char *name;
    bool on;
    double value;
  } all[] = {{"damping", options.damping, j.damping},
             {"friction", options.friction, j.friction},
             {"armature", options.armature, j.armature},
             {"rotor", options.rotor, j.rotor_inertia},
             {"spring", options.spring, j.spring_stiffness}};
  for (const auto &[name, on, value] : all)
    if (!on && value != 0)
      unused.in_joint(name, "read, not applied", j.name);
}

/// Is the joint's rotor a body?
bool has_rotor_body(const joint_description &j, const physics_options &options) {
  const joint_kind_row kind = row_of(j.kind);
  return options.rotor && options.rotor_bodies && j.rotor_inertia != 0 && kind.nq == 1 && kind.nv == 1;
}

coordinate_physics<double> physics_of(const joint_description &j, const physics_options &options, int q_index) {
  coordinate_physics<double> c{};
  // the rotor turns by n q̇ and feels ½ I (n q̇)²: I n² at the joint.  As a body it also turns with the joint's parent.
  const double reflected =
      options.rotor && !has_rotor_body(j, options) ? j.rotor_inertia * j.gear_ratio * j.gear_ratio : 0;
  c.armature = (options.armature ? j.armature : 0) + reflected;
  c.damping = options.damping ? j.damping : 0;
  c.friction = options.friction ? j.friction : 0;
  c.friction_width = options.exact_friction ? narrowest : j.friction_width.value_or(options.friction_width);
  c.stiffness = options.spring ? j.spring_stiffness : 0;
  c.rest = j.spring_rest;
  c.q_index = q_index;
  c.is_rotor = j.is_rotor;
  return c;
}

/// Does a line of a description's unused contents name physics that is off?
bool is_off_line(const std::string &line) { return line.find("(read, not applied)") != line.npos; }

/// I a aᵀ: a rotor about its own axis alone, since its mass is in the links that the file gives.
spatial_inertia<double> rotor_of(const joint_description &j) {
  const vec3<double> a = axis_of(j);
  const double I = j.rotor_inertia;
  return {0, {0, 0, 0}, I * a.x * a.x, I * a.y * a.y, I * a.z * a.z, I * a.x * a.y, I * a.y * a.z, I * a.z * a.x};
}

/// Has the link of a rotor what add_rotor gave it, and no payload or parameters of its own?  The joint that the rotor follows may be frozen, and follow no more.
bool is_rotor_alone(const robot_description &robot, const joint_description &rotor) {
  const spatial_inertia<double> &I = robot.links[static_cast<std::size_t>(rotor.child)].inertia;
  if (I.m != 0 || I.h.x != 0 || I.h.y != 0 || I.h.z != 0)
    return false;
  for (const joint_description &j : robot.joints)
    if (rotor.mimic && j.name == rotor.mimic->joint) {
      const spatial_inertia<double> R = rotor_of(j);
      return I.Ixx == R.Ixx && I.Iyy == R.Iyy && I.Izz == R.Izz && I.Ixy == R.Ixy && I.Iyz == R.Iyz && I.Izx == R.Izx;
    }
  return true;
}

/// What names a link by its index would be on the next link that stays, so a rotor that anything else is on can't go.
void remove_rotors(robot_description &robot) {
  std::vector<bool> goes(robot.links.size(), false);
  for (const joint_description &j : robot.joints)
    if (j.is_rotor)
      goes[static_cast<std::size_t>(j.child)] = true;
  if (std::find(goes.begin(), goes.end(), true) == goes.end())
    return;
  check_tree(robot);
  const auto shown = [&](int link) { return text::quoted(robot.links[static_cast<std::size_t>(link)].name); };
  const auto refuse_on_rotor = [&](int link, const file_position &at, const char *what, const std::string &name,
                                   const char *whose) {
    if (goes[static_cast<std::size_t>(link)])
      text::refuse(robot.file, at.line,
                   what + (" " + text::quoted(name)) + ": its " + whose + " link " + shown(link) +
                       " is a rotor, which is a link with the physics \"rotor bodies\" alone; put the " + what +
                       " on another link");
  };
  for (const joint_description &j : robot.joints) {
    if (!j.is_rotor)
      refuse_on_rotor(j.parent, j.at, "joint", j.name, "parent");
    else if (!is_rotor_alone(robot, j))
      text::refuse(
          robot.file, j.at.line,
          "link " + shown(j.child) +
              " is a rotor, which is a link with the physics \"rotor bodies\" alone, and has a mass or an inertia "
              "that isn't its joint's rotor_inertia; put that on another link, or keep the physics");
  }
  for (const loop_description &l : robot.loops) {
    refuse_on_rotor(l.predecessor, l.at, "joint", l.name, "parent");
    refuse_on_rotor(l.successor, l.at, "joint", l.name, "child");
  }
  for (const force_element_description &of : robot.force_elements) {
    refuse_on_rotor(of.link1, of.at, "force element", of.name, "first");
    refuse_on_rotor(of.link2, of.at, "force element", of.name, "second");
  }
  // index[l]: the place of link l among those that stay.  Of three links, the second a rotor: (0, 1, 1); that of one that goes is never read, since
  // all that could be on it has been refused.
  std::vector<int> index;
  std::vector<link_description> links;
  for (std::size_t l = 0; l < robot.links.size(); ++l) {
    index.push_back(static_cast<int>(links.size()));
    if (!goes[l])
      links.push_back(std::move(robot.links[l]));
  }
  robot.links = std::move(links);
  std::erase_if(robot.joints, [](const joint_description &j) { return j.is_rotor; });
  for (joint_description &j : robot.joints)
    j.parent = index[static_cast<std::size_t>(j.parent)], j.child = index[static_cast<std::size_t>(j.child)];
  for (loop_description &l : robot.loops)
    l.predecessor = index[static_cast<std::size_t>(l.predecessor)],
    l.successor = index[static_cast<std::size_t>(l.successor)];
  for (force_element_description &of : robot.force_elements)
    of.link1 = index[static_cast<std::size_t>(of.link1)], of.link2 = index[static_cast<std::size_t>(of.link2)];
}

/// Adds link and joint JOINT_rotor, or that name with underscores after it.  names: those of all links and joints.
void add_rotor(robot_description &robot, const joint_description &j, std::set<std::string> &names) {
  link_description link;
  joint_description joint;
  link.name = joint.name =
      text::free_name(j.name + "_rotor", [&](const std::string &name) { return names.count(name) > 0; });
  names.insert(link.name);
  link.at = joint.at = j.at;
  link.inertia = rotor_of(j);
  link.has_inertial = true;
  joint.kind = joint_kind::continuous;
  joint.parent = j.parent, joint.child = static_cast<int>(robot.links.size());
  joint.placement = j.placement;
  joint.axis = axis_of(j);
  joint.mimic = {j.name, j.gear_ratio, 0, j.at};
  joint.is_rotor = true;
  robot.links.push_back(std::move(link));
  robot.joints.push_back(std::move(joint));
}

struct named_option {
  const char *name;
  bool physics_options::*option;
};
constexpr named_option named_options[] = {{"damping", &physics_options::damping},
                                          {"friction", &physics_options::friction},
                                          {"exact friction", &physics_options::exact_friction},
                                          {"armature", &physics_options::armature},
                                          {"rotor", &physics_options::rotor},
                                          {"rotor bodies", &physics_options::rotor_bodies},
                                          {"spring", &physics_options::spring},
                                          {"force elements", &physics_options::force_elements}};

} // namespace

physics_options physics_named(const std::vector<std::string> &names, double friction_width) {
  physics_options options;
  options.friction_width = friction_width;
  if (!(friction_width > 0 && std::isfinite(friction_width)))
    text::refuse({}, 0,
                 "friction_width is " + text::shown(friction_width) +
                     "; expected the speed at which friction has 0.71 of its full strength");
  std::vector<std::string> known = {"all"};
  for (const named_option &each : named_options)
    known.push_back(each.name);
  for (const std::string &name : names) {
    const auto is_it = [&](const named_option &each) { return each.name == name; };
    const auto found = std::find_if(std::begin(named_options), std::end(named_options), is_it);
    if (found != std::end(named_options))
      options.*found->option = true;
    else if (name == "all")
      // of two laws for one thing "all" has the smooth one, and rotors as armature
      options.damping = options.friction = options.armature = options.rotor = options.spring = options.force_elements =
          true;
    else
      text::refuse({}, 0,
                   "physics " + text::quoted(name) + " is unknown, expected some of " +
                       text::listed(known, known.size()) + text::suggestion(name, known, "write some of these"));
  }
  const auto are_both = [&](const char *a, const char *b) {
    return std::find(names.begin(), names.end(), a) != names.end() &&
           std::find(names.begin(), names.end(), b) != names.end();
  };
  for (const auto &[plain, refined] : {std::pair{"friction", "exact friction"}, {"rotor", "rotor bodies"}})
    if (are_both(plain, refined))
      text::refuse({}, 0,
                   "physics names both " + text::quoted(plain) + " and " + text::quoted(refined) +
                       ", two laws for the same thing; keep one");
  options.friction |= options.exact_friction;
  options.rotor |= options.rotor_bodies;
  return options;
}

std::vector<std::string> names_of(const physics_options &options) {
  std::vector<std::string> names;
  for (const named_option &each : named_options) {
    const bool is_refined = (each.option == &physics_options::friction && options.exact_friction) ||
                            (each.option == &physics_options::rotor && options.rotor_bodies);
    if (options.*each.option && !is_refined)
      names.push_back(each.name);
  }
  return names;
}

robot_description with_rotors(robot_description robot) {
  physics_options &options = robot.physics;
  options.friction |= options.exact_friction;
  options.rotor |= options.rotor_bodies;
  if (!options.rotor_bodies) {
    remove_rotors(robot);
    return robot;
  }
  check_tree(robot);
  std::set<std::string> names, with_rotor; // of all links and joints; of the joints that have their rotor
  for (const link_description &link : robot.links)
    names.insert(link.name);
  for (const joint_description &joint : robot.joints) {
    names.insert(joint.name);
    if (joint.is_rotor && joint.mimic)
      with_rotor.insert(joint.mimic->joint);
  }
  for (std::size_t i = 0, given = robot.joints.size(); i < given; ++i) {
    const joint_description j = robot.joints[i];
    if (has_rotor_body(j, options) && !with_rotor.count(j.name))
      add_rotor(robot, j, names);
  }
  return robot;
}

std::vector<coordinate_physics<double>> joint_physics(robot_description &robot, const std::vector<joint_row> &joints,
                                                      int nv) {
  const physics_options &options = robot.physics;
  text::unused_list unused;
  std::erase_if(robot.unused, is_off_line); // the description of another model has them
  for (const joint_description &j : robot.joints) {
    check(robot, j);
    list_if_off(unused, j, options);
  }
  for (const std::string &line : unused.lines())
    robot.unused.push_back(line);
  if (!options.force_elements && !robot.force_elements.empty()) {
    std::vector<std::string> names;
    for (const force_element_description &of : robot.force_elements)
      names.push_back(of.name);
    robot.unused.push_back("force element " + text::listed(names) + " (read, not applied)");
  }
  // no arrays: kernels then don't look at physics at all
  if (!(options.damping || options.friction || options.armature || options.rotor || options.spring))
    return {};
  // where a joint has nothing: the width 1 keeps v / √(v² + w²) finite at rest
  std::vector<coordinate_physics<double>> all(static_cast<std::size_t>(nv), {0, 0, 0, 1, 0, 0, 0, false});
  for (const joint_row &j : joints)
    for (int k = 0; k < row_of(j.kind).nv; ++k)
      all[static_cast<std::size_t>(j.v_index + k)] =
          physics_of(robot.joints[static_cast<std::size_t>(j.description)], options, j.q_index);
  return all;
}

} // namespace ksl
