// KSL: rotations about coordinate axes.  Every orientation in a model is composed of them.
//
// Such a rotation changes two components of a vector and costs 6 flops.  Three of them compose any rotation, and the first is
// not needed if a body's x axis is chosen well (Denavit and Hartenberg 1955).
#pragma once

#include "ksl/pack.hpp"

namespace ksl {

/// An angle, by its sine and cosine.
template <class T> struct plane_rotation { T sine, cosine; };

inline constexpr plane_rotation<double> no_rotation = {0, 1};

/// An angle, for the elements of symmetric matrices: products of sine and cosine, and those of twice the angle.
template <class T> struct tensor_rotation { T cosine_sine, sine_sine, twice_sine, twice_cosine; };

inline namespace KSL_ISA {

/// The rotation through the sum of both angles.
template <class T> KSL_LANES plane_rotation<T> product(const plane_rotation<T> &a, const plane_rotation<T> &b) {
  return {a.sine * b.cosine + a.cosine * b.sine, a.cosine * b.cosine - a.sine * b.sine};
}

template <class T> KSL_LANES plane_rotation<T> inverse(const plane_rotation<T> &a) { return {-a.sine, a.cosine}; }

/// Rotates two coordinates in their plane, u towards v; rotate_back inverts it.  6 flops.
template <class T> KSL_LANES void rotate(const plane_rotation<T> &a, T &u, T &v) {
  const T w = u;
  u = a.cosine * w - a.sine * v;
  v = a.sine * w + a.cosine * v;
}
template <class T> KSL_LANES void rotate_back(const plane_rotation<T> &a, T &u, T &v) {
  const T w = u;
  u = a.cosine * w + a.sine * v;
  v = a.cosine * v - a.sine * w;
}

/// An angle prepared for symmetric matrices.  5 flops.
template <class T> KSL_LANES tensor_rotation<T> of_tensor(const plane_rotation<T> &a) {
  const T cs = a.cosine * a.sine, ss = a.sine * a.sine;
  return {cs, ss, cs + cs, a.cosine * a.cosine - ss};
}

/// Rotates the elements of a symmetric matrix in such a plane.  9 flops.
template <class T> KSL_LANES void rotate_symmetric(const tensor_rotation<T> &a, T &uu, T &vv, T &uv) {
  const T d = vv - uu, moved = a.sine_sine * d - a.twice_sine * uv;
  uu = uu + moved;
  vv = vv - moved;
  uv = a.twice_cosine * uv - a.cosine_sine * d;
}

/// Rx v, Rz v, and their inverses.
template <class T> KSL_LANES void rotate_x(const plane_rotation<T> &a, vec3<T> &v) { rotate(a, v.y, v.z); }
template <class T> KSL_LANES void rotate_z(const plane_rotation<T> &a, vec3<T> &v) { rotate(a, v.x, v.y); }
template <class T> KSL_LANES void rotate_back_x(const plane_rotation<T> &a, vec3<T> &v) { rotate_back(a, v.y, v.z); }
template <class T> KSL_LANES void rotate_back_z(const plane_rotation<T> &a, vec3<T> &v) { rotate_back(a, v.x, v.y); }

/// Rx I, and Rz I: 21 flops, and 5 that prepare the angle.
template <class T>
KSL_LANES void rotate_x(const plane_rotation<T> &a, const tensor_rotation<T> &twice, spatial_inertia<T> &I) {
  rotate_x(a, I.h);
  rotate_symmetric(twice, I.Iyy, I.Izz, I.Iyz);
  rotate(a, I.Ixy, I.Izx);
}
template <class T> KSL_LANES void rotate_z(const plane_rotation<T> &a, spatial_inertia<T> &I) {
  rotate_z(a, I.h);
  rotate_symmetric(of_tensor(a), I.Ixx, I.Iyy, I.Ixy);
  rotate(a, I.Izx, I.Iyz);
}

} // namespace KSL_ISA
} // namespace ksl
