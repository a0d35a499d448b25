// KSL: forward dynamics, by the articulated-body algorithm (Featherstone, RBDA (2008), table 7.1).
#pragma once

#include "ksl/engine/base_axes.hpp"
#include "ksl/engine/inverse_dynamics.hpp"

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

/// Sᵀ f of a joint with one coordinate about or along the axis z.
template <joint_kind K, class T> KSL_LANES T component_along(const vec3<T> &z, const coscrew<T> &f) {
  return algebra<T>::dot_vv(&z, K == joint_kind::prismatic ? &f.lin : &f.ang);
}

/// U = A S of such a joint.
template <joint_kind K, class T> KSL_LANES coscrew<T> column_along(const vec3<T> &z, const articulated_inertia<T> &A) {
  using algebra = ksl::algebra<T>;
  mat3x3<T> block;
  coscrew<T> U;
  if constexpr (K == joint_kind::prismatic) {
    algebra::articulated_inertia_getM(&A, &block);
    algebra::product_drv(&block, &z, &U.lin);
    algebra::product_drinvv(&A.H, &z, &U.ang);
  } else {
    algebra::articulated_inertia_getI(&A, &block);
    algebra::product_drv(&A.H, &z, &U.lin);
    algebra::product_drv(&block, &z, &U.ang);
  }
  return U;
}

/// Adds the motion of joint i with no acceleration of its own, in the axes of the base.
template <joint_kind K, class T>
KSL_LANES void add_steady_motion(const data_view<T> &data, int i, const T *v, body_motion<T> &m) {
  using A = algebra<T>;
  const vec3<T> z = axis_of(data, i);
  vec3<T> coupling;
  A::cross_vv(&m.angular_velocity, &z, &coupling);
  if constexpr (K == joint_kind::revolute) { // ω̇ += ω × z q̇,  ω += z q̇
    A::axpy_vv(v[0], &coupling, &m.angular_acceleration);
    A::axpy_vv(v[0], &z, &m.angular_velocity);
  } else if constexpr (K == joint_kind::prismatic) { // a += 2 ω × z q̇
    A::axpy_vv(T(2) * v[0], &coupling, &m.acceleration);
  } else {
    const mat3x3<T> R = body_at<T>(i).template get<mat3x3>(data.rotation);
    const T zero = T(0);
    screw<T> twist = joint_twist<K>(v), steady = {{zero, zero, zero}, {zero, zero, zero}};
    A::product_Adrs(&R, &twist, &twist);
    add_free_motion(twist, steady, m);
  }
}

/// How body i would move if no joint accelerated (data.motion), in the axes of the base.
template <joint_kind K, class T>
KSL_LANES void move_steadily(const body<scalar_of<T>> &b, const data_view<T> &data, int i, const T *v) {
  using A = algebra<T>;
  body_motion<T> m = body_at<T>(b.parent).template get<body_motion>(data.motion);
  m.acceleration = acceleration_at(m, data.offset[i]);
  if constexpr (K == joint_kind::floating)
    if (is_base(b)) { // it floats on the ground, and its axes are those of the base from here on
      A::product_drinvv(&data.in_parent[i].R, &m.acceleration, &m.acceleration);
    }
  add_steady_motion<K>(data, i, v + b.v_index, m);
  body_at<T>(i).put(m, data.motion);
}

/// Axes and offsets of all bodies, their steady motions (data.motion), inertias (data.inertia) and the wrenches
/// (data.wrench) of these motions, in the axes of the base.
template <class T>
void start_articulated(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, const T *v,
                       const external_wrenches<T> &external) {
  body_at<T>(0).put(ground_motion<T>(model), data.motion);
  const auto move = [&](int i, const vec3<T> &offset) KSL_INLINED {
    data.offset[i] = offset;
    by_kind(model.body[i].kind, [&]<joint_kind K>() KSL_INLINED { move_steadily<K>(model.body[i], data, i, v); });
  };
  express_in_base(model, data, q, move, [&](auto k) KSL_INLINED {
    using P = typename decltype(k)::scalar;
    const spatial_inertia<P> I = turned(k.inertia(model), k.template get<mat3x3>(data.rotation));
    articulated_inertia<P> start;
    algebra<P>::spatial_inertia_toArticulated(&I, &start);
    k.put(start, data.inertia);
    k.put(newton_euler(I, k.template get<body_motion>(data.motion)), data.wrench);
  });
  for (int k = 0; k < external.n; ++k) {
    const int i = model.link[external.link[k]].body;
    const mat3x3<T> R = body_at<T>(i).template get<mat3x3>(data.rotation);
    coscrew<T> f = external_in_body(model, external, k);
    algebra<T>::product_CoAdrc(&R, &f, &f);
    subtract_wrench(data, i, f);
  }
}

