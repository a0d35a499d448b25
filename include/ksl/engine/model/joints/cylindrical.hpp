// KSL: cylindrical joint: q is the angle about the axis, rad, then the displacement along it, m.  The two are independent.
#pragma once

#include "ksl/engine/model/joints/several_axes.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <> struct joint<joint_kind::cylindrical> : several_axes_joint<5, 2> {
  static constexpr const char *name = "cylindrical";
  static constexpr int nq = 2, angle = 0, quaternion = -1, pose_numbers = 3; // its translation
  static constexpr bool has_axis = true, canonical_x = true;
  static constexpr position_number positions[] = {{"angle", "rad"}, {"travel", "m"}};
  static constexpr velocity_number velocities[] = {{"angle.v", "angle.a", "angle", "rad"},
                                                   {"travel.v", "travel.a", "travel", "m"}};

  /// The body's pose, in a canonical frame as that of a joint with one axis: z is along the axis.
  template <class T>
  static KSL_LANES axis_pose<T> computed_pose(const body<scalar_of<T>> &b, const pose_workspace<T> &w, const T *q) {
    axis_pose<T> D = {b, w.rotation(b), spread<T>(b.placement.t)};
    const auto &R = b.placement.R;
    const vec3<T> z = {T(R.m02), T(R.m12), T(R.m22)};
    algebra<T>::axpy_vv(q[b.q_index + 1], &z, &D.t);
    w.template kept<vec3>(b) = D.t;
    return D;
  }
  template <class T> static KSL_LANES axis_pose<T> kept_pose(const body<scalar_of<T>> &b, const pose_workspace<T> &w) {
    return {b, w.rotation(b), w.template kept<vec3>(b)};
  }

  template <class T> static void integrate(const T *q, const T *dv, T *out) { add_numbers<2>(q, dv, out); }
  template <class T> static void difference(const T *q0, const T *q1, T *dv) { subtract_numbers<2>(q1, q0, dv); }
};

} // namespace KSL_ISA
} // namespace ksl
