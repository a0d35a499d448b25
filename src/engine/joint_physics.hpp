// The physics of joints: from a description to the arrays of a model.
#pragma once

#include "ksl/model.hpp"

namespace ksl {

/// The physics of each coordinate as far as the options name it; empty if they name none.  Adds a line to robot.unused for what
/// the robot has and the options don't name.  Throws description_error for values that no joint can have.
std::vector<coordinate_physics<double>> joint_physics(robot_description &robot, const std::vector<joint_row> &joints, int nv,
                                                      const physics_options &options);

} // namespace ksl
