// KSL: what each kind of joint does: the pose of its body in the parent, and Sᵀ f.  Canonical frames: axes are z.
#pragma once

#include "ksl/engine/data.hpp"
#include "ksl/engine/sine_cosine.hpp"
#include "ksl/engine/spread.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Sine and cosine of every number in q, angle or not: a register at a time is cheaper than choosing.
template <class T> void sines_and_cosines(int nq, const T *q, T *sine, T *cosine) {
  for (int i = 0; i < nq; ++i)
    sine_cosine(q[i], sine[i], cosine[i]);
}

/// The same for plain doubles, with the joints in the lanes.
template <> inline void sines_and_cosines<double>(int nq, const double *q, double *sine, double *cosine) {
  using P = native_pack<double>;
  constexpr int lanes = native_lanes<double>;
  for (int i = 0; i < nq; i += lanes) {
    P s, c;
    sine_cosine(load_first(q + i, nq - i), s, c);
    __builtin_memcpy(sine + i, &s, sizeof s);
    __builtin_memcpy(cosine + i, &c, sizeof c);
  }
}

/// The rotation of a quaternion [x y z w]; it need not be of unit length.
template <class T> inline mat3x3<T> rotation_of(const T q[4]) {
  const T x = q[0], y = q[1], z = q[2], w = q[3], one = T(1);
  const T s = T(2) / (x * x + y * y + z * z + w * w);
  return {one - s * (y * y + z * z), s * (x * y + z * w),       s * (x * z - y * w),
          s * (x * y - z * w),       one - s * (x * x + z * z), s * (y * z + x * w),
          s * (x * z + y * w),       s * (y * z - x * w),       one - s * (x * x + y * y)};
}

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

/// Pose of a body in its parent at the joint position that q holds for it; after sines_and_cosines.
template <joint_kind K, class T>
KSL_LANES SE3<T> pose_in_parent(const body<scalar_of<T>> &b, const data_view<T> &data, const T *q) {
  using A = algebra<T>;
  const int i = b.q_index;
  SE3<T> D = spread<T>(b.placement);
  if constexpr (K == joint_kind::revolute) {
    T dc[2] = {data.sine[i], data.cosine[i]};
    A::product_drdrz(&D.R, dc, &D.R);
  } else if constexpr (K == joint_kind::prismatic) {
    A::product_ddtz(&D, q[i], &D);
  } else {
    const SE3<T> motion = {rotation_of(q + i + 3), {q[i], q[i + 1], q[i + 2]}};
    A::product_dd(&D, &motion, &D);
  }
  return D;
}

/// Copies of the pose of a body in its parent what its joint changes.
template <joint_kind K, class T> KSL_LANES void copy_changed(const SE3<T> &from, SE3<T> &to) {
  if constexpr (K != joint_kind::prismatic) {
    to.R.m00 = from.R.m00, to.R.m10 = from.R.m10, to.R.m20 = from.R.m20;
    to.R.m01 = from.R.m01, to.R.m11 = from.R.m11, to.R.m21 = from.R.m21;
  }
  if constexpr (K == joint_kind::floating)
    to.R.m02 = from.R.m02, to.R.m12 = from.R.m12, to.R.m22 = from.R.m22;
  if constexpr (K != joint_kind::revolute)
    to.t.x = from.t.x, to.t.y = from.t.y, to.t.z = from.t.z;
}

/// Keeps of a pose what the joint changes, and completes it again from the model: to store a register costs as much as two
/// sums.
template <joint_kind K, class T> KSL_LANES void keep_pose(const SE3<T> &D, SE3<T> &kept) { copy_changed<K>(D, kept); }
template <joint_kind K, class T> KSL_LANES SE3<T> kept_pose(const body<scalar_of<T>> &b, const SE3<T> &kept) {
  SE3<T> D = spread<T>(b.placement);
  copy_changed<K>(kept, D);
  return D;
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
