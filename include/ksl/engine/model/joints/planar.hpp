// KSL: planar joint: q is the position in the plane, x and y, m, then the angle about its normal z, rad.  v is the velocity
// along the child's axes x and y, m/s, then the rate of the angle, rad/s.
#pragma once

#include "ksl/engine/model/joints/several_axes.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <> struct joint<joint_kind::planar> : several_axes_joint<0, 1, 5> {
  static constexpr const char *name = "planar";
  static constexpr int nq = 3, angle = 2, quaternion = -1, pose_numbers = 12, usual_axis = 2;
  static constexpr bool has_axis = true, in_urdf = true;

  /// The translation (x, y, 0) in the joint's frame, then the rotation about z.
  template <class T>
  static KSL_LANES free_pose<T> computed_pose(const body<scalar_of<T>> &b, const pose_workspace<T> &w, const T *q) {
    const mat3x3<T> R = spread<T>(b.placement.R);
    SE3<T> D = {R, spread<T>(b.placement.t)};
    vec3<T> moved = {q[b.q_index], q[b.q_index + 1], T(0)};
    const plane_rotation<T> theta = w.rotation(b);
    const T about_z[2] = {theta.sine, theta.cosine};
    algebra<T>::product_drv(&R, &moved, &moved);
    algebra<T>::xpy_vv(&moved, &D.t);
    algebra<T>::product_drdrz(&R, about_z, &D.R);
    w.template kept<SE3>(b) = D;
    return {D.R, D.t};
  }
  template <class T> static KSL_LANES free_pose<T> kept_pose(const body<scalar_of<T>> &b, const pose_workspace<T> &w) {
    const SE3<T> &D = w.template kept<SE3>(b);
    return {D.R, D.t};
  }

  /// Moves by the exponential of the constant twist dv: along an arc.
  template <class T> static void integrate(const T *q, const T *dv, T *out) {
    T sine, cosine;
    sine_cosine_in_lanes(q[2], sine, cosine);
    SE3<T> step, D = pose_at(q, sine, cosine);
    const screw<T> s = {{dv[0], dv[1], T(0)}, {T(0), T(0), dv[2]}};
    const T turned = q[2] + dv[2];
    algebra_with_own_sines<T>::SE3_exp(&s, &step);
    algebra<T>::product_dv(&D, &step.t, &step.t);
    out[0] = step.t.x, out[1] = step.t.y, out[2] = turned;
  }
  /// The twist whose exponential leads from q0 to q1, by the smallest rotation, between −π and π.
  template <class T> static void difference(const T *q0, const T *q1, T *dv) {
    T sine[2], cosine[2];
    sines_cosines(q0[2], q1[2], sine, cosine);
    const SE3<T> D0 = pose_at(q0, sine[0], cosine[0]);
    SE3<T> D = pose_at(q1, sine[1], cosine[1]);
    screw<T> s;
    algebra<T>::product_dinvd(&D0, &D, &D);
    algebra_with_own_sines<T>::SE3_log(&D, &s);
    dv[0] = s.lin.x, dv[1] = s.lin.y, dv[2] = s.ang.z;
  }

private:
  template <class T> static SE3<T> pose_at(const T *q, const T &s, const T &c) {
    const T o = T(0), l = T(1);
    return {{c, s, o, -s, c, o, o, o, l}, {q[0], q[1], o}};
  }
};

} // namespace KSL_ISA
} // namespace ksl
