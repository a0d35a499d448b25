// What is left of D = p⁻¹ s, once the joint has the position that fits best, as (lin, ang) in the axes of s, on which T works:
//
//     spherical            any rotation fits                    Rᵀ t
//     universal            R ≈ Rot(u₁, a) Rot(u₂, b)            Rᵀ t, and the rotation vector of what is left of R
//     helical              θ, and a travel of pitch θ           in canonical axes, whose z is the joint's: Rot(z, θ)ᵀ R and t without the travel
//     others               θ where they turn; slides            likewise, t without what slides
//
// T does no work on the joint's own motion, so that near a closed position Tᵀ of what is left changes as Tᵀ of the relative twist: by K v.
#include "engine/loops/joint_position.hpp"

#include "engine/loops/vectors.hpp"
#include "ksl/engine/model/joints.hpp"

#include <cmath>
#include <numbers>

namespace ksl::loops {
namespace {

using A = algebra<double>;
using vector = vec3<double>;

mat3x3<double> product(const mat3x3<double> &a, const mat3x3<double> &b) {
  mat3x3<double> c;
  A::product_drdr(&a, &b, &c);
  return c;
}
mat3x3<double> transposed(const mat3x3<double> &a) {
  return {a.m00, a.m01, a.m02, a.m10, a.m11, a.m12, a.m20, a.m21, a.m22};
}

mat3x3<double> about_z(double angle) {
  const double s = std::sin(angle), c = std::cos(angle);
  return {c, s, 0, -s, c, 0, 0, 0, 1};
}

/// The angle θ at which Rot(z, θ)ᵀ R is nearest to the identity, in the sum of squares: its trace is largest.  That trace is
/// (R_00 + R_11) cos θ + (R_10 − R_01) sin θ + R_22.
double angle_about_z(const mat3x3<double> &R) { return std::atan2(R.m10 - R.m01, R.m00 + R.m11); }

/// The rotation vector of R, up to π.
/// R − Rᵀ = 2 sin θ [u]×, tr R = 1 + 2 cos θ; at θ = π, where the first is zero, R + 1 = 2 u uᵀ.
vector rotation_vector(const mat3x3<double> &R) {
  vector w = {(R.m21 - R.m12) / 2, (R.m02 - R.m20) / 2, (R.m10 - R.m01) / 2};
  const double sine = std::sqrt(dot(w, w)), cosine = (R.m00 + R.m11 + R.m22 - 1) / 2, angle = std::atan2(sine, cosine);
  if (sine > 1e-8) {
    const double f = angle / sine;
    return {w.x * f, w.y * f, w.z * f};
  }
  if (cosine > 0)
    return w;
  // half a turn: the axis is the largest column of R + 1
  const double xx = R.m00 + 1, yy = R.m11 + 1, zz = R.m22 + 1;
  w = xx >= yy && xx >= zz ? vector{xx, R.m10, R.m20} : yy >= zz ? vector{R.m01, yy, R.m21} : vector{R.m02, R.m12, zz};
  const double f = std::numbers::pi / std::sqrt(dot(w, w));
  return {w.x * f, w.y * f, w.z * f};
}

/// The nearest position of a joint that turns about z and slides by `travel` along it: what is left of D.
SE3<double> without_turn(const SE3<double> &D, double angle, double travel) {
  return {product(transposed(about_z(angle)), D.R), {D.t.x, D.t.y, D.t.z - travel}};
}

/// What the nearest position of a universal joint leaves, in the joint's own axes: R ≈ Rot(u₁, a) Rot(u₂, b).
mat3x3<double> rotation_left(const loop &l, const mat3x3<double> &R) {
  const vector &u1 = l.axis, &u2 = l.axis2;
  const vector to = turned(R, u2), across = cross(u1, u2);
  const double along = dot(u1, u2);
  const vector in_plane = {u2.x - along * u1.x, u2.y - along * u1.y, u2.z - along * u1.z};
  const auto rotation = [](const vector &u, double angle) {
    const double s = std::sin(angle), c = std::cos(angle), d = 1 - c;
    return mat3x3<double>{u.x * u.x * d + c,       u.y * u.x * d + u.z * s, u.z * u.x * d - u.y * s,
                          u.x * u.y * d - u.z * s, u.y * u.y * d + c,       u.z * u.y * d + u.x * s,
                          u.x * u.z * d + u.y * s, u.y * u.z * d - u.x * s, u.z * u.z * d + c};
  };
  // Rot(u₂, b) leaves u₂ where it is, so R u₂ = Rot(u₁, a) u₂: a is the angle about u₁ from u₂ to where it went, whatever b is
  const double a = std::atan2(dot(to, across), dot(to, in_plane));
  const mat3x3<double> rest = product(transposed(rotation(u1, a)), R);
  // b by the same rule as about z: tr(Rot(u₂, b)ᵀ rest) = (tr rest − u₂ · rest u₂) cos b + (u₂ · w) sin b + u₂ · rest u₂
  const vector w = {rest.m21 - rest.m12, rest.m02 - rest.m20, rest.m10 - rest.m01};
  const double trace = rest.m00 + rest.m11 + rest.m22, ahead = dot(u2, turned(rest, u2));
  const double b = std::atan2(dot(u2, w), trace - ahead);
  return product(transposed(rotation(u2, b)), rest);
}

/// What is left in canonical axes, where z is the joint's axis, of a joint that turns about it or about none.
/// The joint has D = Rot(z, θ) and a travel along it where it fits; D less that, with the θ and the travel that fit best, is left.
SE3<double> left_in_canonical(const loop &l, const SE3<double> &D) {
  const double angle = angle_about_z(D.R), turn = 2 * std::numbers::pi;
  if (l.pitch != 0) {
    // travel = pitch · angle has a solution each whole turn; the error is then a length along the axis, and the rotation has none
    const double turns = std::round((D.t.z / l.pitch - angle) / turn);
    return without_turn(D, angle, l.pitch * (angle + turns * turn));
  }
  SE3<double> left = l.turns > 0 ? without_turn(D, angle, 0) : D;
  for (int axis = 0; axis < 3; ++axis)
    if (l.slides[axis])
      (&left.t.x)[axis] = 0;
  return left;
}

} // namespace

bool row_has_two_axes(joint_kind kind) { return row_of(kind).has_axis2; }

screw<double> displacement_left(const loop &l, const SE3<double> &relative) {
  if (l.turns == 3) // which any rotation suits
    return {turned_back(relative.R, relative.t), {0, 0, 0}};
  if (row_has_two_axes(l.kind)) // its axes are those of the joint
    return {turned_back(relative.R, relative.t), rotation_vector(rotation_left(l, relative.R))};
  const mat3x3<double> &Z = l.canonical, back = transposed(Z);
  const SE3<double> in_z = {product(product(back, relative.R), Z), turned_back(Z, relative.t)};
  const SE3<double> left = left_in_canonical(l, in_z);
  // the translation is seen from the successor: turned back by the joint's own rotation, which is what has been taken off
  const mat3x3<double> taken = product(in_z.R, transposed(left.R));
  const vector t = turned_back(taken, left.t), w = rotation_vector(left.R);
  return {turned(Z, t), turned(Z, w)};
}

} // namespace ksl::loops
