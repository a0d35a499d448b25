// KSL: the common part of joints with one axis, S = (h z, z) in the body's canonical frame: revolute (h = 0), prismatic
// (S = (z, 0)) and helical.  The kind is a template argument, so that products with zero are not computed.
#pragma once

#include "ksl/engine/model/body_motion.hpp"
#include "ksl/engine/model/joints/column.hpp"
#include "ksl/engine/model/pose_in_parent.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// out = x + y and out = x − y, of n numbers: positions of coordinates that are independent of each other.
template <int n, class T> void add_numbers(const T *x, const T *y, T *out) {
  for (int i = 0; i < n; ++i)
    out[i] = x[i] + y[i];
}
template <int n, class T> void subtract_numbers(const T *x, const T *y, T *out) {
  for (int i = 0; i < n; ++i)
    out[i] = x[i] - y[i];
}

/// The struct of a kind; joints.hpp lists the members that it must have.
template <joint_kind K> struct joint;

template <bool turns, bool slides> struct one_axis_joint {
  static constexpr const char *other_name = nullptr;
  static constexpr int nq = 1, nv = 1;
  static constexpr int coordinate[nv] = {turns && slides ? helical_coordinate : turns ? 5 : 2};
  static constexpr bool has_axis = true, has_axis2 = false, has_pitch = turns && slides, has_limits = true,
                        is_free = false;
  static constexpr bool in_urdf = false, velocity_is_rate = true;
  static constexpr position_number positions[] = {{"", turns ? "rad" : "m"}};
  static constexpr velocity_number velocities[] = {{"v", "a", "", turns ? "rad" : "m"}};
  static constexpr bool canonical_x = true, shifts_origin = slides;
  static constexpr int angle = turns ? 0 : -1, quaternion = -1, usual_axis = 0;
  static constexpr int pose_numbers = slides ? 3 : 0; // its translation
  template <class T> using column_type = joint_column<turns, slides, T>;

  /// The body's pose at the joint position in q, after sines_and_cosines.  Stores the numbers that depend on q; kept_pose
  /// reloads them.
  template <class T>
  static KSL_LANES axis_pose<T> computed_pose(const body<scalar_of<T>> &b, const pose_workspace<T> &w, const T *q) {
    axis_pose<T> D = {b, rotation_about_z(b, w), spread<T>(b.placement.t)};
    if constexpr (slides) {
      const auto &R = b.placement.R;
      const vec3<T> z = {T(R.m02), T(R.m12), T(R.m22)};
      algebra<T>::axpy_vv(along(b, q[b.q_index]), &z, &D.t);
      w.template kept<vec3>(b) = D.t;
    }
    return D;
  }
  template <class T> static KSL_LANES axis_pose<T> kept_pose(const body<scalar_of<T>> &b, const pose_workspace<T> &w) {
    return {b, rotation_about_z(b, w), slides ? w.template kept<vec3>(b) : spread<T>(b.placement.t)};
  }

  /// S q̇
  template <class T> static KSL_LANES screw<T> twist(const body<scalar_of<T>> &b, const T *v) {
    const T zero = T(0);
    return {{zero, zero, slides ? along(b, v[0]) : zero}, {zero, zero, turns ? v[0] : zero}};
  }

  /// effort: tau = Sᵀ f.  drive: the wrench h* tau, which has this effort and no constraint part (joint_space.h).
  template <class T> static KSL_LANES void effort(const body<scalar_of<T>> &b, const coscrew<T> &f, T *tau) {
    if constexpr (turns && slides)
      tau[0] = T(b.pitch) * f.lin.z + f.ang.z;
    else
      tau[0] = slides ? f.lin.z : f.ang.z;
  }
  template <class T> static KSL_LANES coscrew<T> drive(const body<scalar_of<T>> &, const T *tau) {
    const T zero = T(0);
    return {{zero, zero, turns ? zero : tau[0]}, {zero, zero, turns ? tau[0] : zero}};
  }

  /// Adds the joint's motion, given by its velocity and acceleration, to m.  On entry m is the motion of the joint's frame as it
  /// is carried by the parent.
  template <class T>
  static KSL_LANES void add_motion(const body<scalar_of<T>> &b, const T *v, const T *dv, body_motion<T> &m) {
    vec3<T> &w = m.angular_velocity, &dw = m.angular_acceleration, &a = m.acceleration;
    if constexpr (slides) { // a += 2 ω × z q̇ + z q̈
      const T rate = along(b, v[0]);
      a.x = a.x + T(2) * w.y * rate;
      a.y = a.y - T(2) * w.x * rate;
      a.z = a.z + along(b, dv[0]);
    }
    if constexpr (turns) { // ω̇ += ω × z q̇ + z q̈,  ω += z q̇
      dw.x = dw.x + w.y * v[0];
      dw.y = dw.y - w.x * v[0];
      dw.z = dw.z + dv[0];
      w.z = w.z + v[0];
    }
  }

  /// Adds the motion without joint acceleration, in the axes of the base, to which `rotation` leads.
  template <class T>
  static KSL_LANES void add_steady_motion(const body<scalar_of<T>> &b, const per_body<mat3x3, T> &rotation, int i,
                                          const T *v, body_motion<T> &m) {
    using A = algebra<T>;
    const vec3<T> z = axis_of(rotation, i);
    vec3<T> coupling;
    A::cross_vv(&m.angular_velocity, &z, &coupling);
    if constexpr (slides)
      A::axpy_vv(T(2) * along(b, v[0]), &coupling, &m.acceleration);
    if constexpr (turns) {
      A::axpy_vv(v[0], &coupling, &m.angular_acceleration);
      A::axpy_vv(v[0], &z, &m.angular_velocity);
    }
  }

  /// column: S in the axes of the base, or in those to which R leads.  momentum: I S in the body's own axes.
  template <class Index, class T>
  static KSL_LANES column_type<T> column(Index, const body<scalar_of<T>> &b, const per_body<mat3x3, T> &rotation,
                                         int i) {
    return {axis_of(rotation, i), T(b.pitch)};
  }
  template <class Index, class T> static KSL_LANES column_type<T> column(Index, const body<scalar_of<T>> &b,
                                                                         const mat3x3<T> &R) {
    return {axis_of<2>(R), T(b.pitch)};
  }
  template <class Index, class T>
  static KSL_LANES coscrew<T> momentum(Index, const body<scalar_of<T>> &b, const spatial_inertia<T> &I) {
    coscrew<T> p = unit_momentum(turns ? 5 : 2, I);
    if constexpr (turns && slides) {
      const coscrew<T> advance = unit_momentum(2, I);
      algebra<T>::axpy_cc(T(b.pitch), &advance, &p);
    }
    return p;
  }

  /// integrate: q ⊕ dv, the position after unit time at the joint velocity dv.  difference: dv = q1 ⊖ q0, which leads from q0
  /// to q1.
  template <class T> static void integrate(const T *q, const T *dv, T *out) { out[0] = q[0] + dv[0]; }
  template <class T> static void difference(const T *q0, const T *q1, T *dv) { dv[0] = q1[0] - q0[0]; }

  /// Derivatives of integrate and difference, as blocks of matrices whose rows lie `stride` numbers apart.  A position changes along q ⊕ s e_k.
  /// integrate_jacobians: of q ⊕ dv by q and by dv.  difference_jacobians: of dv = q1 ⊖ q0 by q0 and by q1.
  template <class T> static void integrate_jacobians(const T *, T *by_q, T *by_dv, int) { by_q[0] = by_dv[0] = T(1); }
  template <class T> static void difference_jacobians(const T *, T *by_q0, T *by_q1, int) {
    by_q0[0] = T(-1), by_q1[0] = T(1);
  }

private:
  /// Displacement along the axis for a change x of the joint's coordinate.
  template <class T> static KSL_LANES T along(const body<scalar_of<T>> &b, const T &x) {
    return turns ? T(b.pitch) * x : x;
  }
  template <class T>
  static KSL_LANES plane_rotation<T> rotation_about_z(const body<scalar_of<T>> &b, const pose_workspace<T> &w) {
    if constexpr (turns)
      return w.rotation(b);
    else
      return spread<T>(b.theta0);
  }
};

} // namespace KSL_ISA
} // namespace ksl
