// KSL: spherical joint: q is a quaternion [x y z w], v the angular velocity in the child's axes, rad/s.
#pragma once

#include "ksl/engine/model/joints/quaternion.hpp"
#include "ksl/engine/model/joints/several_axes.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <> struct joint<joint_kind::spherical> : several_axes_joint<3, 4, 5> {
  static constexpr const char *name = "spherical", *other_name = "ball";
  static constexpr int nq = 4, angle = -1, quaternion = 0, pose_numbers = 9; // its rotation
  static constexpr position_number positions[] = {{"qx", ""}, {"qy", ""}, {"qz", ""}, {"qw", ""}};

  template <class T>
  static KSL_LANES free_pose<T> computed_pose(const body<scalar_of<T>> &b, const pose_workspace<T> &w, const T *q) {
    free_pose<T> D = {spread<T>(b.placement.R), spread<T>(b.placement.t)};
    const mat3x3<T> R = rotation_of(q + b.q_index);
    algebra<T>::product_drdr(&D.R, &R, &D.R);
    w.template kept<mat3x3>(b) = D.R;
    return D;
  }
  template <class T> static KSL_LANES free_pose<T> kept_pose(const body<scalar_of<T>> &b, const pose_workspace<T> &w) {
    return {w.template kept<mat3x3>(b), spread<T>(b.placement.t)};
  }

  template <class T> static void integrate(const T *q, const T *dv, T *out) {
    integrate_quaternion(q, {dv[0], dv[1], dv[2]}, out);
  }
  template <class T> static void difference(const T *q0, const T *q1, T *dv) {
    const vec3<T> w = difference_of_quaternions(q0, q1);
    dv[0] = w.x, dv[1] = w.y, dv[2] = w.z;
  }
};

} // namespace KSL_ISA
} // namespace ksl
