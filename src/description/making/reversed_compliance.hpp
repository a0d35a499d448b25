// The compliance of a joint whose parent and child change places.
#pragma once

#include "ksl/engine/model/description.hpp"

#include <string>

namespace ksl {

/// Expresses the compliance of a joint, if the robot gives it one, at the frame that is the child's once the joint is reversed; `joint` is as it
/// was.  The frames of a joint that moves coincide where it is at zero only, so that a compliance that turns or slides with one of them is
/// refused.  link: the new root, for the message.
void reverse_compliance(robot_description &robot, const joint_description &joint, const std::string &link);

} // namespace ksl
