// KSL: fixed joint: no motion.  The links on both sides are one body, so algorithms never see such a joint.
#pragma once

#include "ksl/engine/model/joints/one_axis.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <> struct joint<joint_kind::fixed> {
  static constexpr const char *name = "fixed", *other_name = nullptr;
  static constexpr int nq = 0, nv = 0;
  static constexpr bool has_axis = false, has_axis2 = false, has_pitch = false, has_limits = false, is_free = false;
  static constexpr bool in_urdf = true, velocity_is_rate = true;
  static constexpr const position_number *positions = nullptr;
  static constexpr const velocity_number *velocities = nullptr;
  static constexpr bool canonical_x = false, shifts_origin = false;
  static constexpr int angle = -1, quaternion = -1, pose_numbers = 0, usual_axis = 0;
  template <class T> static void integrate(const T *, const T *, T *) {}
  template <class T> static void difference(const T *, const T *, T *) {}
};

} // namespace KSL_ISA
} // namespace ksl
