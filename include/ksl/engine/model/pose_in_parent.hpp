// KSL: poses of bodies in their parents.  If the joint has an axis, the orientation is composed of rotations about coordinate
// axes.  Transforming a vector then costs 12 flops, and only sines and cosines are stored.  Denavit and Hartenberg (1955);
// docs/decisions/0007-turns.md.
#pragma once

#include "ksl/engine/lanes/sine_cosine.hpp"
#include "ksl/engine/lanes/workspace.hpp"
#include "ksl/engine/model/body_constants.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// The parts of the bodies' poses that depend on q: computed in the forward pass, reloaded in the backward pass.
template <class T> struct pose_workspace {
  T *sine, *cosine; ///< of theta = theta0 + joint angle, one for each number in q; used where q holds angles
  T *moved; ///< from body.pose_index on: the translation of a joint that slides, the pose of one without an axis

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    const int angles = padded(model.nq) + padded(1); // a register may be loaded at any index
    sine = memory.take<T>(angles);
    cosine = memory.take<T>(angles);
    moved = memory.take<T>(model.pose_numbers);
  }

  /// The rotation about z of a joint that has an angle.
  KSL_LANES plane_rotation<T> rotation(const body<scalar_of<T>> &b) const {
    return {sine[b.angle_index], cosine[b.angle_index]};
  }

  /// The stored part of a body's pose, as a V<T>.
  template <template <class> class V> KSL_LANES V<T> &kept(const body<scalar_of<T>> &b) const {
    return *reinterpret_cast<V<T> *>(moved + b.pose_index);
  }
};

/// Sines and cosines of all joint rotations about z, each by compute(angle, sine, cosine).
template <class T, class Compute>
KSL_LANES void rotations_about_z(const model_view<scalar_of<T>> &model, const pose_workspace<T> &w, const T *q,
                                 Compute compute) {
  for (int i = 1; i < model.bodies; ++i) {
    const int k = model.body[i].angle_index;
    if (k < 0)
      continue;
    plane_rotation<T> a;
    compute(q[k], a.sine, a.cosine);
    a = product(a, spread<T>(model.body[i].theta0));
    w.sine[k] = a.sine, w.cosine[k] = a.cosine;
  }
}

/// Rotations with states in lanes, two numbers of q at a time.  Those that are not angles are included, since that costs less than leaving
/// them out.
template <class S, class P, class Compute> KSL_LANES void
rotations_in_pairs(const model_view<S> &model, const pose_workspace<P> &w, const P *q, Compute compute) {
  int k = model.first_angle;
  for (; k + 1 < model.angles_end; k += 2) {
    plane_rotation<twin_packs<P>> a;
    compute(twin_packs<P>(q[k], q[k + 1]), a.sine, a.cosine);
    const twin_packs<P> sine(model.theta0_sine[k], model.theta0_sine[k + 1]),
        cosine(model.theta0_cosine[k], model.theta0_cosine[k + 1]);
    a = product(a, {sine, cosine});
    w.sine[k] = a.sine.a, w.sine[k + 1] = a.sine.b;
    w.cosine[k] = a.cosine.a, w.cosine[k + 1] = a.cosine.b;
  }
  if (k < model.angles_end) {
    plane_rotation<P> a;
    compute(q[k], a.sine, a.cosine);
    a = product(a, {P(model.theta0_sine[k]), P(model.theta0_cosine[k])});
    w.sine[k] = a.sine, w.cosine[k] = a.cosine;
  }
}

