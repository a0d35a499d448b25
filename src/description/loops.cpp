#include "description/loops.hpp"

#include "description/check.hpp"
#include "ksl/engine/model/joints.hpp"
#include "ksl/surgery.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>
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

/// Refuses drives that no motor can move, or that are named twice.
void check_drives(const robot_description &robot) {
  std::set<std::string> seen;
  for (const std::string &name : robot.drives.value_or(std::vector<std::string>())) {
    std::vector<std::string> movable;
    const joint_description *found = nullptr;
    for (const joint_description &joint : robot.joints) {
      if (joint.name == name)
        found = &joint;
      if (row_of(joint.kind).nv > 0 && !joint.mimic)
        movable.push_back(joint.name);
    }
    const std::string who = "drive " + quoted(name) + ": ";
    if (!seen.insert(name).second)
      refuse(robot, {}, who + "it is named twice; name each joint once");
    if (text::has_name(robot.loops, name))
      refuse(robot, {},
             who + "it is the joint of a loop, whose position is no coordinate; cut the loop at another joint, or " +
                 "drive one of " + text::listed(movable));
    if (!found)
      refuse(robot, {},
             who + "there is no such joint" + text::suggestion(name, movable, "name some of " + text::listed(movable)));
    if (row_of(found->kind).nv == 0)
      refuse(robot, {}, who + "it is a fixed joint, which no motor moves; name some of " + text::listed(movable));
    if (found->mimic)
      refuse(robot, {}, who + "it follows joint " + found->mimic->joint + "; name that one");
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

void check_loops(const robot_description &robot) {
  std::set<std::string> names;
  for (const loop_description &loop : robot.loops) {
    if (loop.name.empty())
      refuse(robot, loop.at, "a loop joint has no name; give it one");
    if (!names.insert(loop.name).second || text::has_name(robot.joints, loop.name))
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
}

robot_description with_loops(robot_description robot, std::vector<loop_description> loops) {
  for (loop_description &loop : loops)
    robot.loops.push_back(std::move(loop));
  check_loops(robot);
  return robot;
}

robot_description without_loops(robot_description robot) {
  robot.loops.clear();
  robot.drives.reset();
  return robot;
}

robot_description with_drives(robot_description robot, std::vector<std::string> joints) {
  if (robot.loops.empty())
    refuse(robot, {},
           "robot " + quoted(robot.name) +
               " has no loops: each joint of a tree has a motor; name drives of robots with loops only");
  robot.drives = std::move(joints);
  check_loops(robot);
  return robot;
}

} // namespace ksl