/// sum += what stays of A beyond a joint, A − U D⁻¹ Uᵀ, moved by t (articulated_inertia_downdated, _translated, _added).
/// A row of H after the other, so that a processor's registers hold what is needed at a time.  147 flops.
template <class T>
KSL_LANES void add_beyond_joint(const articulated_inertia<T> &A, const coscrew<T> &U, const T &inverse, const vec3<T> &t,
                                articulated_inertia<T> &sum) {
  const vec3<T> &n = U.ang;
  vec3<T> F, N;
  algebra<T>::vec3_scaled(&U.lin, inverse, &F);
  const T xx = A.Mxx - F.x * U.lin.x, yy = A.Myy - F.y * U.lin.y, zz = A.Mzz - F.z * U.lin.z;
  const T xy = A.Mxy - F.x * U.lin.y, yz = A.Myz - F.y * U.lin.z, zx = A.Mzx - F.z * U.lin.x;
  sum.Mxx = sum.Mxx + xx, sum.Myy = sum.Myy + yy, sum.Mzz = sum.Mzz + zz;
  sum.Mxy = sum.Mxy + xy, sum.Myz = sum.Myz + yz, sum.Mzx = sum.Mzx + zx;
  // h: a row of what stays of H; k: of H − M t̃
  vec3<T> h, k;
  h.x = A.H.m00 - F.x * n.x, h.y = A.H.m01 - F.x * n.y, h.z = A.H.m02 - F.x * n.z;
  k.x = h.x + (zx * t.y - xy * t.z), k.y = h.y + (xx * t.z - zx * t.x), k.z = h.z + (xy * t.x - xx * t.y);
  sum.H.m00 = sum.H.m00 + k.x, sum.H.m01 = sum.H.m01 + k.y, sum.H.m02 = sum.H.m02 + k.z;
  T Iyy = t.z * (k.y + h.y), Izz = t.y * (k.z + h.z), Ixy = t.z * h.x, Iyz = t.z * k.z - t.y * h.y, Izx = t.y * k.x;
  h.x = A.H.m10 - F.y * n.x, h.y = A.H.m11 - F.y * n.y, h.z = A.H.m12 - F.y * n.z;
  k.x = h.x + (yz * t.y - yy * t.z), k.y = h.y + (xy * t.z - yz * t.x), k.z = h.z + (yy * t.x - xy * t.y);
  sum.H.m10 = sum.H.m10 + k.x, sum.H.m11 = sum.H.m11 + k.y, sum.H.m12 = sum.H.m12 + k.z;
  T Ixx = t.z * (k.x + h.x);
  Izz = t.x * (k.z + h.z) - Izz, Ixy = Ixy - t.z * k.y, Iyz = Iyz + t.x * h.y, Izx = (t.x * k.x - t.z * h.z) - Izx;
  h.x = A.H.m20 - F.z * n.x, h.y = A.H.m21 - F.z * n.y, h.z = A.H.m22 - F.z * n.z;
  k.x = h.x + (zz * t.y - yz * t.z), k.y = h.y + (zx * t.z - zz * t.x), k.z = h.z + (yz * t.x - zx * t.y);
  sum.H.m20 = sum.H.m20 + k.x, sum.H.m21 = sum.H.m21 + k.y, sum.H.m22 = sum.H.m22 + k.z;
  Ixx = t.y * (k.x + h.x) - Ixx, Iyy = Iyy - t.x * (k.y + h.y);
  Ixy = Ixy + (t.y * k.y - t.x * h.x), Iyz = Iyz - t.x * k.z, Izx = Izx + t.y * h.z;
  algebra<T>::vec3_scaled(&n, inverse, &N);
  sum.Ixx = sum.Ixx + ((A.Ixx - N.x * n.x) + Ixx), sum.Iyy = sum.Iyy + ((A.Iyy - N.y * n.y) + Iyy);
  sum.Izz = sum.Izz + ((A.Izz - N.z * n.z) + Izz), sum.Ixy = sum.Ixy + ((A.Ixy - N.x * n.y) + Ixy);
  sum.Iyz = sum.Iyz + ((A.Iyz - N.y * n.z) + Iyz), sum.Izx = sum.Izx + ((A.Izx - N.z * n.x) + Izx);
}

