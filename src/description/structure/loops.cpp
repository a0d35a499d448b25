// A joint that closes a loop is one like those of the tree, between its frames p and s on two links, but has no coordinate:
//
//     predecessor ── predecessor_pose ──▸ p ─ joint ─ s ◂── successor_pose ── successor
//
//     as_loop(joint)         predecessor = parent, predecessor_pose = placement; successor = child, whose frame s is: successor_pose = 1
//     as_tree_joint(loop)    the same backwards, for checks of axes and pitch; the successor's pose has no place in it
//
// Whatever is said of a coordinate, limits, friction or a drive, is lost where a joint closes a loop (lost_in_loop).
#include "description/structure/loops.hpp"

#include "description/parts/items.hpp"
#include "description/parts/joint_numbers.hpp"
#include "ksl/engine/model/joints.hpp"
#include "ksl/surgery.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace ksl {
namespace {

using text::quoted;

[[noreturn]] void refuse(const robot_description &robot, file_position at, const std::string &what) {
  text::refuse(robot.file, at.line, what);
}

bool finite(const SE3<double> &D) {
  const mat3x3<double> &R = D.R;
  for (const double x : {R.m00, R.m10, R.m20, R.m01, R.m11, R.m21, R.m02, R.m12, R.m22, D.t.x, D.t.y, D.t.z})
    if (!std::isfinite(x))
      return false;
  return true;
}

void check_ends(const robot_description &robot, const loop_description &loop) {
  const int n = static_cast<int>(robot.links.size());
  const std::string who = "loop joint " + loop.name + ": ";
  for (const int link : {loop.predecessor, loop.successor})
    if (link < 0 || link >= n)
      refuse(robot, loop.at,
             who + "one of its links is number " + std::to_string(link) + ", expected 0 to " + std::to_string(n - 1) +
                 "; add both links before it");
  if (loop.predecessor == loop.successor)
    refuse(robot, loop.at,
           who + "it connects link " + robot.links[static_cast<std::size_t>(loop.successor)].name +
               " with itself; name two links");
}

/// Names of joints that a motor can move, and of one that carries a root that floats.
std::vector<std::string> movable_joints(const robot_description &robot) {
  std::vector<std::string> names;
  if (robot.floating_base)
    names.push_back(floating_base_name(robot));
  for (const joint_description &joint : robot.joints)
    if (row_of(joint.kind).nv > 0 && !joint.mimic)
      names.push_back(joint.name);
  return names;
}

/// Refuses a drive that no motor can move; `joint` is null where the tree has none of that name.
void check_drive(const robot_description &robot, const std::string &name, const joint_description *joint) {
  const std::string who = "drive " + quoted(name) + ": ";
  const auto some = [&] { return text::listed(movable_joints(robot)); };
  if (!joint && text::has_name(robot.loops, name))
    refuse(robot, {},
           who +
               "it closes a loop, and its position is no coordinate; cut the loop at another joint, or drive one of " +
               some());
  if (!joint)
    refuse(robot, {},
           who + "there is no such joint" + text::suggestion(name, movable_joints(robot), "name some of " + some()));
  if (row_of(joint->kind).nv == 0)
    refuse(robot, {}, who + "it is a fixed joint, which no motor moves; name some of " + some());
  if (joint->mimic)
    refuse(robot, {}, who + "it follows joint " + joint->mimic->joint + "; name that one");
}

/// Refuses drives that no motor can move, or that are named twice.
void check_drives(const robot_description &robot) {
  if (!robot.drives)
    return;
  std::map<std::string, const joint_description *> joints;
  for (const joint_description &joint : robot.joints)
    joints.emplace(joint.name, &joint);
  std::set<std::string> seen;
  for (const std::string &name : *robot.drives) {
    if (!seen.insert(name).second)
      refuse(robot, {}, "drive " + quoted(name) + ": it is named twice; name each joint once");
    if (robot.floating_base && name == floating_base_name(robot))
      continue;
    const auto found = joints.find(name);
    check_drive(robot, name, found == joints.end() ? nullptr : found->second);
  }
  const std::size_t weights = robot.drive_weights.size();
  if (weights > 0 && weights != robot.drives->size())
    refuse(robot, {},
           std::to_string(weights) + " weights of " + std::to_string(robot.drives->size()) +
               " drives; give one for each, or none");
  for (std::size_t k = 0; k < weights; ++k)
    if (!(robot.drive_weights[k] > 0) || !std::isfinite(robot.drive_weights[k]))
      refuse(robot, {},
             "drive " + quoted((*robot.drives)[k]) + ": its weight is " + text::shown(robot.drive_weights[k]) +
                 "; a weight is positive and finite");
}

/// Is a matrix finite and symmetric, and do its two by two parts give no x · C x below zero?
/// x · C x is twice the energy that a wrench x stores; |C_ij| ≤ √(C_ii C_jj) is that for each pair, with room for the rounding of a file's numbers.
bool stores_energy(const std::array<double, 36> &C) {
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t k = 0; k <= i; ++k) {
      const double x = C[6 * i + k], y = C[6 * k + i], most = std::sqrt(C[7 * i] * C[7 * k]);
      if (!std::isfinite(x) || std::fabs(x - y) > 1e-9 * most || std::fabs(x) > most * (1 + 1e-9) || (i == k && x < 0))
        return false;
    }
  return true;
}

