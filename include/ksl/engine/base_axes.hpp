// KSL: bodies about their own origins, but in common axes: those of the base.
//
// A step between bodies is then a shift, and turning an inertia waits for nothing but its own axes, so that bodies can lie
// in lanes.  The base is the ground, or the body that floats on it; its axes rather than the world's, so that a floating
// base's unit twists are unit vectors.  Origins stay the bodies' own, so that no digit is lost far from the base.
#pragma once

#include "ksl/engine/body_lanes.hpp"
#include "ksl/engine/joint_motion.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Is this body a base: the ground, or what floats on it?
template <class S> KSL_LANES bool is_base(const body<S> &b) {
  return b.parent < 0 || (b.parent == 0 && b.kind == joint_kind::floating);
}

/// By which angle a joint turns its body.
template <class T> KSL_LANES T turn_of(const body<scalar_of<T>> &b, const T *q) {
  return turns(b.kind) ? q[b.q_index] : T(0);
}

/// Bodies' axes in the axes of their parents, from the joints' turns.
template <class P, class T>
KSL_LANES mat3x3<P> turned_axes(const bodies_at<P, T> &k, const model_view<scalar_of<T>> &model, P angle) {
  P dc[2];
  sine_cosine(angle, dc[0], dc[1]);
  mat3x3<P> R = k.placement(model);
  algebra<P>::product_drdrz(&R, dc, &R);
  return R;
}

/// What `place` does, for a joint that floats: of a base, or within a tree.
template <class T>
void place_floating(const model_view<scalar_of<T>> &model, const data_view<T> &data, int i, const T *q) {
  using A = algebra<T>;
  const T zero = T(0), one = T(1);
  const body<scalar_of<T>> &b = model.body[i];
  SE3<T> D = {{one, zero, zero, zero, one, zero, zero, zero, one}, {zero, zero, zero}};
  if (!is_base(b)) {
    const mat3x3<T> parent = body_at<T>(b.parent).template get<mat3x3>(data.rotation);
    D = pose_in_parent<joint_kind::floating>(b, data, q);
    A::product_drdr(&parent, &D.R, &D.R);
    A::product_drv(&parent, &D.t, &D.t);
  }
  body_at<T>(i).put(D.R, data.rotation);
  data.offset[i] = D.t;
}

/// Axes (data.rotation) of body i in those of the base, and the way from its parent's origin (data.offset); R: its axes in
/// its parent's.  `last` comes as the axes of body i − 1, mostly the parent, and leaves as those of i: what was just stored
/// need not be loaded.
template <class T>
KSL_LANES void place(const model_view<scalar_of<T>> &model, const data_view<T> &data, int i, const mat3x3<T> &R, const T *q,
                     mat3x3<T> &last) {
  using A = algebra<T>;
  const body<scalar_of<T>> &b = model.body[i];
  if (b.kind == joint_kind::floating) {
    place_floating(model, data, i, q);
    last = body_at<T>(i).template get<mat3x3>(data.rotation);
    return;
  }
  vec3<T> t = spread<T>(b.placement.t);
  if (b.kind == joint_kind::prismatic) {
    const vec3<T> z = {R.m02, R.m12, R.m22};
    A::axpy_vv(q[b.q_index], &z, &t);
  }
  if (is_base(model.body[b.parent])) {
    last = R;
  } else {
    if (b.parent != i - 1)
      last = body_at<T>(b.parent).template get<mat3x3>(data.rotation);
    A::product_drv(&last, &t, &t);
    A::product_drdr(&last, &R, &last);
  }
  body_at<T>(i).put(last, data.rotation);
  data.offset[i] = t;
}

/// Axes and offsets of all bodies, then, as for_bodies does it, one(i) and lanes(k).
template <class T, class One, class Lanes>
KSL_LANES void express_in_base(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, One one, Lanes lanes) {
  if constexpr (plain<T>) {
    for (int i = 0; i < model.bodies; i += native_lanes<T>) {
      const bodies_at<native_pack<T>, T> k{i};
      native_pack<T> angle(T(0));
      for (int lane = 0; lane < native_lanes<T>; ++lane)
        if (i + lane < model.bodies)
          angle.set(lane, turn_of(model.body[i + lane], q));
      k.put(turned_axes(k, model, angle), data.rotation);
    }
  }
  const T o = T(0), l = T(1);
  mat3x3<T> last = {l, o, o, o, l, o, o, o, l};
  body_at<T>(0).put(last, data.rotation);
  data.offset[0] = {o, o, o};
  for_bodies<T>(model.bodies, [&](int i) {
    if constexpr (plain<T>)
      place(model, data, i, body_at<T>(i).template get<mat3x3>(data.rotation), q, last);
    else
      place(model, data, i, turned_axes(body_at<T>(i), model, turn_of(model.body[i], q)), q, last);
    one(i);
  }, lanes);
}

/// The axis of a body's joint: z of its axes.
template <class T> KSL_LANES vec3<T> axis_of(const data_view<T> &data, int i) {
  const T *z = numbers_of<9>(data.rotation, i) + 6 * group<T>;
  return {z[0], z[group<T>], z[2 * group<T>]};
}

/// The inertia of a body in other axes, about the same origin.  90 flops.
template <class T> KSL_LANES spatial_inertia<T> turned(const spatial_inertia<T> &I, const mat3x3<T> &R) {
  using A = algebra<T>;
  mat3x3<T> J;
  vec3<T> h;
  A::spatial_inertia_getMatrix(&I, &J);
  A::product_drSdrinv(&R, &J, &J);
  A::product_drv(&R, &I.h, &h);
  return {I.m, h, J.m00, J.m11, J.m22, J.m10, J.m21, J.m20};
}

} // namespace KSL_ISA
} // namespace ksl
