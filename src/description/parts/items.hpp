// What functions that make robots from robots share: items by name, and joints and links that are added.
#pragma once

#include "ksl/engine/model/description.hpp"
#include "text/words.hpp"

namespace ksl::surgery {

inline constexpr SE3<double> no_displacement = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};

inline std::size_t index(int i) { return static_cast<std::size_t>(i); }

[[noreturn]] inline void refuse(const std::string &what) { text::refuse({}, 0, what); }

/// The index of a link or joint.
template <class Items>
int find(const Items &items, const std::string &name, const std::string &kind, const std::string &robot) {
  std::vector<std::string> names;
  for (const auto &item : items) {
    if (item.name == name)
      return static_cast<int>(names.size());
    names.push_back(item.name);
  }
  refuse("robot " + text::quoted(robot) + " has no " + kind + " " + text::quoted(name) +
         text::suggestion(name, names, "name one of " + text::listed(names)));
}

/// A name that nothing in the list has.
template <class Items> std::string free_name(const Items &items, std::string name) {
  return text::free_name(std::move(name), [&](const std::string &other) { return text::has_name(items, other); });
}

/// A name that no joint of the robot has, those that close loops included.
inline std::string free_joint_name(const robot_description &robot, std::string name) {
  return text::free_name(std::move(name), [&](const std::string &other) {
    return text::has_name(robot.joints, other) || text::has_name(robot.loops, other);
  });
}

inline joint_description weld(std::string name, int parent, int child, const SE3<double> &pose) {
  joint_description joint;
  joint.name = std::move(name);
  joint.parent = parent;
  joint.child = child;
  joint.placement = pose;
  return joint;
}

inline link_description massless(std::string name) {
  link_description link;
  link.name = std::move(name);
  return link;
}

} // namespace ksl::surgery
