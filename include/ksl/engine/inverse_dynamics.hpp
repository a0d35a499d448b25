// KSL: inverse dynamics, with the wrench through every joint kept.
//
// The recursive Newton–Euler algorithm (Luh, Walker, Paul 1980; Featherstone, RBDA (2008), table 5.1) in three-vectors:
// each body carries ω, ω̇ and the classical acceleration a of its frame's origin.  Newton's and Euler's laws are the
// same seen from every frame that moves without acceleration, so linear velocities are not needed.
#pragma once

#include "ksl/engine/body_lanes.hpp"
#include "ksl/engine/forward_kinematics.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Products of the components of an angular velocity.
template <class T> struct rate_products { T xx, yy, zz, yz, zx, xy; };
template <class T> KSL_LANES rate_products<T> products_of(const vec3<T> &w) {
  return {w.x * w.x, w.y * w.y, w.z * w.z, w.y * w.z, w.z * w.x, w.x * w.y};
}

/// The accelerations of a body's points, relative to its origin: of the one at r, A r = ω̇ × r + ω × (ω × r).  15 flops with
/// the products.
template <class T> KSL_LANES mat3x3<T> acceleration_field(const rate_products<T> &p, const vec3<T> &dw) {
  return {-(p.yy + p.zz), p.xy + dw.z,    p.zx - dw.y, p.xy - dw.z,    -(p.zz + p.xx),
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

/// The wrench that gives a body its motion, about its frame's origin (Newton, Euler; h = mass × centroid):
/// f = m a + A h,  τ = ∫ r × A r dm + h × a, A the field of accelerations.  81 flops.
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
  // I ω̇ + ω × I ω, with what A has of it
  f.ang.x = I.Ixx * dw.x + (I.Izz - I.Iyy) * p.yz + (I.Iyz * (p.yy - p.zz) + (I.Izx * F.m10 - I.Ixy * F.m20));
  f.ang.y = I.Iyy * dw.y + (I.Ixx - I.Izz) * p.zx + (I.Izx * (p.zz - p.xx) + (I.Ixy * F.m21 - I.Iyz * F.m01));
  f.ang.z = I.Izz * dw.z + (I.Iyy - I.Ixx) * p.xy + (I.Ixy * (p.xx - p.yy) + (I.Iyz * F.m02 - I.Izx * F.m12));
  A::cross_vv(&I.h, &a, &ha);
  A::xpy_vv(&ha, &f.ang);
  return f;
}

/// Adds the motion of a free joint, all in one frame's axes: its twist (v, w) and the rates of these numbers.
template <class T>
KSL_LANES void add_free_motion(const screw<T> &twist, const screw<T> &rate, body_motion<T> &m) {
  using A = algebra<T>;
  vec3<T> turning, coupling;
  A::cross_vv(&twist.ang, &twist.lin, &turning); // v̇ + ω × v relative to the parent
  A::cross_vv(&m.angular_velocity, &twist.lin, &coupling);
  A::xpy_vv(&turning, &m.acceleration);
  A::axpy_vv(T(2), &coupling, &m.acceleration);
  A::xpy_vv(&rate.lin, &m.acceleration);
  A::cross_vv(&m.angular_velocity, &twist.ang, &coupling);
  A::xpy_vv(&coupling, &m.angular_acceleration);
  A::xpy_vv(&rate.ang, &m.angular_acceleration);
  A::xpy_vv(&twist.ang, &m.angular_velocity);
}

/// Adds the motion of a joint, from its velocities v and accelerations dv, to that of its frame, which moves with the parent
/// on entry.
template <joint_kind K, class T> KSL_LANES void add_joint_motion(const T *v, const T *dv, body_motion<T> &m) {
  vec3<T> &w = m.angular_velocity, &dw = m.angular_acceleration, &a = m.acceleration;
  if constexpr (K == joint_kind::revolute) { // ω̇ += ω × z q̇ + z q̈,  ω += z q̇
    dw.x = dw.x + w.y * v[0];
    dw.y = dw.y - w.x * v[0];
    dw.z = dw.z + dv[0];
    w.z = w.z + v[0];
  } else if constexpr (K == joint_kind::prismatic) { // a += 2 ω × z q̇ + z q̈
    a.x = a.x + T(2) * w.y * v[0];
    a.y = a.y - T(2) * w.x * v[0];
    a.z = a.z + dv[0];
  } else { // v = [v; ω] in the body's frame
    add_free_motion(joint_twist<K>(v), joint_twist<K>(dv), m);
  }
}

/// The ground: a frame that accelerates upwards has weight.
template <class T> KSL_LANES body_motion<T> ground_motion(const model_view<scalar_of<T>> &model) {
  const vec3<T> zero = {T(0), T(0), T(0)}, gravity = spread<T>(model.gravity);
  body_motion<T> m = {zero, zero, zero};
  algebra<T>::vec3_inverted(&gravity, &m.acceleration);
  return m;
}

/// The k-th external wrench, about the origin of its body and in its axes.
template <class T>
inline coscrew<T> external_in_body(const model_view<scalar_of<T>> &model, const external_wrenches<T> &external, int k) {
  const T *e = external.wrench + 6 * k;
  const SE3<T> pose = spread<T>(model.link[external.link[k]].pose);
  coscrew<T> f = {{e[0], e[1], e[2]}, {e[3], e[4], e[5]}};
  algebra<T>::product_CoAdc(&pose, &f, &f);
  return f;
}

/// Adds a wrench to that of body i in data.wrench, or takes it off.
template <class T> KSL_LANES void add_wrench(const data_view<T> &data, int i, const coscrew<T> &f) {
  coscrew<T> sum = body_at<T>(i).template get<coscrew>(data.wrench);
  algebra<T>::xpy_cc(&f, &sum);
  body_at<T>(i).put(sum, data.wrench);
}
template <class T> KSL_LANES void subtract_wrench(const data_view<T> &data, int i, const coscrew<T> &f) {
  coscrew<T> sum = body_at<T>(i).template get<coscrew>(data.wrench);
  algebra<T>::nxpy_cc(&f, &sum);
  body_at<T>(i).put(sum, data.wrench);
}

/// Joint efforts tau (nv) for positions q (nq), velocities v (nv) and accelerations dv (nv) under gravity and external
/// wrenches.  Leaves in data.motion how each body moves and in data.wrench the wrench through each joint, about its body's
/// origin and in its axes, body 0's included: the one between the ground and a fixed root.  O(bodies), about 270 flops for
/// each.  receive(body, kind, wrench) gets the wrench through each joint as it is found, from the last body on.
template <class T, class Receive>
KSL_LANES void inverse_dynamics(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, const T *v,
                                const T *dv, const external_wrenches<T> &external, T *tau, Receive receive) {
  sines_and_cosines(model, data, q);
  body_at<T>(0).put(ground_motion<T>(model), data.motion);
  const auto move = [&](int i) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      const auto D = pose_in_parent<K, T>::at(b, data, i, q);
      body_motion<T> m = body_at<T>(b.parent).template get<body_motion>(data.motion);
      m.acceleration = acceleration_at(m, D.t);
      D.to_body(m.angular_velocity, m.angular_acceleration, m.acceleration);
      add_joint_motion<K>(v + b.v_index, dv + b.v_index, m);
      body_at<T>(i).put(m, data.motion);
    });
  };
  for_bodies<T>(model.bodies, move, [&](auto k) KSL_INLINED {
    k.put(newton_euler(k.inertia(model), k.template get<body_motion>(data.motion)), data.wrench);
  });
  for (int k = 0; k < external.n; ++k)
    subtract_wrench(data, model.link[external.link[k]].body, external_in_body(model, external, k));

  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      const auto D = pose_in_parent<K, T>::kept(b, data, i);
      coscrew<T> f = body_at<T>(i).template get<coscrew>(data.wrench);
      joint_effort<K>(f, tau + b.v_index);
      receive(i, K, f);
      D.to_parent(f.lin, f.ang);
      algebra<T>::product_CoAdtc(&D.t, &f, &f);
      add_wrench(data, b.parent, f);
    });
  }
}

template <class T>
void inverse_dynamics(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, const T *v,
                      const T *dv, const external_wrenches<T> &external, T *tau) {
  inverse_dynamics(model, data, q, v, dv, external, tau, [](int, joint_kind, const coscrew<T> &) KSL_INLINED {});
}

} // namespace KSL_ISA
} // namespace ksl
