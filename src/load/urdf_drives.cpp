// A joint has a motor where a <transmission> has an <actuator> for it, or <ros2_control> a <command_interface>.  Joints that only report their state
// have a <state_interface> alone.
#include "load/urdf_drives.hpp"

#include "ksl/engine/model/joints.hpp"

namespace ksl::readers {

namespace {

/// Calls step(joint, tag) for what says that a joint has a motor.
template <class Step> void for_each_motor(pugi::xml_node robot, Step step) {
  for (const pugi::xml_node child : robot.children()) {
    const std::string_view tag = child.name();
    if (tag == "transmission" && child.child("actuator"))
      for (const pugi::xml_node joint : child.children("joint"))
        step(joint.attribute("name").value(), "transmission");
    if (tag == "ros2_control")
      for (const pugi::xml_node joint : child.children("joint"))
        if (joint.child("command_interface"))
          step(joint.attribute("name").value(), "command_interface");
  }
}

/// Appends a joint that a motor can move, once.
class drive_list {
public:
  drive_list(const robot_description &robot, text::unused_list &unused) : unused_(unused) {
    for (const loop_description &loop : robot.loops)
      closing_.insert(loop.name);
    for (const joint_description &joint : robot.joints)
      if (row_of(joint.kind).nv > 0 && !row_of(joint.kind).is_free && !joint.mimic)
        movable_.insert(joint.name);
  }
  void add(const std::string &name, const char *tag) {
    if (movable_.erase(name) > 0)
      names.push_back(name);
    if (closing_.count(name) > 0)
      unused_.in_joint(tag, "no drive, since the joint closes a loop", name);
  }
  std::vector<std::string> names;

private:
  std::set<std::string> movable_, closing_;
  text::unused_list &unused_;
};

} // namespace

std::set<std::string> joints_with_motors(pugi::xml_node robot) {
  std::set<std::string> names;
  for_each_motor(robot, [&](const std::string &name, const char *) { names.insert(name); });
  return names;
}

std::vector<std::string> driven_joints(pugi::xml_node robot, const robot_description &description,
                                       text::unused_list &unused) {
  drive_list drives(description, unused);
  for_each_motor(robot, [&](const std::string &name, const char *tag) { drives.add(name, tag); });
  return drives.names;
}

} // namespace ksl::readers
