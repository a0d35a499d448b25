// ksl::load where there is no reader of robot files: robots come as the tables that robot_tables.py writes, a line for each joint and the body
// that it carries.
#include "ksl/dynamics.hpp"

#include <fstream>
#include <stdexcept>

namespace {

/// A row of numbers.
template <std::size_t n> std::istream &operator>>(std::istream &in, std::array<double, n> &numbers) {
  for (double &x : numbers)
    in >> x;
  return in;
}

struct line {
  std::string kind;
  int parent; ///< joint, counted from 0; −1: the world
  std::array<double, 9> rotation;
  std::array<double, 3> position, axis;
  double mass;
  std::array<double, 3> centroid;
  std::array<double, 6> inertia; ///< about the centroid: xx yy zz xy yz zx
};

std::istream &operator>>(std::istream &in, line &l) {
  return in >> l.kind >> l.parent >> l.rotation >> l.position >> l.axis >> l.mass >> l.centroid >> l.inertia;
}

ksl::link_description link_of(const line &l, const std::string &name) {
  ksl::link_description link;
  link.name = name;
  link.has_inertial = true;
  const ksl::vec3<double> c{l.centroid[0], l.centroid[1], l.centroid[2]};
  const auto &I = l.inertia;
  ksl::algebra<double>::spatial_inertia_fromMassCentroid(l.mass, &c, I[0], I[1], I[2], I[3], I[4], I[5], &link.inertia);
  return link;
}

ksl::joint_description joint_of(const line &l, const std::string &name, int parent, int child) {
  ksl::joint_description joint;
  joint.name = name;
  joint.kind = l.kind == "prismatic" ? ksl::joint_kind::prismatic : ksl::joint_kind::revolute;
  joint.parent = parent, joint.child = child;
  const auto &R = l.rotation;
  joint.placement = {{R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]},
                     {l.position[0], l.position[1], l.position[2]}};
  joint.axis = {l.axis[0], l.axis[1], l.axis[2]};
  return joint;
}

} // namespace

ksl::model ksl::load(const std::string &path, const model_options &options, const load_options &) {
  std::ifstream in(path);
  robot_description robot;
  robot.name = "robot";
  const int before = options.floating_base ? 0 : 1; // links before the first one of the table
  if (before)
    robot.links.emplace_back().name = "ground";
  int joints = 0;
  for (line l; in >> l; ++joints) {
    const std::string number = std::to_string(joints);
    robot.links.push_back(link_of(l, "link" + number));
    if (l.kind != "floating") // else it is the root
      robot.joints.push_back(joint_of(l, "joint" + number, l.parent + before, joints + before));
  }
  if (joints == 0 || !in.eof())
    throw std::runtime_error(path + " is no table of joints");
  return model(robot, options);
}
