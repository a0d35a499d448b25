// KSL: the common part of joints with several coordinates.  Each coordinate is a unit twist in the body's own axes, in which the
// motion subspace is constant.
#pragma once

#include "ksl/engine/model/joints/one_axis.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// The words of these coordinates in tables: of positions, where each is the integral of its velocity; and of velocities.
inline constexpr position_number position_along[] = {{"x", "m"},       {"y", "m"},       {"z", "m"},
                                                     {"angle", "rad"}, {"angle", "rad"}, {"angle", "rad"}};
inline constexpr velocity_number velocity_along[] = {{"vx", "ax", "fx", "m"},   {"vy", "ay", "fy", "m"},
                                                     {"vz", "az", "fz", "m"},   {"wx", "bx", "tx", "rad"},
                                                     {"wy", "by", "ty", "rad"}, {"wz", "bz", "tz", "rad"}};

/// Adds the twist (v, ω_J) of a joint and its rate (v̇, ω̇_J) to a motion ω, ω̇, a, all in the same axes:
/// a += v̇ + ω_J × v + 2 ω × v,   ω̇ += ω̇_J + ω × ω_J,   ω += ω_J.   slides, turns: does the joint move along axes, about axes?
template <class T>
KSL_LANES void add_relative_motion(const screw<T> &twist, const screw<T> &rate, bool slides, bool turns,
                                   body_motion<T> &m) {
  using A = algebra<T>;
  vec3<T> turning, coupling;
  if (slides) {
    if (turns) {
      A::cross_vv(&twist.ang, &twist.lin, &turning); // v̇ + ω × v relative to the parent
      A::xpy_vv(&turning, &m.acceleration);
    }
    A::cross_vv(&m.angular_velocity, &twist.lin, &coupling);
    A::axpy_vv(T(2), &coupling, &m.acceleration);
    A::xpy_vv(&rate.lin, &m.acceleration);
  }
  if (turns) {
    A::cross_vv(&m.angular_velocity, &twist.ang, &coupling);
    A::xpy_vv(&coupling, &m.angular_acceleration);
    A::xpy_vv(&rate.ang, &m.angular_acceleration);
    A::xpy_vv(&twist.ang, &m.angular_velocity);
  }
}

/// Are the motions along and about these axes a group, so that their unit twists are constant in the body's axes?  With two of them it has
/// their bracket: [e_a, e_b] of two rotations is the third, of a rotation about a and a translation along b the translation along the third axis.
template <int... coordinates> constexpr bool is_group() {
  bool has[6] = {}, closed = true;
  ((has[coordinates] = true), ...);
  for (int a = 3; a < 6; ++a)
    for (int b = 0; b < 6; ++b)
      if (has[a] && has[b] && b % 3 != a % 3)
        closed = closed && has[b / 3 * 3 + (3 - a % 3 - b % 3)];
  return closed;
}

