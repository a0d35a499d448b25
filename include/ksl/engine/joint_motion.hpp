// KSL: what each kind of joint does: its twist, S q̇, and Sᵀ f.  Canonical frames: axes are z.
#pragma once

#include "ksl/engine/pose_in_parent.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// step.operator()<K>() for a kind of joint, K one of those that differ in motion: revolute, prismatic, floating.  Each gets
/// code of its own: where kinds meet, what they leave goes through memory.  Bodies have no fixed joints.
template <class Step> KSL_LANES void by_kind(joint_kind kind, Step step) {
  if (turns(kind))
    step.template operator()<joint_kind::revolute>();
  else if (kind == joint_kind::prismatic)
    step.template operator()<joint_kind::prismatic>();
  else
    step.template operator()<joint_kind::floating>();
}

/// Twist of a joint, S q̇, from its velocities v, in its body's frame.
template <joint_kind K, class T> KSL_LANES screw<T> joint_twist(const T *v) {
  const T zero = T(0);
  if constexpr (K == joint_kind::revolute)
    return {{zero, zero, zero}, {zero, zero, v[0]}};
  else if constexpr (K == joint_kind::prismatic)
    return {{zero, zero, v[0]}, {zero, zero, zero}};
  else
    return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

/// Effort of a wrench on a joint: Sᵀ f.
template <joint_kind K, class T> KSL_LANES void joint_effort(const coscrew<T> &f, T *tau) {
  if constexpr (K == joint_kind::revolute) {
    tau[0] = f.ang.z;
  } else if constexpr (K == joint_kind::prismatic) {
    tau[0] = f.lin.z;
  } else {
    tau[0] = f.lin.x, tau[1] = f.lin.y, tau[2] = f.lin.z;
    tau[3] = f.ang.x, tau[4] = f.ang.y, tau[5] = f.ang.z;
  }
}

} // namespace KSL_ISA
} // namespace ksl
