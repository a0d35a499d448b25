// Axes are unit vectors in the joint's frame, the second one in the child's; placement is the joint's frame in its parent's.  A first axis of zero is
// one that wasn't given, and stands for the usual axis of the kind.
#include "description/parts/joint_numbers.hpp"

#include "ksl/engine/model/joints.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace ksl {
namespace {

[[noreturn]] void refuse_joint(const robot_description &robot, const joint_description &joint,
                               const std::string &what) {
  text::refuse(robot.file, joint.at.line, what);
}

/// Refuses axes that are no unit vectors, and parallel axes of a universal joint.  A first axis that is zero stands for the usual one.
void check_axes(const robot_description &robot, const joint_description &joint) {
  const joint_kind_row row = row_of(joint.kind);
  const auto length = [](const vec3<double> &u) { return std::sqrt(u.x * u.x + u.y * u.y + u.z * u.z); };
  const auto check_unit = [&](const vec3<double> &u, const std::string &which) {
    if (!(std::fabs(length(u) - 1) <= 1e-6))
      refuse_joint(robot, joint,
                   "joint " + joint.name + ": its " + which + " has length " + text::shown(length(u)) +
                       ", expected 1; divide it by that");
  };
  if (row.has_axis && length(joint.axis) != 0)
    check_unit(joint.axis, "axis");
  if (!row.has_axis2)
    return;
  const std::string who = "joint " + joint.name + ": a " + row.name + " joint ";
  if (length(joint.axis2) == 0)
    refuse_joint(robot, joint,
                 who + "needs a second axis, the direction fixed in its child that it also turns about; give it");
  check_unit(joint.axis2, "second axis");
  vec3<double> normal;
  const vec3<double> first = axis_of(joint);
  algebra<double>::cross_vv(&first, &joint.axis2, &normal);
  // |u₁ × u₂| is the sine of the angle between them: beside zero the angles about both are not told apart
  if (length(normal) < 1e-6)
    refuse_joint(robot, joint,
                 who + "needs two axes that are not parallel; correct one of them, or make it a revolute joint");
}

} // namespace

vec3<double> axis_of(const joint_description &joint) {
  const vec3<double> &u = joint.axis;
  if (u.x != 0 || u.y != 0 || u.z != 0)
    return u;
  const int usual = row_of(joint.kind).usual_axis;
  return {usual == 0 ? 1. : 0., usual == 1 ? 1. : 0., usual == 2 ? 1. : 0.};
}

void check_joint_numbers(const robot_description &robot, const joint_description &joint) {
  const joint_kind_row row = row_of(joint.kind);
  if (row.has_pitch && !(joint.pitch && std::isfinite(*joint.pitch)))
    refuse_joint(robot, joint,
                 "joint " + joint.name + ": a " + row.name + " joint needs a finite pitch, in metres for each radian");
  const mat3x3<double> &R = joint.placement.R;
  const vec3<double> &t = joint.placement.t, &u = joint.axis, &u2 = joint.axis2;
  const double all[] = {R.m00, R.m10, R.m20, R.m01, R.m11, R.m21, R.m02, R.m12, R.m22,
                        t.x,   t.y,   t.z,   u.x,   u.y,   u.z,   u2.x,  u2.y,  u2.z};
  if (!std::all_of(std::begin(all), std::end(all), [](double x) { return std::isfinite(x); }))
    refuse_joint(robot, joint, "joint " + joint.name + ": its placement or its axis is not finite; mend its numbers");
  check_axes(robot, joint);
}

} // namespace ksl
