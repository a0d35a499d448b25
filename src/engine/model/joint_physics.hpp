// The physics of joints: from a description to the arrays of a model.
#pragma once

#include "ksl/model.hpp"

namespace ksl {

/// The description with a body for each rotor if its options say so, and without any otherwise.  The rotor of a joint with one
/// coordinate is a link JOINT_rotor on the joint's parent link, whose inertia is that about the joint's axis alone.  It turns about
/// this axis gear_ratio times for each turn of the joint, as a mimic joint.  Rotors that are there already stay where they are.
robot_description with_rotors(robot_description robot);

/// The physics of each of nv coordinates as far as robot.physics names it; empty if it names none.  joints: those that move, with the
/// places of their numbers.  Adds a line to robot.unused for what the robot has and robot.physics doesn't name.  Throws
/// description_error for values that no joint can have.
std::vector<coordinate_physics<double>> joint_physics(robot_description &robot, const std::vector<joint_row> &joints,
                                                      int nv);

} // namespace ksl
