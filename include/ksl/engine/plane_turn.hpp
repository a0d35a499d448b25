// KSL: turns about coordinate axes, of which every orientation in a model is made.
//
// A turn about an axis changes two numbers of a vector for 6 flops; three of them bring it from any axes into any others,
// and the first is not needed where a body's x axis is chosen well (Denavit and Hartenberg 1955).
#pragma once

#include "ksl/pack.hpp"

namespace ksl {

/// An angle, by its sine and cosine.
template <class T> struct plane_turn { T sine, cosine; };

inline constexpr plane_turn<double> no_turn = {0, 1};

inline namespace KSL_ISA {

/// a by b: the turn through both angles.
template <class T> KSL_LANES plane_turn<T> product(const plane_turn<T> &a, const plane_turn<T> &b) {
  return {a.sine * b.cosine + a.cosine * b.sine, a.cosine * b.cosine - a.sine * b.sine};
}

template <class T> KSL_LANES plane_turn<T> inverse(const plane_turn<T> &a) { return {-a.sine, a.cosine}; }

/// Two coordinates turned in their plane, u towards v, or back.  6 flops.
template <class T> KSL_LANES void turn(const plane_turn<T> &a, T &u, T &v) {
  const T w = u;
  u = a.cosine * w - a.sine * v;
  v = a.sine * w + a.cosine * v;
}
template <class T> KSL_LANES void turn_back(const plane_turn<T> &a, T &u, T &v) {
  const T w = u;
  u = a.cosine * w + a.sine * v;
  v = a.cosine * v - a.sine * w;
}

/// The elements of a symmetric matrix in such a plane.  14 flops.
template <class T> KSL_LANES void turn_symmetric(const plane_turn<T> &a, T &uu, T &vv, T &uv) {
  const T cs = a.cosine * a.sine, ss = a.sine * a.sine, d = vv - uu, w = uv;
  const T moved = ss * d - (cs + cs) * w;
  uu = uu + moved;
  vv = vv - moved;
  uv = w - (cs * d + (ss + ss) * w);
}

/// Rx v, Rz v, and their inverses; Rx I, Rz I of inertias.
template <class T> KSL_LANES void turn_x(const plane_turn<T> &a, vec3<T> &v) { turn(a, v.y, v.z); }
template <class T> KSL_LANES void turn_z(const plane_turn<T> &a, vec3<T> &v) { turn(a, v.x, v.y); }
template <class T> KSL_LANES void turn_back_x(const plane_turn<T> &a, vec3<T> &v) { turn_back(a, v.y, v.z); }
template <class T> KSL_LANES void turn_back_z(const plane_turn<T> &a, vec3<T> &v) { turn_back(a, v.x, v.y); }

template <class T> KSL_LANES void turn_x(const plane_turn<T> &a, spatial_inertia<T> &I) {
  turn_x(a, I.h);
  turn_symmetric(a, I.Iyy, I.Izz, I.Iyz);
  turn(a, I.Ixy, I.Izx);
}
template <class T> KSL_LANES void turn_z(const plane_turn<T> &a, spatial_inertia<T> &I) {
  turn_z(a, I.h);
  turn_symmetric(a, I.Ixx, I.Iyy, I.Ixy);
  turn(a, I.Izx, I.Iyz);
}

} // namespace KSL_ISA
} // namespace ksl
