#include "load/urdf_drives.hpp"

#include "ksl/engine/model/joints.hpp"

#include <set>

namespace ksl::readers {

namespace {

/// Appends a joint that a motor can move, once.
class drive_list {
public:
  explicit drive_list(const robot_description &robot) {
    for (const joint_description &joint : robot.joints)
      if (row_of(joint.kind).nv > 0 && !row_of(joint.kind).is_free && !joint.mimic)
        movable_.insert(joint.name);
  }
  void add(const std::string &name) {
    if (movable_.erase(name) > 0)
      names.push_back(name);
  }
  std::vector<std::string> names;

private:
  std::set<std::string> movable_;
};

} // namespace

std::vector<std::string> driven_joints(pugi::xml_node robot, const robot_description &description) {
  drive_list drives(description);
  for (const pugi::xml_node child : robot.children()) {
    const std::string_view tag = child.name();
    if (tag == "transmission" && child.child("actuator"))
      for (const pugi::xml_node joint : child.children("joint"))
        drives.add(joint.attribute("name").value());
    if (tag == "ros2_control")
      for (const pugi::xml_node joint : child.children("joint"))
        if (joint.child("command_interface"))
          drives.add(joint.attribute("name").value());
  }
  return drives.names;
}

} // namespace ksl::readers
