#include "load/urdf_control.hpp"

#include "ksl/engine/model/joints.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::readers {

namespace {

std::string param(pugi::xml_node of, const char *name) {
  return std::string(text::trimmed(of.find_child_by_attribute("param", "name", name).child_value()));
}

/// Calls step(joint) for each <joint> of each <ros2_control>.
template <class Step> void for_each_joint(const text::xml_file &file, Step step) {
  for (const pugi::xml_node control : file.root().children("ros2_control"))
    for (const pugi::xml_node joint : control.children("joint"))
      step(joint);
}

double number_of(const text::xml_file &file, pugi::xml_node joint, const char *name, double otherwise) {
  const std::string given = param(joint, name);
  if (given.empty())
    return otherwise;
  if (const auto number = text::number_in(given))
    return *number;
  file.refuse(joint, "joint " + std::string(joint.attribute("name").value()) + ": its <param name=\"" + name +
                         "\"> is " + text::quoted(given) + ", no number; write a finite decimal number such as 0.25");
}

/// The bound of a symmetric limit: the smaller of both sides, or the one that isn't zero.
optional_number magnitude(const optional_number &least, const optional_number &most) {
  const double a = least ? std::fabs(*least) : 0, b = most ? std::fabs(*most) : 0;
  if (a == 0 && b == 0)
    return std::nullopt;
  return a == 0 || b == 0 ? std::max(a, b) : std::min(a, b);
}

/// Into a limit of which 0 stands for none, if it is tighter.
bool tighten(optional_number &limit, const optional_number &by) {
  if (!by || (limit && *limit > 0 && *limit <= *by))
    return false;
  limit = by;
  return true;
}

} // namespace

std::vector<stated_mimic> mimics_of_control(const text::xml_file &file, const part_names &names, left_out option) {
  std::vector<stated_mimic> found;
  for_each_joint(file, [&](pugi::xml_node joint) {
    const std::string name = joint.attribute("name").value(), leader = param(joint, "mimic");
    if (!names.is_joint(name))
      return;
    if (!leader.empty())
      found.push_back(
          {joint, name, leader, number_of(file, joint, "multiplier", 1), number_of(file, joint, "offset", 0)});
    for (const pugi::xml_node each : joint.children("param"))
      if (each.attribute("name").value() != std::string_view("mimic"))
        refuse_if_joining(file, names, each, option);
  });
  return found;
}

std::vector<std::string> followers_denied(const text::xml_file &file) {
  std::vector<std::string> found;
  for_each_joint(file, [&](pugi::xml_node joint) {
    if (text::trimmed(joint.attribute("mimic").value()) == "false")
      found.emplace_back(joint.attribute("name").value());
  });
  return found;
}

void read_limits_of_control(const text::xml_file &file, robot_description &robot, text::unused_list &unused) {
  std::map<std::string, std::size_t> index;
  for (std::size_t j = 0; j < robot.joints.size(); ++j)
    index.try_emplace(robot.joints[j].name, j);
  std::map<std::string, std::set<std::string>> taken; // joint: what of it
  for_each_joint(file, [&](pugi::xml_node node) {
    const auto at = index.find(node.attribute("name").value());
    if (at == index.end() || row_of(robot.joints[at->second].kind).nv != 1)
      return;
    joint_description &joint = robot.joints[at->second];
    for (const pugi::xml_node command : node.children("command_interface")) {
      const std::string what = command.attribute("name").value(), min = param(command, "min"),
                        max = param(command, "max");
      const optional_number least = text::number_in(min), most = text::number_in(max);
      if ((!min.empty() && !least) || (!max.empty() && !most) || (least && most && *least > *most)) {
        unused.in_joint("min, max of <command_interface>", "no numbers, not used", joint.name);
        continue;
      }
      bool is_taken = false;
      if (what == "effort")
        is_taken = tighten(joint.effort, magnitude(least, most));
      else if (what == "velocity")
        is_taken = tighten(joint.velocity, magnitude(least, most));
      else if (what == "position" && row_of(joint.kind).has_limits && !joint.lower && !joint.upper)
        joint.lower = least, joint.upper = most, is_taken = least || most;
      if (is_taken)
        taken[joint.name].insert(what);
    }
  });
  std::map<std::string, std::vector<std::string>> said; // what: of which joints
  for (const auto &[name, whats] : taken)
    said[text::listed({whats.begin(), whats.end()})].push_back(name);
  for (const auto &[what, joints] : said)
    robot.warnings.push_back(text::printable("joint " + text::listed(joints) + ": limits of " + what +
                                             " are those of <command_interface> in <ros2_control>, since <limit> has "
                                             "none or wider ones"));
}

} // namespace ksl::readers
