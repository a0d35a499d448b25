// What remains of the displacement across the joint of a loop once the joint has the position that fits it best.
#pragma once

#include "engine/loops/tables.hpp"

namespace ksl::loops {

/// Has a kind two axes, one fixed on each side, so that its constraint wrenches depend on its position?
bool row_has_two_axes(joint_kind kind);

/// The displacement left, (translation, rotation vector), in the axes of the joint's frame on the successor: zero where the loop is
/// closed.  relative: the pose of this frame in the one on the predecessor.  Of the positions of a helical joint it takes the turn
/// nearest to travel / pitch.
screw<double> displacement_left(const loop &l, const SE3<double> &relative);

} // namespace ksl::loops
