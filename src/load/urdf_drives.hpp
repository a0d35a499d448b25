// Which joints of a URDF file have motors.
#pragma once

#include "ksl/engine/model/description.hpp"
#include "text/unused.hpp"

#include <pugixml.hpp>

#include <set>
#include <string>
#include <vector>

namespace ksl::readers {

/// The names of joints that have a motor in a <transmission> with an <actuator>, or a <command_interface> in <ros2_control>.
std::set<std::string> joints_with_motors(pugi::xml_node robot);

/// The joints with motors that can be drives, in the order of the file: joints that are fixed, that close a loop or that follow another are left out.
/// Empty where the file names none.
std::vector<std::string> driven_joints(pugi::xml_node robot, const robot_description &description,
                                       text::unused_list &unused);

} // namespace ksl::readers
