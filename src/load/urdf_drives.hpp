// Which joints of a URDF file have motors.
#pragma once

#include "ksl/engine/model/description.hpp"
#include "text/unused.hpp"

#include <pugixml.hpp>

namespace ksl::readers {

/// The joints that have a motor in a <transmission> with an <actuator>, or a <command_interface> in <ros2_control>, in the order of the
/// file.  Joints that are fixed, that close a loop or that follow another are left out.  Empty where the file names none.
std::vector<std::string> driven_joints(pugi::xml_node robot, const robot_description &description,
                                       text::unused_list &unused);

} // namespace ksl::readers
