// KSL: revolute joint: q is the angle about the axis, rad.  A continuous joint moves in the same way and has no position limits.
#pragma once

#include "ksl/engine/model/joints/one_axis.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <> struct joint<joint_kind::revolute> : one_axis_joint<true, false> {
  static constexpr const char *name = "revolute";
  static constexpr bool in_urdf = true;
};

template <> struct joint<joint_kind::continuous> : joint<joint_kind::revolute> {
  static constexpr const char *name = "continuous";
  static constexpr bool has_limits = false;

  /// By the smallest rotation, between −π and π.
  template <class T> static void difference(const T *q0, const T *q1, T *dv) {
    T s, c;
    sine_cosine(q1[0] - q0[0], s, c);
    dv[0] = math<T>::atan2(s, c);
  }
};

} // namespace KSL_ISA
} // namespace ksl