/// Rotations for plain doubles, with numbers of q in lanes, and two registers at a time.
template <class Compute> KSL_LANES void
rotations_in_pairs(const model_view<double> &model, const pose_workspace<double> &w, const double *q, Compute compute) {
  using P = native_pack<double>;
  constexpr int lanes = native_lanes<double>;
  const auto padded = [](const double *x) KSL_INLINED {
    P p;
    body_lanes::read(x, p);
    return p;
  };
  int i = model.first_angle;
  for (; i + lanes < model.angles_end; i += 2 * lanes) {
    const int j = i + lanes;
    plane_rotation<twin_packs<P>> a;
    compute(twin_packs<P>(load_first(q + i, model.nq - i), load_first(q + j, model.nq - j)), a.sine, a.cosine);
    const twin_packs<P> sine(padded(model.theta0_sine + i), padded(model.theta0_sine + j)),
        cosine(padded(model.theta0_cosine + i), padded(model.theta0_cosine + j));
    a = product(a, {sine, cosine});
    body_lanes::write(a.sine.a, w.sine + i), body_lanes::write(a.sine.b, w.sine + j);
    body_lanes::write(a.cosine.a, w.cosine + i), body_lanes::write(a.cosine.b, w.cosine + j);
  }
  if (i < model.angles_end) {
    plane_rotation<P> a;
    compute(load_first(q + i, model.nq - i), a.sine, a.cosine);
    a = product(a, {padded(model.theta0_sine + i), padded(model.theta0_cosine + i)});
    body_lanes::write(a.sine, w.sine + i), body_lanes::write(a.cosine, w.cosine + i);
  }
}

/// Sines and cosines of all joint rotations about z.  Nearly all angles are within the fast range, so all are computed without
/// a branch for each.  If one is outside, all are computed again.
template <class T> void sines_and_cosines(const model_view<scalar_of<T>> &model, const pose_workspace<T> &w,
                                          const T *q) {
  const auto any = []<class P>(const P &x, P &sine, P &cosine) { sine_cosine(x, sine, cosine); };
  if constexpr (is_number<T> || is_pack<T>) {
    bool in_range = true;
    const auto fast = [&]<class P>(const P &x, P &sine, P &cosine) KSL_INLINED {
      in_range &= magnitudes_at_most(x, trigonometry<scalar_of<P>>::fast_range);
      sine_cosine_in_fast_range(x, sine, cosine);
    };
    if constexpr (__is_same(T, float))
      rotations_about_z(model, w, q, fast);
    else
      rotations_in_pairs(model, w, q, fast);
    if (in_range) [[likely]]
      return;
  }
  rotations_about_z(model, w, q, any);
}

/// Expresses an inertia in other axes, about the same origin.  90 flops.
template <class T> KSL_LANES spatial_inertia<T> rotated(const spatial_inertia<T> &I, const mat3x3<T> &R) {
  using A = algebra<T>;
  mat3x3<T> J;
  vec3<T> h;
  A::spatial_inertia_getMatrix(&I, &J);
  A::product_drSdrinv(&R, &J, &J);
  A::product_drv(&R, &I.h, &h);
  return {I.m, h, J.m00, J.m11, J.m22, J.m10, J.m21, J.m20};
}

template <class T> KSL_LANES void rotate(const mat3x3<T> &R, vec3<T> &v) { algebra<T>::product_drv(&R, &v, &v); }
template <class T> KSL_LANES void rotate(const mat3x3<T> &R, spatial_inertia<T> &I) { I = rotated(I, R); }

