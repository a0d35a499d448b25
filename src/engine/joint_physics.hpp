// The physics of joints: from a description to the arrays of a model.
#pragma once

#include "ksl/model.hpp"

namespace ksl {

/// The physics of each of nv coordinates as far as robot.physics names it; empty if it names none.  joints: those that move, with the
/// places of their numbers.  Adds a line to robot.unused for what the robot has and robot.physics doesn't name.  Throws
/// description_error for values that no joint can have.
std::vector<coordinate_physics<double>> joint_physics(robot_description &robot, const std::vector<joint_row> &joints, int nv);

} // namespace ksl
