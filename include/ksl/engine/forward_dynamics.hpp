// KSL: forward dynamics, by the articulated-body algorithm (Featherstone, RBDA (2008), table 7.1).
#pragma once

#include "ksl/engine/energy.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// x = A⁻¹ b for the matrix of an articulated inertia, by LDLᵀ; A is positive definite.  Six by six, no pivoting.
template <class T> inline screw<T> solve(const articulated_inertia<T> &A, const coscrew<T> &b) {
  T L[6][6] = {{A.Mxx, A.Mxy, A.Mzx, A.H.m00, A.H.m01, A.H.m02}, {A.Mxy, A.Myy, A.Myz, A.H.m10, A.H.m11, A.H.m12},
               {A.Mzx, A.Myz, A.Mzz, A.H.m20, A.H.m21, A.H.m22}, {A.H.m00, A.H.m10, A.H.m20, A.Ixx, A.Ixy, A.Izx},
               {A.H.m01, A.H.m11, A.H.m21, A.Ixy, A.Iyy, A.Iyz}, {A.H.m02, A.H.m12, A.H.m22, A.Izx, A.Iyz, A.Izz}};
  T x[6] = {b.lin.x, b.lin.y, b.lin.z, b.ang.x, b.ang.y, b.ang.z};
  for (int k = 0; k < 6; ++k) { // the lower triangle becomes L, the diagonal 1/D
    L[k][k] = T(1) / L[k][k];
    for (int i = k + 1; i < 6; ++i) {
      const T l = L[i][k] * L[k][k];
      for (int j = k + 1; j <= i; ++j)
        L[i][j] = L[i][j] - l * L[j][k];
      x[i] = x[i] - l * x[k];
    }
  }
  for (int i = 5; i >= 0; --i) {
    x[i] = x[i] * L[i][i];
    for (int j = 0; j < i; ++j)
      x[j] = x[j] - L[i][j] * x[i];
  }
  return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
}

/// U = A S of a joint with one coordinate: a column of its articulated inertia.
template <class T> KSL_LANES coscrew<T> column_along(joint_kind kind, const articulated_inertia<T> &A) {
  if (kind == joint_kind::prismatic)
    return {{A.Mzx, A.Myz, A.Mzz}, {A.H.m20, A.H.m21, A.H.m22}};
  return {{A.H.m02, A.H.m12, A.H.m22}, {A.Izx, A.Iyz, A.Izz}};
}

/// Velocities, bias accelerations c = v × S q̇ and bias wrenches p = v ×* I v − f of all bodies; A = I.
template <class T>
void start_articulated(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, const T *v,
                       const external_wrenches<T> &external) {
  using A = algebra<T>;
  poses_in_parents(model, data, q);
  data.twist[0] = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    const spatial_inertia<T> I = spread<T>(b.inertia);
    const screw<T> joint = joint_twist(b.kind, v + b.v_index);
    articulated_state<T> &s = data.articulated[i];
    screw<T> &twist = data.twist[i];
    coscrew<T> momentum;
    A::product_Adinvs(&data.body[i].in_parent, &data.twist[b.parent], &twist);
    A::xpy_ss(&joint, &twist);
    A::cross_ss(&twist, &joint, &s.bias);
    A::product_Ms(&I, &twist, &momentum);
    A::cross_sc(&twist, &momentum, &s.wrench);
    A::spatial_inertia_toArticulated(&I, &s.inertia);
  }
  for (int k = 0; k < external.n; ++k) {
    const coscrew<T> f = external_in_body(model, external, k);
    A::nxpy_cc(&f, &data.articulated[model.link[external.link[k]].body].wrench);
  }
}

/// What the parent feels of body i through its joint: adds articulated inertia and bias wrench to the parent's.
template <class T> inline void pass_to_parent(const body<scalar_of<T>> &b, const data_view<T> &data, int i, const T *tau) {
  using A = algebra<T>;
  articulated_state<T> &s = data.articulated[i], &parent = data.articulated[b.parent];
  const SE3<T> &D = data.body[i].in_parent;
  coscrew<T> p = s.wrench, f;
  if (b.kind == joint_kind::floating) { // the joint passes its effort and no inertia
    const T *t = tau + b.v_index;
    p = {{t[0], t[1], t[2]}, {t[3], t[4], t[5]}};
    A::subtract_cc(&p, &s.wrench, &f);
    s.acceleration = solve(s.inertia, f);
  } else { // A − U D⁻¹ Uᵀ,  p + A c + U D⁻¹ u
    s.column = column_along(b.kind, s.inertia);
    s.inverse = T(1) / effort_along(b.kind, s.column);
    s.effort = tau[b.v_index] - effort_along(b.kind, s.wrench);
    if (b.parent == 0)
      return;
    articulated_inertia<T> rest;
    A::articulated_inertia_downdated(&s.inertia, &s.column, s.inverse, &rest);
    A::product_As(&rest, &s.bias, &f);
    A::xpy_cc(&f, &p);
    A::axpy_cc(s.inverse * s.effort, &s.column, &p);
    A::articulated_inertia_transformed(&rest, &D, &rest);
    A::articulated_inertia_added(&parent.inertia, &rest, &parent.inertia);
  }
  if (b.parent == 0)
    return;
  A::product_CoAdc(&D, &p, &p);
  A::xpy_cc(&p, &parent.wrench);
}

/// Acceleration of body i and of its joint, once the parent's is known.
template <class T>
inline void accelerate(const body<scalar_of<T>> &b, const data_view<T> &data, int i, const screw<T> &parent, T *dv) {
  using A = algebra<T>;
  articulated_state<T> &s = data.articulated[i];
  screw<T> a; // of the body, were the joint not to accelerate
  A::product_Adinvs(&data.body[i].in_parent, &parent, &a);
  A::xpy_ss(&s.bias, &a);
  dv += b.v_index;
  if (b.kind == joint_kind::floating) {
    screw<T> d;
    A::subtract_ss(&s.acceleration, &a, &d);
    dv[0] = d.lin.x, dv[1] = d.lin.y, dv[2] = d.lin.z;
    dv[3] = d.ang.x, dv[4] = d.ang.y, dv[5] = d.ang.z;
    return;
  }
  dv[0] = s.inverse * (s.effort - A::dot_cs(&s.column, &a));
  if (b.kind == joint_kind::prismatic)
    a.lin.z = a.lin.z + dv[0];
  else
    a.ang.z = a.ang.z + dv[0];
  s.acceleration = a;
}

/// Accelerations dv (nv) for positions q (nq), velocities v (nv) and joint efforts tau (nv) under gravity and external
/// wrenches.  O(bodies), about 700 flops for each.
template <class T>
void forward_dynamics(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, const T *v,
                      const T *tau, const external_wrenches<T> &external, T *dv) {
  start_articulated(model, data, q, v, external);
  for (int i = model.bodies - 1; i > 0; --i)
    pass_to_parent(model.body[i], data, i, tau);

  const vec3<T> g = spread<T>(model.gravity);
  data.articulated[0].acceleration = {{-g.x, -g.y, -g.z}, {T(0), T(0), T(0)}};
  for (int i = 1; i < model.bodies; ++i)
    accelerate(model.body[i], data, i, data.articulated[model.body[i].parent].acceleration, dv);
}

} // namespace KSL_ISA
} // namespace ksl