/// Refuses compliances of unknown joints, and matrices that store no energy.
/// A matrix (6, 6) for each joint that gives way, and `loose`, Σ u uᵀ over directions in which nothing resists; both are of wrenches at the joint.
void check_compliances(const robot_description &robot) {
  std::vector<std::string> names;
  for (const joint_description &joint : robot.joints)
    names.push_back(joint.name);
  for (const loop_description &loop : robot.loops)
    names.push_back(loop.name);
  std::set<std::string> seen;
  for (const joint_compliance &of : robot.compliances) {
    const std::string who = "stiffness of joint " + quoted(of.joint) + ": ";
    const bool is_ground = of.joint.empty() && !robot.floating_base;
    if (!is_ground && std::find(names.begin(), names.end(), of.joint) == names.end())
      refuse(robot, {},
             who + "there is no such joint" + text::suggestion(of.joint, names, "name some of " + text::listed(names)));
    if (!seen.insert(of.joint).second)
      refuse(robot, {}, who + "it is given twice; give it once");
    if (!stores_energy(of.matrix) || !stores_energy(of.loose))
      refuse(
          robot, {},
          who +
              "its compliance is not finite, symmetric and positive semidefinite; correct its stiffnesses, which are positive or zero");
  }
}

} // namespace

joint_description as_tree_joint(const loop_description &loop) {
  joint_description joint;
  joint.name = loop.name, joint.at = loop.at, joint.kind = loop.kind;
  joint.parent = loop.predecessor, joint.child = loop.successor;
  joint.placement = loop.predecessor_pose;
  joint.axis = loop.axis, joint.axis2 = loop.axis2, joint.pitch = loop.pitch;
  return joint;
}

loop_description as_loop(const joint_description &joint) {
  loop_description loop;
  loop.name = joint.name, loop.at = joint.at, loop.kind = joint.kind;
  loop.predecessor = joint.parent, loop.successor = joint.child;
  loop.predecessor_pose = joint.placement;
  loop.successor_pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  loop.axis = joint.axis, loop.axis2 = joint.axis2, loop.pitch = joint.pitch;
  loop.given = {joint.given.rotation, {}, joint.given.axis, joint.given.axis2, joint.given.pitch};
  return loop;
}

