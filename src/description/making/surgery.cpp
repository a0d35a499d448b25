// Robots made from other robots, on descriptions.  The one that needs the pose of a joint is in engine/run/frozen_joints.cpp.
//
// What refers to links and joints, and so has to follow where lists of them change:
//
//     by index of links    joint.parent and .child;  loop.predecessor and .successor;  force element link1 and link2
//     by name of joints    mimic.joint;  drives;  compliances, whose empty name is the joint to the ground
#include "ksl/surgery.hpp"

#include "description/parts/rigid_pose.hpp"
#include "description/structure/check.hpp"
#include "description/parts/items.hpp"
#include "description/parts/joint_numbers.hpp"
#include "description/structure/loops.hpp"
#include "description/structure/mimic.hpp"
#include "description/making/reversed_compliance.hpp"
#include "ksl/engine/model/joints.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>

namespace ksl {

namespace {

using namespace surgery;
using A = algebra<double>;
using text::has_name;
using text::quoted;

int find_link(const robot_description &robot, const std::string &name) {
  return find(robot.links, name, "link", robot.name);
}

/// Index of the joint that carries each link; −1 for the root.
std::vector<int> joints_above(const robot_description &robot) {
  std::vector<int> above(robot.links.size(), -1);
  for (std::size_t j = 0; j < robot.joints.size(); ++j)
    above[index(robot.joints[j].child)] = static_cast<int>(j);
  return above;
}

bool is_identity(const SE3<double> &D) {
  const mat3x3<double> &R = D.R;
  return D.t.x == 0 && D.t.y == 0 && D.t.z == 0 && R.m00 == 1 && R.m11 == 1 && R.m22 == 1;
}

vec3<double> negative(const vec3<double> &v) { return {-v.x, -v.y, -v.z}; }

/// Reverses a joint.  If it has an axis, it also adds the weld to the link that was the joint's parent (with_root).
///
///     before   parent ──placement──→ [joint: axis u] child
///     after    child ──[joint: axis −u]──→ NAME_frame ──placement⁻¹, welded──→ parent
///
/// The joint's frame is the child's, so that it comes first now, and its placement behind it.  With −u positions keep their meaning.
void reverse(robot_description &robot, int j) {
  joint_description &joint = robot.joints[index(j)];
  SE3<double> back; // of the parent link in the joint's frame
  A::SE3_inverted(&joint.placement, &back);
  std::swap(joint.parent, joint.child);
  if (joint.kind == joint_kind::fixed) {
    joint.placement = back;
    return;
  }
  joint.axis = negative(axis_of(joint));
  joint.given.axis = negative(joint.given.axis);
  if (is_identity(joint.placement))
    return;
  joint.placement = no_displacement;
  const std::string frame = free_name(robot.links, joint.name + "_frame");
  const int old_parent = joint.child;
  joint.child = static_cast<int>(robot.links.size());
  robot.links.push_back(massless(frame));
  robot.joints.push_back(weld(free_joint_name(robot, frame + "_joint"), joint.child, old_parent, back));
}

/// Refuses a joint that can't be reversed: only a screw motion about one axis is, reversed, the same motion about the opposite axis.
void check_reversible(const joint_description &joint, const std::string &link) {
  if (joint.is_rotor)
    refuse("link " + quoted(link) + " is the rotor of joint " + (joint.mimic ? joint.mimic->joint : joint.name) +
           ", on which a robot can't stand; take another link for the root");
  const joint_kind_row row = row_of(joint.kind);
  if (row.nv == 0 || (row.has_axis && row.nv < 3 && !row.has_axis2))
    return;
  refuse("joint " + joint.name + " is " + row.name + ", and would have to be reversed to make link " + link +
         " the root: only joints on one axis keep the meaning of their positions; take a root on the parent side of "
         "that joint");
}

bool has_joint(const robot_description &robot, const std::string &name) {
  return has_name(robot.joints, name) || has_name(robot.loops, name);
}

/// Refuses the name of a joint that another robot brings.
void check_new(const robot_description &robot, const std::string &joint) {
  if (has_joint(robot, joint))
    refuse("both robots have a joint named " + quoted(joint) + "; give a prefix for the names of the second");
}

/// The joints of a robot that have a motor, if that is known: of a tree all that can have one.
std::optional<std::vector<std::string>> known_drives(const robot_description &robot) {
  if (robot.drives || !robot.loops.empty())
    return robot.drives;
  std::vector<std::string> all;
  for (const joint_description &joint : robot.joints)
    if (const joint_kind_row row = row_of(joint.kind); row.nv > 0 && !row.is_free && !joint.mimic)
      all.push_back(joint.name);
  return all;
}

/// The drives of both robots, which become one (merged).
std::optional<std::vector<std::string>> merged_drives(const robot_description &robot, const robot_description &other,
                                                      const std::string &prefix) {
  std::optional<std::vector<std::string>> all = known_drives(robot), more = known_drives(other);
  if ((!robot.drives && !other.drives) || !all || !more)
    return {};
  for (const std::string &joint : *more)
    all->push_back(prefix + joint);
  return all;
}

/// The items between two links, loops or force elements, of which both links are in a part of a robot (subtree).  refused(item, link): the
/// sentence about one that goes to a link outside.
template <class Item, class Sentence>
std::vector<Item> inside(const std::vector<Item> &items, int Item::*first, int Item::*second,
                         const std::vector<int> &new_index, bool drop, const Sentence &refused) {
  std::vector<Item> kept;
  for (Item item : items) {
    const int a = new_index[index(item.*first)], b = new_index[index(item.*second)];
    if ((a < 0) != (b < 0) && !drop)
      refuse(refused(item, a < 0 ? item.*first : item.*second));
    item.*first = a, item.*second = b;
    if (a >= 0 && b >= 0)
      kept.push_back(std::move(item));
  }
  return kept;
}

/// Gives a part of a robot (subtree) the loops and the force elements that are inside it.
void take_between_links(const robot_description &robot, const std::vector<int> &new_index, const std::string &link,
                        const subtree_options &options, robot_description &out) {
  const auto named = [&](int outside) { return robot.links[index(outside)].name; };
  const std::string how = ": loops=\"drop\" in Python, drop_loops in C++";
  out.loops = inside(robot.loops, &loop_description::predecessor, &loop_description::successor, new_index,
                     options.drop_loops, [&](const loop_description &loop, int outside) {
                       return "joint " + loop.name + " closes a loop over link " + named(outside) + ", which link " +
                              quoted(link) +
                              " doesn't carry; take a link that carries all of the loop, or drop such loops" + how;
                     });
  out.force_elements =
      inside(robot.force_elements, &force_element_description::link1, &force_element_description::link2, new_index,
             options.drop_loops, [&](const force_element_description &of, int outside) {
               return "force element " + quoted(of.name) + " acts on link " + named(outside) + ", which link " +
                      quoted(link) + " doesn't carry; take a link that carries both of its ends, or drop it" + how;
             });
}

/// Appends a line unless it is there.
void add_line(std::vector<std::string> &lines, const std::string &line) {
  if (std::find(lines.begin(), lines.end(), line) == lines.end())
    lines.push_back(line);
}

bool is_of_ground(const joint_compliance &of) { return of.joint.empty(); }

/// A stiffness of the ground's joint is that of what a root stands on, which a robot with another root doesn't have.
std::string left_stiffness(const std::string &root, const std::string &now) {
  return "the stiffness of the joint that fixes link " + quoted(root) + " to the ground is left out: " + now +
         "; give that joint a stiffness if it gives way: with_stiffness in Python, with_compliances in C++";
}

/// The ground's joint is rigid again, and carries another root.  Returns what to say of it, if it had a stiffness.
std::vector<std::string> free_ground(robot_description &robot, const std::string &old_root, const std::string &root) {
  if (std::erase_if(robot.compliances, is_of_ground) == 0)
    return {};
  return {left_stiffness(old_root, "the ground carries link " + quoted(root))};
}

} // namespace

robot_description with_root(const robot_description &robot, const std::string &link) {
  const int old_root = check_tree(robot);
  robot_description out = robot;
  //     old root ─→ a ─→ b ─→ link         becomes        link ─→ b ─→ a ─→ old root
  //
  // Branches beside this path stay as they are: their joints lead away from both roots.
  std::vector<int> path; // from the new root up to the old one
  const std::vector<int> above = joints_above(robot);
  for (int l = find_link(robot, link); above[index(l)] >= 0; l = robot.joints[index(path.back())].parent)
    path.push_back(above[index(l)]);
  for (const int j : path)
    check_reversible(robot.joints[index(j)], link);
  for (const int j : path) {
    reverse_compliance(out, robot.joints[index(j)], link);
    reverse(out, j);
  }
  if (!path.empty())
    for (const std::string &line : free_ground(out, robot.links[index(old_root)].name, link))
      add_line(out.warnings, line);
  return out;
}

robot_description with_payload(const robot_description &robot, const std::string &link, const link_mass &payload) {
  builder alone("payload"); // it checks the payload as it checks links
  alone.add_link("payload on " + link, payload);
  robot_description out = robot;
  link_description &carrier = out.links[index(find_link(robot, link))];
  const auto &[mass, center, J] = payload;
  spatial_inertia<double> I;
  A::spatial_inertia_fromMassCentroid(mass, &center, J.m00, J.m11, J.m22, J.m10, J.m21, J.m20, &I);
  A::spatial_inertia_added(&carrier.inertia, &I, &carrier.inertia);
  carrier.has_inertial = true;
  for (const std::string &line : alone.description().warnings)
    add_line(out.warnings, line);
  return out;
}

// Links and joints of both, one list behind the other: index i of `other` becomes links + i.  Its root hangs on a new joint, the mount.
//
//     links     robot: 0 … links − 1  |  other: links …
//     joints    robot                 |  mount  |  other
robot_description merged(const robot_description &robot, const robot_description &other, const std::string &parent_link,
                         const SE3<double> &pose, const std::string &prefix) {
  if (robot.gravity != other.gravity)
    refuse("robots " + quoted(robot.name) + " and " + quoted(other.name) +
           " have different gravity; load both with the same");
  if (text::printable(prefix) != prefix)
    refuse("prefix " + quoted(prefix) + " has a control character, or is not UTF-8; give another one");
  robot_description out = robot;
  const int parent = find_link(robot, parent_link), links = static_cast<int>(robot.links.size()),
            root = check_tree(other);
  joint_description mount = weld(prefix + (other.floating_base ? "floating_base" : "mount"), parent, links + root,
                                 rigid_pose("robot " + quoted(other.name) + ": its pose", pose));
  if (other.floating_base)
    mount.kind = joint_kind::floating;
  mount.name = text::free_name(mount.name, [&](const std::string &name) {
    return has_joint(robot, name) ||
           (name.compare(0, prefix.size(), prefix) == 0 && has_joint(other, name.substr(prefix.size())));
  });
  const std::string mount_name = mount.name;
  out.joints.push_back(std::move(mount));
  for (link_description link : other.links) {
    link.name = prefix + link.name;
    if (has_name(robot.links, link.name))
      refuse("both robots have a link named " + quoted(link.name) + "; give a prefix for the names of the second");
    link.at = {}; // a line of another file
    out.links.push_back(std::move(link));
  }
  for (joint_description joint : other.joints) {
    joint.name = prefix + joint.name;
    if (joint.mimic)
      joint.mimic->joint = prefix + joint.mimic->joint;
    check_new(robot, joint.name);
    joint.at = {};
    if (joint.mimic)
      joint.mimic->at = {};
    joint.parent += links, joint.child += links;
    out.joints.push_back(std::move(joint));
  }
  for (loop_description loop : other.loops) {
    loop.name = prefix + loop.name;
    check_new(robot, loop.name);
    loop.at = {};
    loop.predecessor += links, loop.successor += links;
    out.loops.push_back(std::move(loop));
  }
  for (force_element_description of : other.force_elements) {
    of.name = prefix + of.name;
    if (has_name(robot.force_elements, of.name))
      refuse("both robots have a force element named " + quoted(of.name) +
             "; give a prefix for the names of the second");
    of.at = {};
    of.link1 += links, of.link2 += links;
    out.force_elements.push_back(std::move(of));
  }
  // where one of them names drives, those of a tree are all its joints that can have a motor
  // weights   [ of robot's drives | of other's ], 1 where a robot has none
  out.drives = merged_drives(robot, other, prefix);
  out.drive_weights.clear();
  if (out.drives && (!robot.drive_weights.empty() || !other.drive_weights.empty()))
    for (const robot_description *of : {&robot, &other}) {
      std::vector<double> weights = of->drive_weights;
      weights.resize(known_drives(*of)->size(), 1.0);
      out.drive_weights.insert(out.drive_weights.end(), weights.begin(), weights.end());
    }
  for (joint_compliance compliance : other.compliances) {
    if (is_of_ground(compliance)) {
      add_line(out.warnings, left_stiffness(prefix + other.links[index(root)].name,
                                            "joint " + quoted(mount_name) + " carries that link"));
      continue;
    }
    compliance.joint = prefix + compliance.joint;
    out.compliances.push_back(std::move(compliance));
  }
  for (const std::string &line : other.warnings)
    add_line(out.warnings, other.name + ": " + line);
  for (const std::string &line : other.unused)
    add_line(out.unused, other.name + ": " + line);
  return out;
}

/// What the link carries, with the link as the root: joints, loops and elements that are inside, numbered anew in their old order.
robot_description subtree(const robot_description &robot, const std::string &link, const subtree_options &options) {
  const int root = find_link(robot, link), old_root = check_tree(robot);
  const std::vector<int> above = joints_above(robot);
  // what the link carries, depth first
  std::vector<bool> belongs(robot.links.size(), false);
  std::vector<std::vector<int>> children(robot.links.size());
  for (const joint_description &joint : robot.joints)
    children[index(joint.parent)].push_back(joint.child);
  for (std::vector<int> pending = {root}; !pending.empty();) {
    const int l = pending.back();
    pending.pop_back();
    belongs[index(l)] = true;
    pending.insert(pending.end(), children[index(l)].begin(), children[index(l)].end());
  }
  robot_description out = robot;
  out.floating_base = robot.floating_base && above[index(root)] < 0;
  out.links.clear(), out.joints.clear(), out.warnings.clear();
  // (old links): the index in the part, −1 for what stays behind
  std::vector<int> new_index(robot.links.size(), -1);
  for (std::size_t l = 0; l < robot.links.size(); ++l)
    if (belongs[l]) {
      new_index[l] = static_cast<int>(out.links.size());
      out.links.push_back(robot.links[l]);
    }
  const std::vector<leader_of_joint> leaders = leaders_of(robot);
  const auto is_inside = [&](const joint_description &joint) {
    return new_index[index(joint.parent)] >= 0 && new_index[index(joint.child)] >= 0;
  };
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    joint_description joint = robot.joints[j];
    // a mimics b by (m₁, o₁), b mimics c by (m₂, o₂), and b stays behind: a then names c itself, by (m₁ m₂, m₁ o₂ + o₁)
    if (leaders[j].joint >= 0 && is_inside(joint)) { // the joint that it names may be a follower, and left behind
      const joint_description &leader = robot.joints[index(leaders[j].joint)];
      if (!is_inside(leader))
        refuse("joint " + joint.name + " follows joint " + leader.name + ", which link " + quoted(link) +
               " doesn't carry; take a link that carries both, or load the robot with mimic=\"independent\"");
      const auto named = std::find_if(robot.joints.begin(), robot.joints.end(),
                                      [&](const joint_description &other) { return other.name == joint.mimic->joint; });
      if (!is_inside(*named))
        joint.mimic = {leader.name, leaders[j].multiplier, leaders[j].offset, joint.mimic->at};
    }
    joint.parent = new_index[index(joint.parent)], joint.child = new_index[index(joint.child)];
    if (joint.parent >= 0 && joint.child >= 0)
      out.joints.push_back(std::move(joint));
  }
  take_between_links(robot, new_index, link, options, out);
  keep_drives(out);
  out.warnings = check_inertias(out);
  if (above[index(root)] >= 0)
    for (const std::string &line : free_ground(out, robot.links[index(old_root)].name, link))
      add_line(out.warnings, line);
  return out;
}

robot_description with_frame(const robot_description &robot, const std::string &name, const std::string &link,
                             const SE3<double> &pose) {
  robot_description out = robot;
  const int parent = find_link(robot, link), child = static_cast<int>(robot.links.size());
  if (name.empty() || text::printable(name) != name)
    refuse("frame " + quoted(name) + ": give it a name without control characters");
  if (has_name(robot.links, name))
    refuse("frame " + quoted(name) + ": a link of robot " + quoted(robot.name) + " has that name; give it another");
  out.links.push_back(massless(name));
  out.joints.push_back(
      weld(free_joint_name(robot, name + "_joint"), parent, child, rigid_pose("frame " + name + ": its pose", pose)));
  return out;
}

} // namespace ksl