/// The pose of a body in its parent if the joint has an axis: Rz(offset) Rx(alpha) Rz(theta), and a translation in the parent's
/// axes.
template <class T> struct axis_pose {
  using S = scalar_of<T>;
  const body<S> &b;
  plane_rotation<T> theta; ///< joint rotation about z
  vec3<T> t;

  /// From the parent's axes to the body's, and back.
  template <class... V> KSL_LANES void to_body(V &...v) const {
    const plane_rotation<T> alpha = spread<T>(b.alpha);
    if (!b.no_offset)
      (rotate_back_z(spread<T>(b.offset), v), ...);
    (rotate_back_x(alpha, v), ...);
    (rotate_back_z(theta, v), ...);
  }
  template <class... V> KSL_LANES void to_parent(V &...v) const {
    const plane_rotation<T> alpha = spread<T>(b.alpha);
    (rotate_z(theta, v), ...);
    (rotate_x(alpha, v), ...);
    if (!b.no_offset)
      (rotate_z(spread<T>(b.offset), v), ...);
  }
  KSL_LANES void to_parent(spatial_inertia<T> &I) const {
    rotate_z(theta, I);
    rotate_x(spread<T>(b.alpha), spread<T>(b.alpha_of_tensor), I);
    if (!b.no_offset)
      rotate_z(spread<T>(b.offset), I);
  }
  /// The body's axes in the parent's.  18 flops.
  KSL_LANES mat3x3<T> axes() const {
    using A = algebra<T>;
    mat3x3<T> R = spread<T>(b.placement.R);
    T angle[2] = {theta.sine, theta.cosine};
    A::product_drdrz(&R, angle, &R);
    return R;
  }
  /// Computes the body's axes from the parent's, about x and then about z.  36 flops.
  KSL_LANES void rotate_axes(mat3x3<T> &R) const {
    using A = algebra<T>;
    vec3<T> x, y, z, u, v;
    const plane_rotation<T> alpha = spread<T>(b.alpha);
    if (!b.no_offset) {
      T offset[2] = {T(b.offset.sine), T(b.offset.cosine)};
      A::product_drdrz(&R, offset, &R);
    }
    A::mat3x3_toVectors(&R, &x, &y, &z);
    combine(alpha.cosine, y, alpha.sine, z, v);
    A::product_av(alpha.cosine, &z, &z);
    A::axpy_vv(-alpha.sine, &y, &z);
    combine(theta.cosine, x, theta.sine, v, u);
    combine(theta.cosine, v, -theta.sine, x, v);
    A::mat3x3_setFromVectors(&R, &u, &v, &z);
  }
  /// Computes the parent's axes from the body's.  43 flops.
  KSL_LANES void rotate_axes_back(mat3x3<T> &R) const {
    using A = algebra<T>;
    vec3<T> x, y, z, u, v;
    const plane_rotation<T> alpha = spread<T>(b.alpha);
    A::mat3x3_toVectors(&R, &x, &y, &z);
    combine(theta.sine * alpha.cosine, x, theta.cosine * alpha.cosine, y, -alpha.sine, z, u);
    combine(theta.sine * alpha.sine, x, theta.cosine * alpha.sine, y, alpha.cosine, z, v);
    A::product_av(theta.cosine, &x, &x);
    A::axpy_vv(-theta.sine, &y, &x);
    A::mat3x3_setFromVectors(&R, &x, &u, &v);
    if (!b.no_offset) {
      T offset[2] = {T(-b.offset.sine), T(b.offset.cosine)};
      A::product_drdrz(&R, offset, &R);
    }
  }

private:
  KSL_LANES static void combine(const T &a, const vec3<T> &x, const T &b, const vec3<T> &y, vec3<T> &out) {
    out = {a * x.x + b * y.x, a * x.y + b * y.y, a * x.z + b * y.z};
  }
  KSL_LANES static void combine(const T &a, const vec3<T> &x, const T &b, const vec3<T> &y, const T &c,
                                const vec3<T> &z, vec3<T> &out) {
    out.x = a * x.x + (b * y.x + c * z.x);
    out.y = a * x.y + (b * y.y + c * z.y);
    out.z = a * x.z + (b * y.z + c * z.z);
  }
};

/// The pose of a body in its parent if the joint has no axis.
template <class T> struct free_pose {
  mat3x3<T> R;
  vec3<T> t;

  template <class... V> KSL_LANES void to_body(V &...v) const { (algebra<T>::product_drinvv(&R, &v, &v), ...); }
  template <class... V> KSL_LANES void to_parent(V &...v) const { (rotate(R, v), ...); }
  KSL_LANES mat3x3<T> axes() const { return R; }
  KSL_LANES void rotate_axes(mat3x3<T> &parent) const { algebra<T>::product_drdr(&parent, &R, &parent); }
  KSL_LANES void rotate_axes_back(mat3x3<T> &body) const { algebra<T>::product_drdrinv(&body, &R, &body); }
};

/// The pose of a body, from that of its parent, both in the same frame.
template <class T, class Pose> KSL_LANES SE3<T> composed(const SE3<T> &parent, const Pose &D) {
  SE3<T> pose = parent;
  algebra<T>::product_dv(&parent, &D.t, &pose.t);
  D.rotate_axes(pose.R);
  return pose;
}

/// The pose of a body's parent, from that of the body, both in the same frame.
template <class T, class Pose> KSL_LANES SE3<T> composed_back(const SE3<T> &body, const Pose &D) {
  using A = algebra<T>;
  SE3<T> pose = body;
  vec3<T> offset;
  D.rotate_axes_back(pose.R);
  A::product_drv(&pose.R, &D.t, &offset);
  A::subtract_vv(&body.t, &offset, &pose.t);
  return pose;
}

} // namespace KSL_ISA
} // namespace ksl
