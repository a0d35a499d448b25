// KSL: floating joint: q is the position, m, and a quaternion, [x y z qx qy qz qw]; v the linear and the angular velocity in
// the child's axes.
#pragma once

#include "ksl/engine/model/joints/quaternion.hpp"
#include "ksl/engine/model/joints/several_axes.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <> struct joint<joint_kind::floating> : several_axes_joint<0, 1, 2, 3, 4, 5> {
  static constexpr const char *name = "floating", *other_name = "free";
  static constexpr int nq = 7, angle = -1, quaternion = 3, pose_numbers = 12;
  static constexpr bool in_urdf = true;
  static constexpr position_number positions[] = {{"x", "m"}, {"y", "m"}, {"z", "m"}, {"qx", ""},
                                                  {"qy", ""}, {"qz", ""}, {"qw", ""}};

  /// The pose in the parent: placement · (R(q), p).
  template <class T>
  static KSL_LANES free_pose<T> computed_pose(const body<scalar_of<T>> &b, const pose_workspace<T> &w, const T *q) {
    const T *const p = q + b.q_index;
    const SE3<T> placement = spread<T>(b.placement);
    SE3<T> D = {rotation_of(p + quaternion), {p[0], p[1], p[2]}};
    algebra<T>::product_dd(&placement, &D, &D);
    w.template kept<SE3>(b) = D;
    return {D.R, D.t};
  }
  template <class T> static KSL_LANES free_pose<T> kept_pose(const body<scalar_of<T>> &b, const pose_workspace<T> &w) {
    const SE3<T> &D = w.template kept<SE3>(b);
    return {D.R, D.t};
  }

  /// Moves by the exponential of the constant twist dv.
  template <class T> static void integrate(const T *q, const T *dv, T *out) {
    SE3<T> step;
    const screw<T> s = {{dv[0], dv[1], dv[2]}, {dv[3], dv[4], dv[5]}};
    algebra_with_own_sines<T>::SE3_exp(&s, &step);
    const mat3x3<T> R = rotation_of(q + quaternion);
    algebra<T>::product_drv(&R, &step.t, &step.t);
    out[0] = q[0] + step.t.x, out[1] = q[1] + step.t.y, out[2] = q[2] + step.t.z;
    integrate_quaternion(q + quaternion, s.ang, out + quaternion);
  }
  /// The twist whose exponential leads from q0 to q1: log(D0⁻¹ D1).
  template <class T> static void difference(const T *q0, const T *q1, T *dv) {
    SE3<T> D0 = {rotation_of(q0 + quaternion), {q0[0], q0[1], q0[2]}};
    SE3<T> D = {rotation_of(q1 + quaternion), {q1[0], q1[1], q1[2]}};
    screw<T> s;
    algebra<T>::product_dinvd(&D0, &D, &D);
    algebra_with_own_sines<T>::SE3_log(&D, &s);
    dv[0] = s.lin.x, dv[1] = s.lin.y, dv[2] = s.lin.z;
    dv[3] = s.ang.x, dv[4] = s.ang.y, dv[5] = s.ang.z;
  }
};

} // namespace KSL_ISA
} // namespace ksl
