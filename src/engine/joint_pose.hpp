// How far a joint of any kind moves its child.
#pragma once

#include "ksl/engine/description.hpp"

namespace ksl {

/// The pose of the child link in the joint's frame at q, as many numbers as the kind has.
SE3<double> joint_pose(const joint_description &joint, const std::vector<double> &q);

} // namespace ksl
