#include "description/making/reversed_compliance.hpp"

#include "description/parts/items.hpp"
#include "description/parts/joint_numbers.hpp"
#include "ksl/engine/model/joints.hpp"

#include <algorithm>
#include <cmath>

namespace ksl {
namespace {

using matrix = std::array<double, 36>;

// cos 1 + sin ũ + (1 − cos) u uᵀ (Rodrigues), in columns
SE3<double> turn_about(const vec3<double> &u, double angle) {
  const double c = std::cos(angle), s = std::sin(angle), k = 1 - c;
  return {{k * u.x * u.x + c, k * u.x * u.y + s * u.z, k * u.x * u.z - s * u.y, k * u.x * u.y - s * u.z,
           k * u.y * u.y + c, k * u.y * u.z + s * u.x, k * u.x * u.z + s * u.y, k * u.y * u.z - s * u.x,
           k * u.z * u.z + c},
          {0, 0, 0}};
}
SE3<double> slide_along(const vec3<double> &u, double distance) {
  return {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {distance * u.x, distance * u.y, distance * u.z}};
}

matrix moved(const matrix &C, const SE3<double> &D) {
  matrix out;
  algebra<double>::matrix6_complianceTransformed(C.data(), &D, out.data());
  return out;
}

/// Equal up to rounding; each element beside the roots of its row's and its column's diagonal elements.
bool are_equal(const matrix &A, const matrix &B) {
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t k = 0; k < 6; ++k) {
      const double size = std::sqrt(std::max(A[7 * i], B[7 * i]) * std::max(A[7 * k], B[7 * k]));
      if (!(std::fabs(A[6 * i + k] - B[6 * i + k]) <= 1e-9 * size))
        return false;
    }
  return true;
}

/// Is it the same at every position of the joint, seen from either side?
/// One position tells all: what a rotation by 1 rad leaves as it is, so do its powers, which come near to any rotation, 1 being no rational part of
/// 2π; and along a slide C changes as a polynomial, which is constant if all whole numbers have the same value.
bool stays(const matrix &C, const joint_description &joint) {
  const joint_kind_row row = row_of(joint.kind);
  const vec3<double> u = axis_of(joint);
  return (row.angle < 0 || are_equal(moved(C, turn_about(u, 1)), C)) &&
         (joint.kind == joint_kind::revolute || joint.kind == joint_kind::continuous ||
          are_equal(moved(C, slide_along(u, 1)), C));
}

} // namespace

void reverse_compliance(robot_description &robot, const joint_description &joint, const std::string &link) {
  const auto of = std::find_if(robot.compliances.begin(), robot.compliances.end(),
                               [&](const joint_compliance &c) { return c.joint == joint.name; });
  if (of == robot.compliances.end())
    return;
  if (row_of(joint.kind).nv == 0)
    of->matrix = moved(of->matrix, joint.placement), of->loose = moved(of->loose, joint.placement);
  else if (!stays(of->matrix, joint) || !stays(of->loose, joint))
    surgery::refuse(
        "joint " + joint.name + " would have to be reversed to make link " + link +
        " the root, and its stiffness, which moves with its child, would depend on its position then; give stiffnesses that are "
        "the same at every position, or give them to the robot with the new root");
}

} // namespace ksl
