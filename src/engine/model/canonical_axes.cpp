#include "engine/model/canonical_axes.hpp"

#include "ksl/engine/model/joints.hpp"

#include <cmath>
#include <limits>

namespace ksl {
namespace {

using A = algebra<double>;

/// Length of two components of a unit vector.  std::hypot is not used, since its bits differ between C libraries.
double length_of(double x, double y) { return std::sqrt(x * x + y * y); }

/// Sine of the angle between z and the axis of a joint on a body.
double sine_to_axis(const mat3x3<double> &joint) { return length_of(joint.m02, joint.m12); }

/// A sine below this is zero but for rounding errors.
constexpr double negligible = 4 * std::numeric_limits<double>::epsilon();

/// The rotation about z, by 90 degrees at most, after which the axis of a joint lies in the plane of y and z.
plane_rotation<double> rotation_to_axis(const mat3x3<double> &joint) {
  const double sine = sine_to_axis(joint);
  if (sine < negligible)
    return no_rotation;
  // r with (Rz(r)⁻¹ a).x = cos r a.x + sin r a.y = 0 for the axis a: (sin, cos) = ±(a.x, −a.y) / √(a.x² + a.y²), the sign by cos r ≥ 0
  const double sign = joint.m12 > 0 || (joint.m12 == 0 && joint.m02 < 0) ? -1 : 1;
  return {sign * joint.m02 / sine, -sign * joint.m12 / sine};
}

/// D = Rz(r) D.
void rotate_pose(const plane_rotation<double> &r, SE3<double> &D) {
  double dc[2] = {r.sine, r.cosine};
  SE3<double> about_z = identity;
  A::product_drdrz(&about_z.R, dc, &about_z.R);
  A::product_dd(&about_z, &D, &D);
}

void rotate_link(const plane_rotation<double> &r, link<double> &l) {
  rotate_pose(inverse(r), l.pose);
  const double R[3][3] = {{l.pose.R.m00, l.pose.R.m01, l.pose.R.m02},
                          {l.pose.R.m10, l.pose.R.m11, l.pose.R.m12},
                          {l.pose.R.m20, l.pose.R.m21, l.pose.R.m22}};
  for (int z = 0; z < 3; ++z) {
    if (!l.carried_by_moving_joint || R[0][z] != 0 || R[1][z] != 0)
      continue;
    // the link's axis z is the joint's, in this or the opposite direction; its x in the body's plane of x and y, (cos φ, sin φ), gives the rotation −φ
    const int x = (z + 1) % 3, y = (z + 2) % 3;
    l.axis_aligned = true;
    l.permutation = {{-R[1][x], R[0][x]}, R[2][z], {x, y, z}};
  }
}

/// Factors the placement of a joint into Rz(offset) Rx(alpha) Rz(theta0).  `chosen` is the rotation from the joint's frame to
/// the body's canonical frame; it becomes part of theta0.
///
///     R z = Rz(offset) (0, −sin alpha, cos alpha)   gives offset and alpha;   (Rz(offset) Rx(alpha))⁻¹ R = Rz(theta0)
void take_apart(body<double> &b, const plane_rotation<double> &chosen) {
  mat3x3<double> &R = b.placement.R, rest = R;
  b.offset = rotation_to_axis(R);
  b.no_offset = std::fabs(b.offset.sine) * sine_to_axis(R) < negligible;
  if (b.no_offset)
    b.offset = no_rotation;
  vec3<double> axis = {R.m02, R.m12, R.m22};
  rotate_back_z(b.offset, axis);
  const double length = length_of(axis.y, axis.z);
  b.alpha = {-axis.y / length, axis.z / length};
  double offset[2] = {b.offset.sine, b.offset.cosine}, alpha[2] = {b.alpha.sine, b.alpha.cosine};
  A::product_drdrz(&identity.R, offset, &R);
  A::product_drdrx(&R, alpha, &R);
  A::product_drinvdr(&R, &rest, &rest);
  b.theta0 = product(plane_rotation<double>{rest.m10, rest.m00}, chosen);
}

} // namespace

mat3x3<double> frame_with_z(const vec3<double> &z) {
  // x is the next coordinate axis (cyclically) after the one that z is closest to, made orthogonal to z
  const double ax = std::fabs(z.x), ay = std::fabs(z.y), az = std::fabs(z.z);
  vec3<double> x = az >= ax && az >= ay ? vec3<double>{1, 0, 0}
                   : ax >= ay           ? vec3<double>{0, 1, 0}
                                        : vec3<double>{0, 0, 1};
  vec3<double> y;
  A::axpy_vv(-A::dot_vv(&x, &z), &z, &x);
  A::vec3_normalize(&x);
  A::cross_vv(&z, &x, &y);
  // mat3x3 has its numbers column by column
  return {x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z};
}

// Frame i is turned by r_i about its z.  What is given in it goes by Rz(r_i)⁻¹: poses of its links, placements of joints on it.  The joint's own
// rotation about the same z commutes with r_i, which so becomes a part of theta0; of joints with a coordinate along or about x or
// y the frames stay.
void choose_canonical_axes(std::vector<body<double>> &bodies, std::vector<link<double>> &links) {
  std::vector<plane_rotation<double>> chosen(bodies.size(), no_rotation);
  for (std::size_t i = bodies.size(); i-- > 1;) { // the first joint on a body overwrites the choices of later ones
    const body<double> &b = bodies[i];
    const auto parent = static_cast<std::size_t>(b.parent);
    if (row_of(b.kind).canonical_x && row_of(bodies[parent].kind).canonical_x &&
        sine_to_axis(b.placement.R) >= negligible)
      chosen[parent] = rotation_to_axis(b.placement.R);
  }
  for (link<double> &l : links)
    rotate_link(chosen[static_cast<std::size_t>(l.body)], l);
  for (std::size_t i = 1; i < bodies.size(); ++i) {
    body<double> &b = bodies[i];
    rotate_pose(inverse(chosen[static_cast<std::size_t>(b.parent)]), b.placement);
    if (row_of(b.kind).canonical_x)
      take_apart(b, chosen[i]);
  }
}

} // namespace ksl
