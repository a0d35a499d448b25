// What elements of URDF name: kinds of joints, links.
#pragma once

#include "text/element.hpp"

#include "ksl/engine/model/description.hpp"

#include <map>

namespace ksl::readers {

using text::element;

/// The kind that the type of a joint names.
joint_kind kind_in(const element &joint);

/// The links of a robot that is being read, by name.
struct links_by_name {
  const robot_description &robot;
  std::map<std::string, int> index; ///< in robot.links; of links of one name the first
};

/// The index of the link that a child of an element names in an attribute: <parent link="...">.
int link_in(const element &joint, const char *tag, const links_by_name &links);

} // namespace ksl::readers
