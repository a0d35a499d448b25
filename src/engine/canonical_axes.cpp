#include "engine/canonical_axes.hpp"

#include <cmath>
#include <limits>

namespace ksl {
namespace {

using A = algebra<double>;

/// Sine of the angle between z and the axis of a joint on a body.
double sine_to_axis(const mat3x3<double> &joint) { return std::hypot(joint.m02, joint.m12); }

/// Less than rounding leaves of a right angle or of none.
constexpr double negligible = 4 * std::numeric_limits<double>::epsilon();

/// By which turn about z, a quarter at most, the axis of a joint comes to lie in the plane of y and z.
plane_turn<double> turn_to_axis(const mat3x3<double> &joint) {
  const double sine = sine_to_axis(joint);
  if (sine < negligible)
    return no_turn;
  const double sign = joint.m12 > 0 || (joint.m12 == 0 && joint.m02 < 0) ? -1 : 1;
  return {sign * joint.m02 / sine, -sign * joint.m12 / sine};
}

/// D = Rz(turn) D.
void turn_pose(const plane_turn<double> &turn, SE3<double> &D) {
  double dc[2] = {turn.sine, turn.cosine};
  SE3<double> about_z = identity;
  A::product_drdrz(&about_z.R, dc, &about_z.R);
  A::product_dd(&about_z, &D, &D);
}

void turn_inertia(const plane_turn<double> &turn, spatial_inertia<double> &I) {
  SE3<double> back = identity;
  turn_pose(inverse(turn), back);
  A::spatial_inertia_transformed(&I, &back, &I);
}

void turn_link(const plane_turn<double> &turn, link<double> &l) {
  turn_pose(inverse(turn), l.pose);
  turn_inertia(turn, l.inertia);
  const double R[3][3] = {{l.pose.R.m00, l.pose.R.m01, l.pose.R.m02},
                          {l.pose.R.m10, l.pose.R.m11, l.pose.R.m12},
                          {l.pose.R.m20, l.pose.R.m21, l.pose.R.m22}};
  for (int z = 0; z < 3; ++z) {
    if (!l.first || R[0][z] != 0 || R[1][z] != 0)
      continue;
    const int x = (z + 1) % 3, y = (z + 2) % 3;
    l.along_axis = true;
    l.turn = {{-R[1][x], R[0][x]}, R[2][z], {x, y, z}};
  }
}

/// placement = Rz(before) Rx(lean) Rz(…) of a joint, whose body's frame is turned by `chosen` against the joint's.
void take_apart(body<double> &b, const plane_turn<double> &chosen) {
  mat3x3<double> &R = b.placement.R, rest = R;
  b.before = turn_to_axis(R);
  b.straight = std::fabs(b.before.sine) * sine_to_axis(R) < negligible;
  if (b.straight)
    b.before = no_turn;
  vec3<double> axis = {R.m02, R.m12, R.m22};
  turn_back_z(b.before, axis);
  const double length = std::hypot(axis.y, axis.z);
  b.lean = {-axis.y / length, axis.z / length};
  double before[2] = {b.before.sine, b.before.cosine}, lean[2] = {b.lean.sine, b.lean.cosine};
  A::product_drdrz(&identity.R, before, &R);
  A::product_drdrx(&R, lean, &R);
  A::product_drinvdr(&R, &rest, &rest);
  b.after = product(plane_turn<double>{rest.m10, rest.m00}, chosen);
}

} // namespace

bool has_axis(joint_kind kind) {
  return kind == joint_kind::revolute || kind == joint_kind::continuous || kind == joint_kind::prismatic;
}

void choose_canonical_axes(std::vector<body<double>> &bodies, std::vector<link<double>> &links) {
  std::vector<plane_turn<double>> chosen(bodies.size(), no_turn);
  for (std::size_t i = bodies.size(); i-- > 1;) { // of several joints on a body the first one decides
    const body<double> &b = bodies[i];
    const auto parent = static_cast<std::size_t>(b.parent);
    if (has_axis(b.kind) && has_axis(bodies[parent].kind) && sine_to_axis(b.placement.R) >= negligible)
      chosen[parent] = turn_to_axis(b.placement.R);
  }
  for (link<double> &l : links)
    turn_link(chosen[static_cast<std::size_t>(l.body)], l);
  for (std::size_t i = 1; i < bodies.size(); ++i) {
    body<double> &b = bodies[i];
    turn_pose(inverse(chosen[static_cast<std::size_t>(b.parent)]), b.placement);
    if (has_axis(b.kind))
      take_apart(b, chosen[i]);
    turn_inertia(chosen[i], b.inertia);
  }
}

} // namespace ksl
