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

/// Turns of all joints into data.rotation, as poses in the parents' axes; translations don't turn.
template <class T> void turn_joints(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q) {
  for (int i = 0; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    const bool turns = b.kind == joint_kind::revolute || b.kind == joint_kind::continuous;
    data.angle[i] = turns ? q[b.q_index] : T(0);
  }
  for_bodies<T>(model.bodies, [&](auto k) {
    using P = typename decltype(k)::scalar;
    P dc[2];
    sine_cosine(k.get_number(data.angle), dc[0], dc[1]);
    mat3x3<P> R = k.placement(model);
    algebra<P>::product_drdrz(&R, dc, &R);
    k.put(R, data.rotation);
  });
}

/// The pose of a body in its parent's frame; after turn_joints.
template <class T> KSL_LANES SE3<T> turned_pose(const body<scalar_of<T>> &b, const data_view<T> &data, int i, const T *q) {
  using A = algebra<T>;
  SE3<T> D = {body_at<T>(i).template get<mat3x3>(data.rotation), spread<T>(b.placement.t)};
  if (b.kind == joint_kind::prismatic)
    A::product_ddtz(&D, q[b.q_index], &D);
  else if (b.kind == joint_kind::floating)
    D = pose_in_parent(b, data, q);
  return D;
}

/// Axes of all bodies (data.rotation) and the ways from parent to child (data.offset), in the axes of the base.
template <class T> void express_in_base(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q) {
  using A = algebra<T>;
  const T zero = T(0), one = T(1);
  const mat3x3<T> identity = {one, zero, zero, zero, one, zero, zero, zero, one};
  turn_joints(model, data, q);
  body_at<T>(0).put(identity, data.rotation);
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    SE3<T> D = {identity, {zero, zero, zero}};
    if (!is_base(b)) {
      D = turned_pose(b, data, i, q);
      if (!is_base(model.body[b.parent])) {
        const mat3x3<T> R = body_at<T>(b.parent).template get<mat3x3>(data.rotation);
        A::product_drdr(&R, &D.R, &D.R);
        A::product_drv(&R, &D.t, &D.t);
      }
    }
    body_at<T>(i).put(D.R, data.rotation);
    data.offset[i] = D.t;
  }
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
