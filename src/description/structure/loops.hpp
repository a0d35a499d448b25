// Joints that close loops, and drives, in descriptions.
#pragma once

#include "ksl/engine/model/description.hpp"

#include <utility>

namespace ksl {

/// A joint that closes a loop as one of a tree, from its predecessor to its successor, for what both have: kind, axes, pitch.
joint_description as_tree_joint(const loop_description &loop);

/// A joint as one that closes a loop: on its child, its frame is the link's.
loop_description as_loop(const joint_description &joint);

/// What a joint has, of what a joint that closes a loop can't have: "limit", "mimic", "dynamics".
std::vector<std::string> lost_in_loop(const joint_description &joint);

/// Which joints of a graph form a tree from its roots, the links that are no joint's child: of the joints that carry one link the first that
/// is preferred, or else the first, unless the link would be cut off from the roots by it.  joints: parent and child of each.  Links that no
/// root leads to keep that joint.  preferred: of each joint; none where it is empty.  O(n log n).
std::vector<bool> spanning_tree(std::size_t links, const std::vector<std::pair<int, int>> &joints,
                                const std::vector<bool> &preferred = {});

/// The name of the joint that a model adds under a root that floats: floating_base, unless a joint of the file has that name.
std::string floating_base_name(const robot_description &robot);

/// Removes drives of joints that the robot has no more, or that are fixed, and compliances of joints that it has no more.
void keep_drives(robot_description &robot);

/// Throws description_error for loop joints that can't close a loop: names that are empty or another joint's, links that aren't there or
/// are the same, a floating joint, axes and pitches that their kind can't have; and for drives that are no joints of the tree, that are
/// fixed, or that follow another joint.  The joints of the tree have been checked.
void check_loops(const robot_description &robot);

} // namespace ksl
