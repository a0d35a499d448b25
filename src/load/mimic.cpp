#include "load/mimic.hpp"

#include "ksl/engine/joints.hpp"
#include "load/words.hpp"

#include <cmath>
#include <map>

namespace ksl {

namespace {

using load::quoted;

/// The way out for a robot that was read from a file.
std::string or_independent(const robot_description &robot) {
  return robot.file.empty() ? ""
                            : "; mimic=\"independent\" in Python, or --mimic independent on the command line, gives each joint a "
                              "coordinate of its own";
}

std::size_t index(int i) { return static_cast<std::size_t>(i); }

[[noreturn]] void refuse(const robot_description &robot, const joint_description &joint, const std::string &what) {
  load::refuse(robot.file, joint.mimic && joint.mimic->at.line ? joint.mimic->at.line : joint.at.line,
               "joint " + joint.name + ": " + what);
}

/// Refuses a follower or a leader that can't be one.
void check_coordinates(const robot_description &robot, const joint_description &follower, const joint_description &joint,
                       const std::string &who) {
  const joint_kind_row kind = row_of(joint.kind);
  if (kind.nv == 0)
    refuse(robot, follower, who + " is fixed; a mimic joint and the joint that it mimics both move: remove <mimic>, or name a moving joint");
  if (kind.nq != 1 || kind.nv != 1)
    refuse(robot, follower,
           who + " is a " + kind.name + " joint, with " + std::to_string(kind.nv) +
               " coordinates; a mimic joint and the joint that it mimics have one each" + or_independent(robot));
}

/// The index of the joint that a follower names.
int named_leader(const robot_description &robot, const joint_description &follower, const std::map<std::string, int> &by_name) {
  const std::string &name = follower.mimic->joint;
  const auto found = by_name.find(name);
  if (found == by_name.end()) {
    std::vector<std::string> names;
    for (const joint_description &joint : robot.joints)
      names.push_back(joint.name);
    refuse(robot, follower, "it mimics joint " + quoted(name) + ", which does not exist" +
                                load::suggestion(name, names, "correct the name") + or_independent(robot));
  }
  const joint_description &leader = robot.joints[index(found->second)];
  if (!std::isfinite(follower.mimic->multiplier) || !std::isfinite(follower.mimic->offset))
    refuse(robot, follower, "multiplier and offset of its <mimic> must be finite");
  check_coordinates(robot, follower, follower, "it mimics another joint and");
  check_coordinates(robot, follower, leader, "it mimics joint " + quoted(name) + ", which");
  return found->second;
}

} // namespace

std::vector<leader_of_joint> leaders_of(const robot_description &robot) {
  std::map<std::string, int> by_name;
  for (std::size_t j = 0; j < robot.joints.size(); ++j)
    by_name.emplace(robot.joints[j].name, static_cast<int>(j));
  std::vector<leader_of_joint> named(robot.joints.size()), out(robot.joints.size());
  for (std::size_t j = 0; j < robot.joints.size(); ++j)
    if (const joint_description &joint = robot.joints[j]; joint.mimic)
      named[j] = {named_leader(robot, joint, by_name), joint.mimic->multiplier, joint.mimic->offset};
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    leader_of_joint leader = named[j];
    for (std::size_t steps = 0; leader.joint >= 0 && named[index(leader.joint)].joint >= 0; ++steps) {
      const leader_of_joint &next = named[index(leader.joint)];
      if (steps > robot.joints.size())
        refuse(robot, robot.joints[j],
               "it mimics joint " + quoted(robot.joints[j].mimic->joint) +
                   ", which in turn mimics others, back to itself: no joint leads; remove one <mimic>");
      leader = {next.joint, leader.multiplier * next.multiplier, leader.multiplier * next.offset + leader.offset};
    }
    out[j] = leader;
  }
  return out;
}

} // namespace ksl