/// What the parent feels of body i through its joint: A − U D⁻¹ Uᵀ and p + U D⁻¹ u; a free joint passes its effort only.
template <joint_kind K, class T>
KSL_LANES void pass_to_parent(const body<scalar_of<T>> &b, const data_view<T> &data, int i, const T *tau) {
  using algebra = ksl::algebra<T>;
  articulated_state<T> &s = data.articulated[i];
  coscrew<T> p = body_at<T>(i).template get<coscrew>(data.wrench);
  in_place<articulated_inertia, T> A(data.inertia, i);
  if constexpr (K == joint_kind::floating) {
    const mat3x3<T> R = body_at<T>(i).template get<mat3x3>(data.rotation);
    coscrew<T> effort = {{tau[0], tau[1], tau[2]}, {tau[3], tau[4], tau[5]}}, rest;
    algebra::product_CoAdrc(&R, &effort, &effort);
    algebra::subtract_cc(&effort, &p, &rest);
    s.gain = solve(*A, rest);
    p = effort;
  } else {
    const vec3<T> z = axis_of(data, i);
    const coscrew<T> U = column_along<K>(z, *A);
    const T inverse = T(1) / component_along<K>(z, U), effort = tau[0] - component_along<K>(z, p);
    s.column = U, s.inverse = inverse, s.effort = effort;
    if (b.parent == 0)
      return;
    in_place<articulated_inertia, T> sum(data.inertia, b.parent);
    add_beyond_joint(*A, U, inverse, data.offset[i], *sum);
    sum.put();
    algebra::axpy_cc(inverse * effort, &U, &p);
  }
  if (b.parent == 0)
    return;
  algebra::product_CoAdtc(&data.offset[i], &p, &p);
  add_wrench(data, b.parent, p);
}

/// Acceleration of body i beyond its steady motion, and that of its joint, once the parent's gain is known.
template <joint_kind K, class T>
KSL_LANES void accelerate(const data_view<T> &data, int i, const screw<T> &parent, T *dv) {
  using A = algebra<T>;
  articulated_state<T> &s = data.articulated[i];
  screw<T> gain; // were the joint not to accelerate
  A::product_Adtinvs(&data.offset[i], &parent, &gain);
  if constexpr (K == joint_kind::floating) {
    const mat3x3<T> R = body_at<T>(i).template get<mat3x3>(data.rotation);
    screw<T> d;
    A::subtract_ss(&s.gain, &gain, &d);
    A::product_Adrinvs(&R, &d, &d);
    dv[0] = d.lin.x, dv[1] = d.lin.y, dv[2] = d.lin.z;
    dv[3] = d.ang.x, dv[4] = d.ang.y, dv[5] = d.ang.z;
  } else {
    const vec3<T> z = axis_of(data, i);
    const T acceleration = s.inverse * (s.effort - A::dot_cs(&s.column, &gain));
    A::axpy_vv(acceleration, &z, K == joint_kind::prismatic ? &gain.lin : &gain.ang);
    dv[0] = acceleration;
    s.gain = gain;
  }
}

/// Accelerations dv (nv) for positions q (nq), velocities v (nv) and joint efforts tau (nv) under gravity and external
/// wrenches.  O(bodies), about 590 flops for each.
///
/// The motion that the mechanism would have if no joint accelerated is found first, as inverse dynamics finds it; what
/// remains is linear: the gain of each body over that motion, with no velocities in it.
template <class T>
void forward_dynamics(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, const T *v,
                      const T *tau, const external_wrenches<T> &external, T *dv) {
  start_articulated(model, data, q, v, external);
  for (int i = model.bodies - 1; i > 0; --i)
    by_kind(model.body[i].kind, [&]<joint_kind K>() KSL_INLINED {
      pass_to_parent<K>(model.body[i], data, i, tau + model.body[i].v_index);
    });

  data.articulated[0].gain = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED { accelerate<K>(data, i, data.articulated[b.parent].gain, dv + b.v_index); });
  }
}

} // namespace KSL_ISA
} // namespace ksl
