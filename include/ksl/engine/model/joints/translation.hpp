// KSL: translation joint: q is the position, m, and v the velocity, m/s, both along the axes of the joint's frame.
#pragma once

#include "ksl/engine/model/joints/several_axes.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <> struct joint<joint_kind::translation> : several_axes_joint<0, 1, 2> {
  static constexpr const char *name = "translation";
  static constexpr int nq = 3, angle = -1, quaternion = -1, pose_numbers = 3; // its translation

  template <class T>
  static KSL_LANES free_pose<T> computed_pose(const body<scalar_of<T>> &b, const pose_workspace<T> &w, const T *q) {
    free_pose<T> D = {spread<T>(b.placement.R), spread<T>(b.placement.t)};
    vec3<T> moved = {q[b.q_index], q[b.q_index + 1], q[b.q_index + 2]};
    algebra<T>::product_drv(&D.R, &moved, &moved);
    algebra<T>::xpy_vv(&moved, &D.t);
    w.template kept<vec3>(b) = D.t;
    return D;
  }
  template <class T> static KSL_LANES free_pose<T> kept_pose(const body<scalar_of<T>> &b, const pose_workspace<T> &w) {
    return {spread<T>(b.placement.R), w.template kept<vec3>(b)};
  }

  template <class T> static void integrate(const T *q, const T *dv, T *out) { add_numbers<3>(q, dv, out); }
  template <class T> static void difference(const T *q0, const T *q1, T *dv) { subtract_numbers<3>(q1, q0, dv); }
};

} // namespace KSL_ISA
} // namespace ksl
