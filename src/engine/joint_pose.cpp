#include "engine/joint_pose.hpp"

#include "ksl/dynamics.hpp"

namespace ksl {

SE3<double> joint_pose(const joint_description &joint, const std::vector<double> &q) {
  // forward kinematics of a robot that has this joint alone, which works for any kind
  robot_description alone;
  alone.links.resize(2);
  alone.links[0].name = "parent", alone.links[1].name = "child";
  alone.joints = {joint};
  alone.joints[0].parent = 0, alone.joints[0].child = 1;
  alone.joints[0].mimic.reset(); // the joint that it follows is not here
  alone.joints[0].is_rotor = false; // a rotor would be left out
  alone.joints[0].placement = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  const model m(std::move(alone));
  data d(m);
  return frame_pose(m, d, q.data(), 1);
}

} // namespace ksl
