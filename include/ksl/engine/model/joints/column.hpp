// KSL: one column of a joint's motion subspace, S = (h z, z), in any axes.
#pragma once

#include "ksl/engine/lanes/workspace.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Numbers of coordinates: 0, 1, 2 translate along the axes x, y, z of the body, 3, 4, 5 rotate about them, and this one rotates
/// about z and advances along it.
inline constexpr int helical_coordinate = 6;

/// The twist S for unit rate of one coordinate, about the body's origin:
///
///     slides: (z, 0), a translation along z;   turns: (0, z), a rotation about z;   both: (h z, z), with the pitch h.    (1)
///
/// The functions leave out products with the zeros of S.
template <bool turns, bool slides, class T> struct joint_column {
  static_assert(turns || slides);
  vec3<T> z;
  T pitch; ///< m/rad; used if it turns and slides

  /// Sᵀ f
  KSL_LANES T effort(const coscrew<T> &f) const {
    using A = algebra<T>;
    if constexpr (turns && slides)
      return pitch * A::dot_vv(&z, &f.lin) + A::dot_vv(&z, &f.ang);
    else
      return A::dot_vv(&z, slides ? &f.lin : &f.ang);
  }

  /// S about another point.  r leads from that point to the body's origin: the linear half is h z + r × z.
  KSL_LANES screw<T> twist(const vec3<T> &r) const {
    const T o = T(0);
    screw<T> s = {{o, o, o}, {o, o, o}};
    if constexpr (turns) {
      s.ang = z;
      algebra<T>::cross_vv(&r, &z, &s.lin);
      if constexpr (slides)
        algebra<T>::axpy_vv(pitch, &z, &s.lin);
    } else {
      s.lin = z;
    }
    return s;
  }

  /// a += S x
  KSL_LANES void add(const T &x, screw<T> &a) const {
    if constexpr (turns)
      algebra<T>::axpy_vv(x, &z, &a.ang);
    if constexpr (slides)
      algebra<T>::axpy_vv(turns ? pitch * x : x, &z, &a.lin);
  }

  /// S about a point; `origin` is r.
  KSL_LANES screw<T> about(const vec3<T> &origin) const {
    using A = algebra<T>;
    const T zero = T(0);
    if constexpr (!turns)
      return {z, {zero, zero, zero}};
    screw<T> s = {z, z};
    A::cross_vv(&origin, &z, &s.lin);
    if constexpr (slides)
      A::axpy_vv(pitch, &z, &s.lin);
    return s;
  }

  /// U = A S
  KSL_LANES coscrew<T> momentum(const articulated_inertia<T> &A) const {
    using algebra = ksl::algebra<T>;
    mat3x3<T> block;
    coscrew<T> U;
    if constexpr (turns && slides) {
      screw<T> s;
      algebra::product_av(pitch, &z, &s.lin);
      s.ang = z;
      algebra::product_As(&A, &s, &U);
    } else if constexpr (slides) {
      algebra::articulated_inertia_getM(&A, &block);
      algebra::product_drv(&block, &z, &U.lin);
      algebra::product_drinvv(&A.H, &z, &U.ang);
    } else {
      algebra::articulated_inertia_getI(&A, &block);
      algebra::product_drv(&A.H, &z, &U.lin);
      algebra::product_drv(&block, &z, &U.ang);
    }
    return U;
  }
};

/// Axis 0, 1 or 2 (x, y, z) of body i, from the rotations of all bodies.
template <class T> KSL_LANES vec3<T> axis_of(const per_body<mat3x3, T> &rotation, int i, int axis = 2) {
  return {rotation.number(i, 3 * axis), rotation.number(i, 3 * axis + 1), rotation.number(i, 3 * axis + 2)};
}

/// Axis 0, 1 or 2 (x, y, z) of a frame.
template <int axis, class T> KSL_LANES vec3<T> axis_of(const mat3x3<T> &R) {
  if constexpr (axis == 0)
    return {R.m00, R.m10, R.m20};
  else if constexpr (axis == 1)
    return {R.m01, R.m11, R.m21};
  else
    return {R.m02, R.m12, R.m22};
}

/// I S for coordinate c < 6 of a body in its own axes: 0 … 2 translate along x, y, z, and 3 … 5 rotate about them.  It is column c of
/// I = [m 1, −h̃; h̃, I].
template <class T> KSL_LANES coscrew<T> unit_momentum(int c, const spatial_inertia<T> &I) {
  const T o = T(0);
  const vec3<T> &h = I.h;
  switch (c) {
  case 0: return {{I.m, o, o}, {o, h.z, -h.y}};
  case 1: return {{o, I.m, o}, {-h.z, o, h.x}};
  case 2: return {{o, o, I.m}, {h.y, -h.x, o}};
  case 3: return {{o, -h.z, h.y}, {I.Ixx, I.Ixy, I.Izx}};
  case 4: return {{h.z, o, -h.x}, {I.Ixy, I.Iyy, I.Iyz}};
  default: return {{-h.y, h.x, o}, {I.Izx, I.Iyz, I.Izz}};
  }
}

/// Calls step for the coordinates 0 … n − 1, passed as compile-time constants; unrolled.
template <int k> struct coordinate_number {
  constexpr operator int() const { return k; }
};
template <int n, class Step> KSL_LANES void for_each_coordinate(Step step) {
  if constexpr (n > 0) {
    for_each_coordinate<n - 1>(step);
    step(coordinate_number<n - 1>{});
  }
}
template <int n, class Step> KSL_LANES void for_each_coordinate_backwards(Step step) {
  if constexpr (n > 0) {
    step(coordinate_number<n - 1>{});
    for_each_coordinate_backwards<n - 1>(step);
  }
}

} // namespace KSL_ISA
} // namespace ksl
