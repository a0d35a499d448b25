// Joints that close loops, and drives, in descriptions.
#pragma once

#include "ksl/engine/model/description.hpp"

namespace ksl {

/// A joint that closes a loop as one of a tree, from its predecessor to its successor, for what both have: kind, axes, pitch.
joint_description as_tree_joint(const loop_description &loop);

/// Throws description_error for loop joints that can't close a loop: names that are empty or another joint's, links that aren't there or
/// are the same, a floating joint, axes and pitches that their kind can't have; and for drives that are no joints of the tree, that are
/// fixed, or that follow another joint.  The joints of the tree have been checked.
void check_loops(const robot_description &robot);

} // namespace ksl
