// KSL: how I and 2 B of a subtree (wrench_derivatives.hpp) change with the position and the velocity of its joint.
//
// Both are sums over particles m at r with velocities ṙ.  A position changes along S = (s, ω), with v held componentwise:
//
//     r changes by s + ω × r,   ṙ by ω × ṙ + Ψ̇.lin + Ψ̇.ang × r.                                                 (1)
//
// A velocity along S leaves r as it is, and changes ṙ by s + ω × r.                                               (2)
#pragma once

#include "ksl/engine/algorithms/derivatives/wrench_derivatives.hpp"

namespace ksl {

/// A linear function 2 B, by its K and twice_p ((2) of wrench_derivatives.hpp).
template <class T> struct velocity_product {
  mat3x3<T> K;
  vec3<T> twice_p;
};

/// How I and 2 B of the subtree of a coordinate change with it.
template <class T> struct subtree_rates {
  spatial_inertia<T> I_by_q;  ///< S ×* I − I S ×; its mass is zero
  velocity_product<T> B_by_q; ///< by (1): S ×* 2 B − 2 B S × + 2 B(I, Ψ̇)
  velocity_product<T> B_by_v; ///< by (2): 2 B(I, S)
};

inline namespace KSL_ISA {

/// S ×* I − I S ×: how I changes if its particles are displaced by S.
template <class T> KSL_LANES spatial_inertia<T> inertia_rate(const spatial_inertia<T> &I, const screw<T> &S) {
  const vec3<T> &s = S.lin, &w = S.ang, &h = I.h;
  const T two = T(2);
  spatial_inertia<T> rate;
  rate.m = T(0);
  algebra<T>::cross_vv(&w, &h, &rate.h);
  algebra<T>::axpy_vv(I.m, &s, &rate.h);
  const T x = s.x * h.x, y = s.y * h.y, z = s.z * h.z;
  rate.Ixx = two * ((w.y * I.Izx - w.z * I.Ixy) + (y + z));
  rate.Iyy = two * ((w.z * I.Ixy - w.x * I.Iyz) + (z + x));
  rate.Izz = two * ((w.x * I.Iyz - w.y * I.Izx) + (x + y));
  rate.Ixy = (w.y * I.Iyz - w.x * I.Izx) + (w.z * (I.Ixx - I.Iyy) - (s.x * h.y + s.y * h.x));
  rate.Iyz = (w.z * I.Izx - w.y * I.Ixy) + (w.x * (I.Iyy - I.Izz) - (s.y * h.z + s.z * h.y));
  rate.Izx = (w.x * I.Ixy - w.z * I.Iyz) + (w.y * (I.Izz - I.Ixx) - (s.z * h.x + s.x * h.z));
  return rate;
}

/// 2 B(I, twist): that of a body with the inertia I that moves with a twist.
template <class T> KSL_LANES velocity_product<T> moving(const spatial_inertia<T> &I, const screw<T> &twist) {
  velocity_product<T> B;
  algebra<T>::cross_vv(&twist.ang, &I.h, &B.twice_p);
  algebra<T>::axpy_vv(I.m, &twist.lin, &B.twice_p);
  algebra<T>::add_vv(&B.twice_p, &B.twice_p, &B.twice_p);
  B.K = moment_of_momentum(I, twist);
  return B;
}

/// ω̃ K − K ω̃ + (p · s) 1 − p sᵀ: how K changes if its particles are displaced by S and their velocities are turned with them; p is
/// twice_p.
template <class T> KSL_LANES mat3x3<T> displaced_rate(const mat3x3<T> &K, const vec3<T> &p, const screw<T> &S) {
  const vec3<T> &s = S.lin, &w = S.ang;
  const T x = p.x * s.x, y = p.y * s.y, z = p.z * s.z;
  mat3x3<T> rate;
  rate.m00 = (w.y * (K.m20 + K.m02) - w.z * (K.m10 + K.m01)) + (y + z);
  rate.m11 = (w.z * (K.m01 + K.m10) - w.x * (K.m21 + K.m12)) + (z + x);
  rate.m22 = (w.x * (K.m12 + K.m21) - w.y * (K.m02 + K.m20)) + (x + y);
  rate.m01 = (w.y * K.m21 - w.x * K.m02) + (w.z * (K.m00 - K.m11) - p.x * s.y);
  rate.m10 = (w.y * K.m12 - w.x * K.m20) + (w.z * (K.m00 - K.m11) - p.y * s.x);
  rate.m12 = (w.z * K.m02 - w.y * K.m10) + (w.x * (K.m11 - K.m22) - p.y * s.z);
  rate.m21 = (w.z * K.m20 - w.y * K.m01) + (w.x * (K.m11 - K.m22) - p.z * s.y);
  rate.m20 = (w.x * K.m10 - w.z * K.m21) + (w.y * (K.m22 - K.m00) - p.z * s.x);
  rate.m02 = (w.x * K.m01 - w.z * K.m12) + (w.y * (K.m22 - K.m00) - p.x * s.z);
  return rate;
}

/// The rates of the subtree of a coordinate.  d is the sum over this subtree.
template <class T> KSL_LANES subtree_rates<T> rates_of(const subtree_dynamics<T> &d, const coordinate_motion<T> &c) {
  using A = algebra<T>;
  subtree_rates<T> rates;
  rates.I_by_q = inertia_rate(d.I, c.S);
  rates.B_by_v = moving(d.I, c.S);
  rates.B_by_q = moving(d.I, c.velocity_by_q);
  const mat3x3<T> turned = displaced_rate(d.K, d.twice_p, c.S);
  vec3<T> p;
  A::cross_vv(&c.S.ang, &d.twice_p, &p);
  A::xpy_vv(&p, &rates.B_by_q.twice_p);
  T *const sum = reinterpret_cast<T *>(&rates.B_by_q.K);
  for (int k = 0; k < 9; ++k)
    sum[k] = sum[k] + reinterpret_cast<const T *>(&turned)[k];
  return rates;
}

/// 2 B x; x is the angular half, which is all that counts.
template <class T> KSL_LANES coscrew<T> product(const velocity_product<T> &B, const vec3<T> &x) {
  coscrew<T> y;
  algebra<T>::cross_vv(&x, &B.twice_p, &y.lin);
  algebra<T>::product_drv(&B.K, &x, &y.ang);
  return y;
}

} // namespace KSL_ISA
} // namespace ksl