/// Coordinates of the velocity: 0, 1, 2 translate along the body's axes x, y, z, and 3, 4, 5 rotate about them.
template <int... coordinates> struct several_axes_joint {
  static_assert(is_group<coordinates...>(), "unit twists of this joint are not constant in the child's axes");
  static constexpr int nv = sizeof...(coordinates);
  static constexpr int coordinate[nv] = {coordinates...};
  static constexpr const char *other_name = nullptr;
  static constexpr bool has_axis = false, has_axis2 = false, has_pitch = false, has_limits = false, is_free = nv == 6,
                        in_urdf = false;
  static constexpr position_number positions[] = {position_along[coordinates]...};
  static constexpr velocity_number velocities[] = {velocity_along[coordinates]...};
  static constexpr bool canonical_x = false;
  static constexpr int usual_axis = 0;
  static constexpr bool slides = ((coordinates < 3) || ...), turns = ((coordinates >= 3) || ...);
  static constexpr bool shifts_origin = slides;
  /// Do the motions of its coordinates commute?  They do if all are along axes, or along and about the same axis.
  static constexpr bool commutes = !turns || ((coordinates % 3 == coordinate[0] % 3) && ...);
  static constexpr bool velocity_is_rate = commutes;

  /// S q̇
  template <class T> static KSL_LANES screw<T> twist(const body<scalar_of<T>> &, const T *v) {
    return to_vectors<screw>(v);
  }

  /// effort: tau = Sᵀ f.  drive: the wrench h* tau.
  template <class T> static KSL_LANES void effort(const body<scalar_of<T>> &, const coscrew<T> &f, T *tau) {
    for_each_coordinate<nv>([&](auto k) KSL_INLINED {
      constexpr int c = coordinate[k];
      const vec3<T> &u = c < 3 ? f.lin : f.ang;
      tau[k] = c % 3 == 0 ? u.x : c % 3 == 1 ? u.y : u.z;
    });
  }
  template <class T> static KSL_LANES coscrew<T> drive(const body<scalar_of<T>> &, const T *tau) {
    return to_vectors<coscrew>(tau);
  }

  /// Adds the joint's motion, given by its velocities and accelerations, to m.  On entry m is the motion of the joint's frame as
  /// it is carried by the parent.
  template <class T>
  static KSL_LANES void add_motion(const body<scalar_of<T>> &, const T *v, const T *dv, body_motion<T> &m) {
    add_relative_motion(to_vectors<screw>(v), to_vectors<screw>(dv), slides, turns, m);
  }

  /// Adds the motion without joint acceleration, in the axes of the base, to which `rotation` leads.
  template <class T>
  static KSL_LANES void add_steady_motion(const body<scalar_of<T>> &, const per_body<mat3x3, T> &rotation, int i,
                                          const T *v, body_motion<T> &m) {
    const mat3x3<T> R = rotation[i];
    const T zero = T(0);
    screw<T> twist = to_vectors<screw>(v);
    if constexpr (slides)
      algebra<T>::product_drv(&R, &twist.lin, &twist.lin);
    if constexpr (turns)
      algebra<T>::product_drv(&R, &twist.ang, &twist.ang);
    add_relative_motion(twist, {{zero, zero, zero}, {zero, zero, zero}}, slides, turns, m);
  }

  /// column: column k of S in the axes of the base, or in those to which R leads.  momentum: column k of I S in the body's own axes.
  template <class Index, class T>
  static KSL_LANES auto column(Index k, const body<scalar_of<T>> &, const per_body<mat3x3, T> &rotation, int i) {
    constexpr int c = coordinate[k];
    return joint_column<(c >= 3), (c < 3), T>{axis_of(rotation, i, c % 3), T(0)};
  }
  template <class Index, class T> static KSL_LANES auto column(Index k, const body<scalar_of<T>> &,
                                                               const mat3x3<T> &R) {
    constexpr int c = coordinate[k];
    return joint_column<(c >= 3), (c < 3), T>{axis_of<c % 3>(R), T(0)};
  }
  template <class Index, class T>
  static KSL_LANES coscrew<T> momentum(Index k, const body<scalar_of<T>> &, const spatial_inertia<T> &I) {
    return unit_momentum(coordinate[k], I);
  }

  /// Derivatives of integrate and difference; one_axis.hpp describes their arguments.  With D = exp dv,
  /// q exp(δ) exp(dv) = q D exp(Ad(D)⁻¹ δ), and exp(dv + δ) = D exp(J δ), J the right Jacobian (Solà et al., A micro Lie theory
  /// for state estimation in robotics (2018), section III-B).  The motions of such a joint are a subgroup of SE(3),
  /// so that its matrices are blocks of those of SE(3), and identities where the motions commute.
  template <class T> static void integrate_jacobians(const T *dv, T *by_q, T *by_dv, int stride) {
    const screw<T> s = to_vectors<screw>(dv);
    if constexpr (!commutes) {
      SE3<T> D;
      mat3x3<T> J, Q;
      algebra_with_own_sines<T>::SE3_exp(&s, &D);
      algebra_with_own_sines<T>::SE3_rightJacobian(&s, &J, &Q);
      put_columns<T>(by_q, stride, [&](screw<T> &x) { algebra<T>::product_Adinvs(&D, &x, &x); });
      put_columns<T>(by_dv, stride, [&](screw<T> &x) { multiply(J, Q, x); });
    } else {
      put_columns<T>(by_q, stride, [](screw<T> &) {});
      put_columns<T>(by_dv, stride, [](screw<T> &) {});
    }
  }
  /// exp(−δ) exp(dv) = exp(dv − L⁻¹ δ), L the left Jacobian.
  template <class T> static void difference_jacobians(const T *dv, T *by_q0, T *by_q1, int stride) {
    const screw<T> s = to_vectors<screw>(dv);
    if constexpr (!commutes) {
      mat3x3<T> J, Q;
      algebra_with_own_sines<T>::SE3_leftJacobianInverse(&s, &J, &Q);
      put_columns<T>(by_q0, stride, [&](screw<T> &x) { multiply(J, Q, x), algebra<T>::screw_invert(&x); });
      algebra_with_own_sines<T>::SE3_rightJacobianInverse(&s, &J, &Q);
      put_columns<T>(by_q1, stride, [&](screw<T> &x) { multiply(J, Q, x); });
    } else {
      put_columns<T>(by_q0, stride, [](screw<T> &x) { algebra<T>::screw_invert(&x); });
      put_columns<T>(by_q1, stride, [](screw<T> &) {});
    }
  }

private:
  /// x = [J Q; 0 J] x
  template <class T> static void multiply(const mat3x3<T> &J, const mat3x3<T> &Q, screw<T> &x) {
    using A = algebra<T>;
    vec3<T> coupled;
    A::product_drv(&Q, &x.ang, &coupled);
    A::product_drv(&J, &x.lin, &x.lin);
    A::product_drv(&J, &x.ang, &x.ang);
    A::xpy_vv(&coupled, &x.lin);
  }

  /// Writes the columns map(e_k), for the unit twists e_k of the joint's coordinates.
  template <class T, class Map> static void put_columns(T *block, int stride, Map map) {
    const T zero = T(0);
    for (int k = 0; k < nv; ++k) {
      T unit[nv];
      for (int i = 0; i < nv; ++i)
        unit[i] = i == k ? T(1) : zero;
      screw<T> x = to_vectors<screw>(unit);
      map(x);
      const T six[6] = {x.lin.x, x.lin.y, x.lin.z, x.ang.x, x.ang.y, x.ang.z};
      for (int i = 0; i < nv; ++i)
        block[i * stride + k] = six[coordinate[i]];
    }
  }

  /// The numbers of all coordinates as two three-vectors, zero elsewhere.
  template <template <class> class V, class T> static KSL_LANES V<T> to_vectors(const T *numbers) {
    const T zero = T(0);
    T six[6] = {zero, zero, zero, zero, zero, zero};
    for_each_coordinate<nv>([&](auto k) KSL_INLINED { six[coordinate[k]] = numbers[k]; });
    return {{six[0], six[1], six[2]}, {six[3], six[4], six[5]}};
  }
};

} // namespace KSL_ISA
} // namespace ksl
