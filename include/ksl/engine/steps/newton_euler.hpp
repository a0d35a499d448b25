// KSL: the laws of motion of one body, in three-vectors, as all algorithms use them.
//
// The motion of a body is ω, ω̇ and the classical acceleration a of its frame's origin, minus gravity.  Newton's and Euler's laws
// hold in every inertial frame, so linear velocities are not needed.
#pragma once

#include "ksl/engine/model/body_constants.hpp"
#include "ksl/engine/model/body_motion.hpp"

namespace ksl {

inline namespace KSL_ISA {

/// Products of the components of an angular velocity.
template <class T> struct rate_products { T xx, yy, zz, yz, zx, xy; };
template <class T> KSL_LANES rate_products<T> products_of(const vec3<T> &w) {
  return {w.x * w.x, w.y * w.y, w.z * w.z, w.y * w.z, w.z * w.x, w.x * w.y};
}

/// The field A of accelerations in a body, relative to its origin: the point at r has A r = ω̇ × r + ω × (ω × r).  15 flops with
/// the products.
template <class T> KSL_LANES mat3x3<T> acceleration_field(const rate_products<T> &p, const vec3<T> &dw) {
  return {-(p.yy + p.zz), p.xy + dw.z, p.zx - dw.y, p.xy - dw.z,   -(p.zz + p.xx),
          p.yz + dw.x,    p.zx + dw.y, p.yz - dw.x, -(p.xx + p.yy)};
}

/// Acceleration of a point fixed at r in a body.  33 flops.
template <class T> KSL_LANES vec3<T> acceleration_at(const body_motion<T> &m, const vec3<T> &r) {
  using A = algebra<T>;
  const mat3x3<T> field = acceleration_field(products_of(m.angular_velocity), m.angular_acceleration);
  vec3<T> a;
  A::product_drv(&field, &r, &a);
  A::xpy_vv(&m.acceleration, &a);
  return a;
}

/// The wrench that gives a body its motion, about its frame's origin (Newton, Euler).  With h = mass × centroid and the field A of
/// accelerations,
///
///     f = m a + A h,   τ = ∫ r × A r dm + h × a,   ∫ r × A r dm = I ω̇ + ω × I ω.                              (1)
///
/// 81 flops.
template <class T>
KSL_LANES coscrew<T> newton_euler(const spatial_inertia<T> &I, const body_motion<T> &m) {
  using A = algebra<T>;
  const vec3<T> &dw = m.angular_acceleration, &a = m.acceleration;
  const rate_products<T> p = products_of(m.angular_velocity);
  const mat3x3<T> F = acceleration_field(p, dw);
  vec3<T> ma, ha;
  coscrew<T> f;
  A::product_av(I.m, &a, &ma);
  A::product_drv(&F, &I.h, &f.lin);
  A::xpy_vv(&ma, &f.lin);
  // I ω̇ + ω × I ω, by the products of ω that A contains
  f.ang.x = I.Ixx * dw.x + (I.Izz - I.Iyy) * p.yz + (I.Iyz * (p.yy - p.zz) + (I.Izx * F.m10 - I.Ixy * F.m20));
  f.ang.y = I.Iyy * dw.y + (I.Ixx - I.Izz) * p.zx + (I.Izx * (p.zz - p.xx) + (I.Ixy * F.m21 - I.Iyz * F.m01));
  f.ang.z = I.Izz * dw.z + (I.Iyy - I.Ixx) * p.xy + (I.Ixy * (p.xx - p.yy) + (I.Iyz * F.m02 - I.Izx * F.m12));
  A::cross_vv(&I.h, &a, &ha);
  A::xpy_vv(&ha, &f.ang);
  return f;
}

/// The motion of the ground: it accelerates upwards, which has the effect of gravity.
template <class T> KSL_LANES body_motion<T> ground_motion(const model_view<scalar_of<T>> &model) {
  const vec3<T> zero = {T(0), T(0), T(0)}, gravity = spread<T>(model.gravity);
  body_motion<T> m = {zero, zero, zero};
  algebra<T>::vec3_inverted(&gravity, &m.acceleration);
  return m;
}

} // namespace KSL_ISA
} // namespace ksl
