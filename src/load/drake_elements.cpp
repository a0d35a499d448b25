#include "load/drake_elements.hpp"

#include "description/parts/given.hpp"
#include "text/words.hpp"

namespace ksl::readers {

namespace {

using text::element;

constexpr const char *ball = "drake:ball_constraint", *spring = "drake:linear_spring_damper";

/// The children of an element of Drake, whose tags all begin with its own.
class children {
public:
  explicit children(const element &at) : at_(at) {}

  int link(const char *end, const link_lookup &lookup) const {
    const element child = found(end);
    const std::string name = child.has("name") ? child.text("name") : child.content();
    if (name.empty())
      child.refuse("<" + child.tag() + "> names no link; name one of the robot's");
    return lookup(child, name);
  }
  vec3<double> point(const char *end) const {
    const element child = found(end);
    if (child.has("value")) {
      const auto [x, y, z] = child.numbers<3>("value");
      return {x, y, z};
    }
    const auto p = child.content_numbers(3, "0 0 0.5");
    return {p[0], p[1], p[2]};
  }
  double number(const char *what) const {
    const element child = found(what);
    return child.has("value") ? child.numbers<1>("value")[0] : child.content_numbers(1, "0.5")[0];
  }

private:
  element found(const char *end) const {
    const std::string tag = at_.tag() + "_" + end;
    element child = at_.child(tag.c_str());
    if (!child)
      at_.refuse("no <" + tag + "> in <" + at_.tag() + ">; add it");
    return child;
  }
  const element &at_;
};

SE3<double> at_point(const vec3<double> &p) { return {given::rotation_of({}), p}; }

std::string name_of(const element &at, const robot_description &robot, int a, int b, const char *what) {
  if (at.has("name"))
    return at.text("name");
  const auto name = [&](int link) { return robot.links[static_cast<std::size_t>(link)].name; };
  return name(a) + "_" + name(b) + what;
}

} // namespace

bool is_drake_element(std::string_view tag) { return tag == ball || tag == spring; }

/// p_AP is the point P on body A, in A's frame, and p_BQ the point Q on B: both coincide.  The frames on both sides have the axes of their links,
/// which a ball leaves free.
loop_description ball_constraint_in(const element &at, const link_lookup &link) {
  const children of(at);
  loop_description out;
  out.at = {at.line()};
  out.kind = joint_kind::spherical;
  out.predecessor = of.link("body_A", link), out.successor = of.link("body_B", link);
  out.predecessor_pose = at_point(of.point("p_AP")), out.successor_pose = at_point(of.point("p_BQ"));
  return out;
}

/// f = stiffness (l − free_length) + damping dl/dt between P and Q.
force_element_description spring_damper_in(const element &at, const link_lookup &link) {
  const children of(at);
  force_element_description out;
  out.at = {at.line()};
  out.link1 = of.link("body_A", link), out.link2 = of.link("body_B", link);
  out.point1 = of.point("p_AP"), out.point2 = of.point("p_BQ");
  out.numbers.stiffness = of.number("stiffness"), out.numbers.damping = of.number("damping");
  out.numbers.free_length = of.number("free_length");
  return out;
}

void add_drake_element(const element &at, const link_lookup &link, bool with_loops, std::set<std::string> &taken,
                       robot_description &robot) {
  const auto named = [&](int a, int b, const char *what) {
    const auto is_taken = [&](const std::string &other) { return taken.count(other) > 0; };
    std::string name = name_of(at, robot, a, b, what);
    if (is_taken(name)) // the number is another each time, so that many of one name take no square of steps
      name = text::free_name(name + "_" + std::to_string(taken.size()), is_taken);
    taken.insert(name);
    return name;
  };
  if (at.tag() == spring) {
    force_element_description out = spring_damper_in(at, link);
    out.name = named(out.link1, out.link2, "_spring");
    robot.force_elements.push_back(std::move(out));
  } else if (with_loops) {
    loop_description out = ball_constraint_in(at, link);
    out.name = named(out.predecessor, out.successor, "_ball");
    robot.loops.push_back(std::move(out));
  }
}

} // namespace ksl::readers
