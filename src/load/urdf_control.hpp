// What <ros2_control> says of joints besides which of them have motors: mimics, and limits of commands.
//
//     ros2_control
//       joint                    name, mimic: "false" where it has a motor of its own although <mimic> is in its <joint>
//         param                  name="mimic": the leader's name; name="multiplier", name="offset": numbers
//         command_interface      name="position", "velocity" or "effort"
//           param                name="min", name="max": numbers
#pragma once

#include "load/unread.hpp"
#include "text/unused.hpp"

namespace ksl::readers {

/// Joints with <param name="mimic">, <param name="multiplier"> and <param name="offset">.  Refuses other parameters of a joint that name another one.
std::vector<stated_mimic> mimics_of_control(const text::xml_file &file, const part_names &names, left_out option);

/// Joints that <ros2_control> commands by themselves, by mimic="false", although their <joint> may say that they follow.
std::vector<std::string> followers_denied(const text::xml_file &file);

/// Limits of joints with one coordinate, from the parameters min and max of a <command_interface>: of effort and velocity where they are
/// tighter than those of <limit>, of position where <limit> has none.  What was taken is a line of the robot's warnings.
void read_limits_of_control(const text::xml_file &file, robot_description &robot, text::unused_list &unused);

} // namespace ksl::readers
