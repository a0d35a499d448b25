// KSL: quaternions [x y z w] as the orientation of joints.
#pragma once

#include "ksl/engine/lanes/sine_cosine.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// The rotation of a quaternion [x y z w]; it need not be of unit length.
template <class T> inline mat3x3<T> rotation_of(const T q[4]) {
  const T x = q[0], y = q[1], z = q[2], w = q[3], one = T(1);
  const T s = T(2) / (x * x + y * y + z * z + w * w);
  return {one - s * (y * y + z * z), s * (x * y + z * w),       s * (x * z - y * w),
          s * (x * y - z * w),       one - s * (x * x + z * z), s * (y * z + x * w),
          s * (x * z + y * w),       s * (y * z - x * w),       one - s * (x * x + y * y)};
}

/// out = q exp(w/2), of unit length: the orientation after unit time at the angular velocity w, in the body's axes.
template <class T> KSL_LANES void integrate_quaternion(const T *q, const vec3<T> &w, T *out) {
  using A = algebra_with_own_sines<T>;
  quaternion<T> p = {q[0], q[1], q[2], q[3]}, step;
  A::quaternion_exp(&w, &step);
  A::product_qq(&p, &step, &p);
  A::quaternion_normalize(&p);
  out[0] = p.x, out[1] = p.y, out[2] = p.z, out[3] = p.w;
}

/// The angular velocity, in the body's axes, that leads from q0 to q1 in unit time by the smallest rotation.
template <class T> inline vec3<T> difference_of_quaternions(const T *q0, const T *q1) {
  using A = algebra<T>;
  const quaternion<T> a = {q0[0], q0[1], q0[2], q0[3]}, b = {q1[0], q1[1], q1[2], q1[3]};
  quaternion<T> d;
  vec3<T> w;
  A::product_qconjq(&a, &b, &d);
  A::quaternion_log(&d, &w);
  return w;
}

} // namespace KSL_ISA
} // namespace ksl
