// KSL: inverse dynamics, with the wrench through every joint kept.
//
// The recursive Newton–Euler algorithm (Luh, Walker, Paul 1980; Featherstone, RBDA (2008), table 5.1) in three-vectors:
// each body carries ω, ω̇ and the classical acceleration a of its frame's origin.  Newton's and Euler's laws are the
// same seen from every frame that moves without acceleration, so linear velocities are not needed.
#pragma once

#include "ksl/engine/forward_kinematics.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Acceleration of a point fixed at r in a body: a + ω̇ × r + ω × (ω × r).  30 flops.
template <class T>
KSL_LANES vec3<T> acceleration_at(const vec3<T> &w, const vec3<T> &dw, const vec3<T> &a, const vec3<T> &r) {
  using A = algebra<T>;
  vec3<T> wr, x, y, out;
  A::cross_vv(&w, &r, &wr);
  A::cross_vv(&w, &wr, &x);
  A::cross_vv(&dw, &r, &y);
  A::add_vv(&x, &y, &out);
  A::add_vv(&a, &out, &out);
  return out;
}

/// The wrench that gives a body its motion, about its frame's origin (Newton, Euler; h = mass × centroid):
/// f = m a + ω̇ × h + ω × (ω × h),  τ = I ω̇ + ω × I ω + h × a.
template <class T>
KSL_LANES coscrew<T> newton_euler(const spatial_inertia<T> &I, const vec3<T> &w, const vec3<T> &dw, const vec3<T> &a) {
  using A = algebra<T>;
  mat3x3<T> J;
  vec3<T> ma, Iw, gyroscopic, ha;
  coscrew<T> f;
  A::product_av(I.m, &a, &ma);
  f.lin = acceleration_at(w, dw, ma, I.h);
  A::spatial_inertia_getMatrix(&I, &J);
  A::product_drv(&J, &w, &Iw);
  A::product_drv(&J, &dw, &f.ang);
  A::cross_vv(&w, &Iw, &gyroscopic);
  A::cross_vv(&I.h, &a, &ha);
  A::xpy_vv(&gyroscopic, &f.ang);
  A::xpy_vv(&ha, &f.ang);
  return f;
}

/// Adds the motion of joint i to that of its frame, which moves with the parent on entry.
template <class T>
KSL_LANES void add_joint_motion(const body<scalar_of<T>> &b, const T *v, const T *dv, body_state<T> &s) {
  using A = algebra<T>;
  v += b.v_index;
  dv += b.v_index;
  vec3<T> &w = s.angular_velocity, &dw = s.angular_acceleration, &a = s.acceleration;
  switch (b.kind) {
  case joint_kind::revolute:
  case joint_kind::continuous: // ω̇ += ω × z q̇ + z q̈,  ω += z q̇
    dw.x = dw.x + w.y * v[0];
    dw.y = dw.y - w.x * v[0];
    dw.z = dw.z + dv[0];
    w.z = w.z + v[0];
    break;
  case joint_kind::prismatic: // a += 2 ω × z q̇ + z q̈
    a.x = a.x + T(2) * w.y * v[0];
    a.y = a.y - T(2) * w.x * v[0];
    a.z = a.z + dv[0];
    break;
  case joint_kind::floating: { // v = [v; ω] in the body's frame: the origin accelerates with v̇ + ω × v
    const vec3<T> v_lin = {v[0], v[1], v[2]}, v_ang = {v[3], v[4], v[5]}, a_lin = {dv[0], dv[1], dv[2]};
    vec3<T> turning, coupling;
    A::cross_vv(&v_ang, &v_lin, &turning); // relative to the parent
    A::cross_vv(&w, &v_lin, &coupling);
    A::xpy_vv(&turning, &a);
    A::axpy_vv(T(2), &coupling, &a);
    A::xpy_vv(&a_lin, &a);
    A::cross_vv(&w, &v_ang, &coupling);
    A::xpy_vv(&coupling, &dw);
    dw = {dw.x + dv[3], dw.y + dv[4], dw.z + dv[5]};
    A::xpy_vv(&v_ang, &w);
    break;
  }
  case joint_kind::fixed:
    break;
  }
}

/// Motion of body i from its parent's: ω, ω̇, a.
template <class T>
KSL_LANES void propagate_motion(const body<scalar_of<T>> &b, const body_state<T> &parent, const T *v, const T *dv, body_state<T> &s) {
  using A = algebra<T>;
  const vec3<T> a = acceleration_at(parent.angular_velocity, parent.angular_acceleration, parent.acceleration, s.in_parent.t);
  A::product_drinvv(&s.in_parent.R, &parent.angular_velocity, &s.angular_velocity);
  A::product_drinvv(&s.in_parent.R, &parent.angular_acceleration, &s.angular_acceleration);
  A::product_drinvv(&s.in_parent.R, &a, &s.acceleration);
  add_joint_motion(b, v, dv, s);
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

/// Joint efforts tau (nv) for positions q (nq), velocities v (nv) and accelerations dv (nv) under gravity and external
/// wrenches.  Leaves in data.body the motion of each body and the wrench through each joint, body 0's included: the one
/// between the ground and a fixed root.  O(bodies), about 250 flops for each.
template <class T>
void inverse_dynamics(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, const T *v,
                      const T *dv, const external_wrenches<T> &external, T *tau) {
  using A = algebra<T>;
  const vec3<T> zero = {T(0), T(0), T(0)}, gravity = spread<T>(model.gravity);
  body_state<T> &ground = data.body[0];
  ground.angular_velocity = zero;
  ground.angular_acceleration = zero;
  A::vec3_inverted(&gravity, &ground.acceleration); // a frame that accelerates upwards has weight
  ground.wrench = newton_euler(spread<T>(model.body[0].inertia), zero, zero, ground.acceleration);

  sines_and_cosines(model.nq, q, data.sine, data.cosine);
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    body_state<T> &s = data.body[i];
    s.in_parent = pose_in_parent(b, data, q);
    propagate_motion(b, data.body[b.parent], v, dv, s);
    s.wrench = newton_euler(spread<T>(b.inertia), s.angular_velocity, s.angular_acceleration, s.acceleration);
  }

  for (int k = 0; k < external.n; ++k) {
    const coscrew<T> f = external_in_body(model, external, k);
    A::nxpy_cc(&f, &data.body[model.link[external.link[k]].body].wrench);
  }

  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    const body_state<T> &s = data.body[i];
    coscrew<T> f;
    joint_effort(b.kind, s.wrench, tau + b.v_index);
    A::product_CoAdc(&s.in_parent, &s.wrench, &f);
    A::xpy_cc(&f, &data.body[b.parent].wrench);
  }
}

} // namespace KSL_ISA
} // namespace ksl
