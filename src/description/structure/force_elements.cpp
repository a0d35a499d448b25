// Checks of force elements (force_element_numbers says what they do).  All numbers are magnitudes but the preload, which pushes where it is negative; a
// length is never negative, so that a limit below zero could only be a slip.
#include "description/structure/force_elements.hpp"

#include "ksl/surgery.hpp"
#include "text/words.hpp"

#include <cmath>
#include <set>

namespace ksl {
namespace {

[[noreturn]] void refuse(const robot_description &robot, const force_element_description &of, const std::string &what) {
  text::refuse(robot.file, of.at.line, "force element " + text::quoted(of.name) + ": " + what);
}

void check_links(const robot_description &robot, const force_element_description &of) {
  const int n = static_cast<int>(robot.links.size());
  for (const int link : {of.link1, of.link2})
    if (link < 0 || link >= n)
      refuse(robot, of,
             "one of its links is number " + std::to_string(link) + ", expected 0 to " + std::to_string(n - 1) +
                 "; add both links before it");
  if (of.link1 == of.link2)
    refuse(robot, of,
           "both of its points are on link " + text::quoted(robot.links[static_cast<std::size_t>(of.link1)].name) +
               "; name two links");
}

void check_numbers(const robot_description &robot, const force_element_description &of) {
  const force_element_numbers &x = of.numbers;
  for (const vec3<double> &p : {of.point1, of.point2})
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      refuse(robot, of, "one of its points is not finite; give three numbers, m, in the link's frame");
  const struct {
    const char *name;
    double value;
  } positive[] = {{"stiffness", x.stiffness},           {"free_length", x.free_length}, {"damping", x.damping},
                  {"stop_stiffness", x.stop_stiffness}, {"lower", x.lower.value_or(0)}, {"upper", x.upper.value_or(0)}};
  for (const auto &[name, value] : positive)
    if (!(value >= 0 && std::isfinite(value)))
      refuse(robot, of, std::string(name) + " is " + text::shown(value) + "; expected a number that is not negative");
  if (!std::isfinite(x.preload))
    refuse(robot, of, "preload is " + text::shown(x.preload) + "; expected a number, N, positive where it pulls");
  if (x.lower && x.upper && *x.lower > *x.upper)
    refuse(robot, of,
           "its lower limit " + text::shown(*x.lower) + " is above its upper " + text::shown(*x.upper) + "; swap them");
  if (x.stop_stiffness > 0 && !x.lower && !x.upper)
    refuse(robot, of, "it has a stop_stiffness and no limit; give lower or upper, or leave it out");
}

} // namespace

void check_force_elements(const robot_description &robot) {
  std::set<std::string> names;
  for (const force_element_description &of : robot.force_elements) {
    if (of.name.empty())
      text::refuse(robot.file, of.at.line, "a force element has no name; give it one");
    if (text::printable(of.name) != of.name)
      refuse(robot, of, "its name has a control character, or is not UTF-8; give it another name");
    if (!names.insert(of.name).second)
      refuse(robot, of, "a second one has that name; rename one of them");
    check_links(robot, of);
    check_numbers(robot, of);
  }
}

robot_description with_force_elements(robot_description robot, std::vector<force_element_description> elements) {
  for (force_element_description &of : elements)
    robot.force_elements.push_back(std::move(of));
  check_force_elements(robot);
  return robot;
}

} // namespace ksl
