// Robots some of whose joints are frozen: their poses are those of the joints' kinematics, which models have.
#include "ksl/dynamics.hpp"
#include "ksl/engine/model/quaternion_tolerance.hpp"
#include "ksl/surgery.hpp"

#include "description/structure/check.hpp"
#include "description/structure/loops.hpp"
#include "description/structure/mimic.hpp"
#include "description/parts/items.hpp"

#include <algorithm>
#include <cmath>

namespace ksl {

namespace {

using namespace surgery;
using A = algebra<double>;
using text::has_name;

/// The pose of the child in the joint's frame at the position q of the joint.
SE3<double> joint_pose(const joint_description &joint, const std::vector<double> &q) {
  // the model of a robot that has this joint alone knows, whatever the kind
  robot_description alone;
  alone.links.resize(2);
  alone.links[0].name = "parent", alone.links[1].name = "child";
  alone.joints = {joint};
  alone.joints[0].parent = 0, alone.joints[0].child = 1;
  alone.joints[0].mimic.reset();    // the joint that it follows is not here
  alone.joints[0].is_rotor = false; // a rotor would be left out
  alone.joints[0].placement = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  const model m(std::move(alone));
  data d(m);
  return frame_pose(m, d, q.data(), 1);
}

/// The position of a joint in its frame.
SE3<double> pose_at(const joint_description &joint, std::vector<double> q) {
  const joint_kind_row row = row_of(joint.kind);
  const std::string who = "joint " + joint.name + ": ";
  if (q.size() != index(row.nq))
    refuse(who + "frozen at " + std::to_string(q.size()) + " numbers; a " + row.name + " joint has " +
           std::to_string(row.nq) + " in q");
  for (const double x : q)
    if (!std::isfinite(x))
      refuse(who + "frozen at a position that is not finite; mend its numbers");
  if (row.quaternion >= 0) {
    double *const p = q.data() + row.quaternion;
    const double length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
    if (!(std::fabs(length - 1) <= quaternion_tolerance))
      refuse(who + "frozen at a quaternion of length " + text::shown(length) + "; divide it by that");
    for (int i = 0; i < 4; ++i)
      p[i] /= length;
  }
  return joint_pose(joint, q);
}

/// The joint is fixed at this position.  What it has besides its name, its links and its placement is no more.
///
///     parent ── placement ──▸ joint's frame ── pose at q ──▸ child          a weld has the product as its placement
void freeze(joint_description &joint, const std::vector<double> &q) {
  if (joint.kind == joint_kind::fixed)
    refuse("joint " + joint.name + " is fixed already; leave it out");
  const SE3<double> pose = pose_at(joint, q);
  SE3<double> placement;
  A::product_dd(&joint.placement, &pose, &placement);
  const file_position at = joint.at;
  const bool is_rotor = joint.is_rotor;
  joint = weld(joint.name, joint.parent, joint.child, placement);
  joint.at = at, joint.is_rotor = is_rotor;
}

const frozen_joint *find_frozen(const std::vector<frozen_joint> &joints, const std::string &name) {
  const auto found = std::find_if(joints.begin(), joints.end(), [&](const frozen_joint &f) { return f.joint == name; });
  return found == joints.end() ? nullptr : &*found;
}

/// The joints that follow one that is frozen are frozen with it, where it holds them.  A follower alone can't be frozen: neither would
/// its leader move then.
/// q_f = multiplier q_l + offset, of leaders that follow nobody (leaders_of).
std::vector<frozen_joint> with_followers(const robot_description &robot, const std::vector<frozen_joint> &joints) {
  const std::vector<leader_of_joint> leaders = leaders_of(robot);
  std::vector<frozen_joint> out = joints;
  for (std::size_t j = 0; j < leaders.size(); ++j) {
    if (leaders[j].joint < 0)
      continue;
    const std::string &name = robot.joints[j].name, &leader = robot.joints[index(leaders[j].joint)].name;
    const frozen_joint *const own = find_frozen(joints, name), *const frozen = find_frozen(joints, leader);
    if (own && !frozen)
      refuse("joint " + name + " follows joint " + leader + ", and can't be frozen alone; freeze " + leader +
             ", which freezes both");
    if (!frozen || frozen->q.size() != 1) // which is refused when the leader is frozen
      continue;
    const double q = leaders[j].multiplier * frozen->q[0] + leaders[j].offset;
    if (!own)
      out.push_back({name, {q}});
    else if (own->q.size() == 1 && !(std::fabs(own->q[0] - q) <= 1e-9 * std::max(1.0, std::fabs(q))))
      refuse("joint " + name + ": frozen at " + text::shown(own->q[0]) + ", but joint " + leader +
             ", which it follows, holds it at " + text::shown(q) + "; leave it out");
  }
  return out;
}

/// The joint that the model adds for a floating base, described as those of the file, on a link of its own.
void describe_floating_base(robot_description &robot, const std::string &name) {
  const int root = check_tree(robot);
  joint_description base = weld(name, static_cast<int>(robot.links.size()), root, no_displacement);
  base.kind = joint_kind::floating;
  robot.links.push_back(massless(free_name(robot.links, "world")));
  robot.joints.insert(robot.joints.begin(), std::move(base));
  robot.floating_base = false;
}

} // namespace

robot_description with_frozen_joints(const robot_description &robot, const std::vector<frozen_joint> &joints) {
  robot_description out = robot;
  for (const frozen_joint &frozen : with_followers(robot, joints)) {
    if (out.floating_base && frozen.joint == floating_base_name(out))
      describe_floating_base(out, frozen.joint);
    if (has_name(out.loops, frozen.joint))
      refuse("joint " + frozen.joint +
             " closes a loop, and has no position to be frozen at; freeze joints of the tree");
    joint_description &joint = out.joints[index(find(out.joints, frozen.joint, "joint", out.name))];
    const int quaternion = row_of(joint.kind).quaternion;
    freeze(joint, frozen.q);
    if (quaternion >= 0 && !is_unit_quaternion(&frozen.q[index(quaternion)], quaternion_rounding))
      out.warnings.push_back("joint " + joint.name + ": frozen at a quaternion of length " +
                             text::shown(quaternion_length(&frozen.q[index(quaternion)])) + ", which was normalised");
  }
  keep_drives(out);
  return out;
}

} // namespace ksl