std::vector<std::string> lost_in_loop(const joint_description &joint) {
  std::vector<std::string> lost;
  const auto has_bounds = [](const coordinate_limits &limits) { return limits.lower || limits.upper; };
  if (joint.lower || joint.upper || joint.effort || joint.velocity || has_bounds(joint.further[0]) ||
      has_bounds(joint.further[1]))
    lost.push_back("limit");
  if (joint.mimic)
    lost.push_back("mimic");
  if (joint.damping != 0 || joint.friction != 0 || joint.armature != 0 || joint.rotor_inertia != 0 ||
      joint.spring_stiffness != 0)
    lost.push_back("dynamics");
  return lost;
}

std::string floating_base_name(const robot_description &robot) {
  const bool is_taken = text::has_name(robot.joints, "floating_base") || text::has_name(robot.loops, "floating_base");
  return surgery::free_joint_name(robot, is_taken ? "floating_root" : "floating_base");
}

/// After joints have gone: drives and compliances of those that are left, each drive with its weight.
void keep_drives(robot_description &robot) {
  // an empty name is that of the joint to the ground, which is in no list
  std::erase_if(robot.compliances, [&](const joint_compliance &of) {
    return !of.joint.empty() && !text::has_name(robot.joints, of.joint) && !text::has_name(robot.loops, of.joint);
  });
  if (!robot.drives)
    return;
  std::set<std::string> movable;
  if (robot.floating_base)
    movable.insert(floating_base_name(robot));
  for (const joint_description &joint : robot.joints)
    if (row_of(joint.kind).nv > 0)
      movable.insert(joint.name);
  std::vector<std::string> kept;
  std::vector<double> weights;
  for (std::size_t k = 0; k < robot.drives->size(); ++k)
    if (movable.count((*robot.drives)[k]) > 0) {
      kept.push_back((*robot.drives)[k]);
      if (!robot.drive_weights.empty())
        weights.push_back(robot.drive_weights[k]);
    }
  *robot.drives = std::move(kept), robot.drive_weights = std::move(weights);
}

/// Loops have names among the joints of the tree: drives, compliances and messages name both alike.
void check_loops(const robot_description &robot) {
  std::set<std::string> names;
  for (const joint_description &joint : robot.joints)
    if (!robot.loops.empty())
      names.insert(joint.name);
  for (const loop_description &loop : robot.loops) {
    if (loop.name.empty())
      refuse(robot, loop.at, "a loop joint has no name; give it one");
    if (!names.insert(loop.name).second)
      refuse(robot, loop.at, "a second joint is named " + quoted(loop.name) + "; rename one of them");
    check_ends(robot, loop);
    if (row_of(loop.kind).is_free)
      refuse(robot, loop.at,
             "loop joint " + loop.name + ": a " + row_of(loop.kind).name +
                 " joint leaves all freedoms, and closes nothing; remove it, or correct its kind");
    if (!finite(loop.predecessor_pose) || !finite(loop.successor_pose))
      refuse(robot, loop.at, "loop joint " + loop.name + ": a frame of it is not finite; mend its numbers");
    check_joint_numbers(robot, as_tree_joint(loop));
  }
  check_drives(robot);
  check_compliances(robot);
}

robot_description with_loops(robot_description robot, std::vector<loop_description> loops) {
  for (loop_description &loop : loops)
    robot.loops.push_back(std::move(loop));
  check_loops(robot);
  return robot;
}

/// The tree as it is, where all joints have motors: drives of the mechanism would leave some of its coordinates without one.
robot_description without_loops(robot_description robot) {
  robot.loops.clear();
  robot.drives.reset();
  robot.drive_weights.clear();
  keep_drives(robot);
  return robot;
}

robot_description with_compliances(robot_description robot, std::vector<joint_compliance> compliances) {
  robot.compliances = std::move(compliances);
  check_loops(robot);
  return robot;
}

robot_description with_drives(robot_description robot, std::vector<std::string> joints, std::vector<double> weights) {
  if (robot.loops.empty())
    refuse(robot, {},
           "robot " + quoted(robot.name) +
               " has no loops: each joint of a tree has a motor; name drives of robots with loops only");
  robot.drives = std::move(joints);
  robot.drive_weights = std::move(weights);
  check_loops(robot);
  return robot;
}

} // namespace ksl
