// Followers of followers, each once.  A path is walked to the first joint whose leader is known, or that follows none, and then resolved backwards:
//
//     named      d → c → b → a          c: q_c = m q_b + o
//     path       d, c, b                resolved as b, c, d: all follow a
#include "description/structure/mimic.hpp"

#include "ksl/engine/model/joints.hpp"
#include "text/words.hpp"

#include <cmath>
#include <map>

namespace ksl {

namespace {

using text::quoted;

/// The end of a sentence: how a robot that was read from a file can be loaded all the same.
std::string or_independent(const robot_description &robot) {
  return robot.file.empty()
             ? ""
             : "; mimic=\"independent\" in Python, or --mimic independent on the command line, gives each joint a "
               "coordinate of its own";
}

std::size_t index(int i) { return static_cast<std::size_t>(i); }

[[noreturn]] void refuse(const robot_description &robot, const joint_description &joint, const std::string &what) {
  text::refuse(robot.file, joint.mimic && joint.mimic->at.line ? joint.mimic->at.line : joint.at.line,
               "joint " + joint.name + ": " + what);
}

/// Refuses a follower or a leader that can't be one.
void check_coordinates(const robot_description &robot, const joint_description &follower,
                       const joint_description &joint, const std::string &who) {
  const joint_kind_row kind = row_of(joint.kind);
  if (kind.nv == 0)
    refuse(
        robot, follower,
        who +
            " is fixed; a mimic joint and the joint that it mimics both move: remove <mimic>, or name a moving joint");
  if (kind.nq != 1 || kind.nv != 1)
    refuse(robot, follower,
           who + " is a " + kind.name + " joint, with " + std::to_string(kind.nv) +
               " coordinates; a mimic joint and the joint that it mimics have one each" + or_independent(robot));
}

/// The index of the joint that a follower names.
int named_leader(const robot_description &robot, const joint_description &follower,
                 const std::map<std::string, int> &by_name) {
  const std::string &name = follower.mimic->joint;
  const auto found = by_name.find(name);
  if (found == by_name.end()) {
    if (text::has_name(robot.loops, name))
      refuse(robot, follower,
             "it mimics joint " + quoted(name) +
                 ", which closes a loop and has no coordinate; mimic a joint of the tree" + or_independent(robot));
    std::vector<std::string> names;
    for (const joint_description &joint : robot.joints)
      names.push_back(joint.name);
    refuse(robot, follower,
           "it mimics joint " + quoted(name) + ", which does not exist" +
               text::suggestion(name, names, "correct the name") + or_independent(robot));
  }
  const joint_description &leader = robot.joints[index(found->second)];
  if (!std::isfinite(follower.mimic->multiplier) || !std::isfinite(follower.mimic->offset))
    refuse(robot, follower, "multiplier and offset of its <mimic> must be finite");
  check_coordinates(robot, follower, follower, "it mimics another joint and");
  check_coordinates(robot, follower, leader, "it mimics joint " + quoted(name) + ", which");
  return found->second;
}

/// Sets in `out` the leaders of a joint and of all that it follows, from those that the joints name.  Each joint is
/// visited once (is_known): followers may be long chains.
void resolve(const robot_description &robot, const std::vector<leader_of_joint> &named, std::size_t joint,
             std::vector<leader_of_joint> &out, std::vector<bool> &is_known) {
  std::vector<std::size_t> path; // followers whose leader isn't known yet, each of which names the next
  std::size_t j = joint;
  for (; !is_known[j] && named[j].joint >= 0; j = index(named[j].joint)) {
    if (path.size() > robot.joints.size())
      refuse(robot, robot.joints[joint],
             "it mimics joint " + quoted(robot.joints[joint].mimic->joint) +
                 ", which in turn mimics others, back to itself: no joint leads; remove one <mimic>");
    path.push_back(j);
  }
  is_known[j] = true; // its leader has been found, or it follows none
  // q = m₁ q₁ + o₁ and q₁ = m₂ q₂ + o₂ give q = m₁ m₂ q₂ + m₁ o₂ + o₁; from the leader's end of the path, where the next one is known
  for (auto follower = path.rbegin(); follower != path.rend(); ++follower) {
    const leader_of_joint &own = named[*follower], &next = out[index(own.joint)];
    out[*follower] = own;
    if (next.joint >= 0)
      out[*follower] = {next.joint, own.multiplier * next.multiplier, own.multiplier * next.offset + own.offset};
    if (!std::isfinite(out[*follower].multiplier) || !std::isfinite(out[*follower].offset))
      refuse(robot, robot.joints[*follower],
             "its multiplier or offset is not finite, together with those of the joints that it mimics; correct them");
    is_known[*follower] = true;
  }
}

/// As python/ksl/base/judged.py has them for formats that are read there.
constexpr double least_ratio = 1e-9, largest_ratio = 1e9, largest_offset = 1e9;

} // namespace

std::vector<std::string> check_couplings(const robot_description &robot) {
  std::vector<std::string> lines;
  for (const joint_description &joint : robot.joints) {
    if (!joint.mimic)
      continue;
    const double multiplier = joint.mimic->multiplier, offset = joint.mimic->offset, size = std::fabs(multiplier);
    const int line = joint.mimic->at.line ? joint.mimic->at.line : joint.at.line;
    const std::string who = "joint " + joint.name + (line ? " (line " + std::to_string(line) + ")" : "") +
                            ": it mimics " + joint.mimic->joint;
    if (multiplier == 0)
      lines.push_back(text::printable(who + " with a multiplier of 0: it stands still at " + text::shown(offset) +
                                      ", wherever that one is; make it a fixed joint if that is meant"));
    else if (size < least_ratio || size > largest_ratio)
      lines.push_back(text::printable(who + " with a multiplier of " + text::shown(multiplier) +
                                      "; expected a magnitude of " + text::shown(least_ratio) + " to " +
                                      text::shown(largest_ratio)));
    if (std::fabs(offset) > largest_offset)
      lines.push_back(text::printable(who + " with an offset of " + text::shown(offset) +
                                      " rad or m; expected a magnitude of at most " + text::shown(largest_offset)));
  }
  return lines;
}

std::vector<leader_of_joint> leaders_of(const robot_description &robot) {
  std::map<std::string, int> by_name;
  for (std::size_t j = 0; j < robot.joints.size(); ++j)
    by_name.emplace(robot.joints[j].name, static_cast<int>(j));
  std::vector<leader_of_joint> named(robot.joints.size()), out(robot.joints.size());
  for (std::size_t j = 0; j < robot.joints.size(); ++j)
    if (const joint_description &joint = robot.joints[j]; joint.mimic)
      named[j] = {named_leader(robot, joint, by_name), joint.mimic->multiplier, joint.mimic->offset};
  std::vector<bool> is_known(robot.joints.size());
  for (std::size_t j = 0; j < robot.joints.size(); ++j)
    resolve(robot, named, j, out, is_known);
  return out;
}

} // namespace ksl
