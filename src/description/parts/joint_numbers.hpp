// The numbers of one joint, of the tree or one that closes a loop.
#pragma once

#include "ksl/engine/model/description.hpp"

namespace ksl {

/// The axis of a joint: the usual one of its kind if the description gives none.
vec3<double> axis_of(const joint_description &joint);

/// Throws description_error for a joint whose numbers are not finite, whose axes are no unit vectors, or whose pitch is missing.
void check_joint_numbers(const robot_description &robot, const joint_description &joint);

} // namespace ksl
