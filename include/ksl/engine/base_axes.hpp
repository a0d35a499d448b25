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

/// Does anything hang on this body?
template <class S> KSL_LANES bool has_children(const body<S> &b) { return b.v_end > b.v_index + row_of(b.kind).nv; }

/// The way from the parent's origin to that of body i, in the axes of the base, and its axes (data.rotation); R: the
/// parent's, and the body's afterwards.
template <joint_kind K, class T>
KSL_LANES vec3<T> place_by(const model_view<scalar_of<T>> &model, const data_view<T> &data, int i, const T *q, mat3x3<T> &R) {
  const body<scalar_of<T>> &b = model.body[i];
  const auto D = pose_in_parent<K, T>::at(b, data, i, q);
  vec3<T> offset = {T(0), T(0), T(0)};
  if (K != joint_kind::floating || !is_base(b)) { // the axes of what floats on the ground are those of the base
    algebra<T>::product_drv(&R, &D.t, &offset);
    D.turn_axes(R);
  }
  body_at<T>(i).put(R, data.rotation);
  return offset;
}

/// The same for every kind of joint.  `last` comes as the axes of body i − 1, mostly the parent, and leaves as those of i:
/// what was just stored need not be loaded.
template <class T>
KSL_LANES vec3<T> place(const model_view<scalar_of<T>> &model, const data_view<T> &data, int i, const T *q, mat3x3<T> &last) {
  const body<scalar_of<T>> &b = model.body[i];
  if (turns(b.kind)) {
    if (b.parent != i - 1)
      last = body_at<T>(b.parent).template get<mat3x3>(data.rotation);
    return place_by<joint_kind::revolute>(model, data, i, q, last);
  }
  by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED { // through memory, so that the way above has its registers
    mat3x3<T> R = body_at<T>(b.parent).template get<mat3x3>(data.rotation);
    data.offset[i] = place_by<K>(model, data, i, q, R);
  });
  last = body_at<T>(i).template get<mat3x3>(data.rotation);
  return data.offset[i];
}

/// Axes of all bodies in those of the base, then, as for_bodies does it, one(i, offset from the parent's origin) and
/// lanes(k).
template <class T, class One, class Lanes>
KSL_LANES void express_in_base(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, One one,
                               Lanes lanes) {
  const T o = T(0), l = T(1);
  mat3x3<T> last = {l, o, o, o, l, o, o, o, l};
  sines_and_cosines(model, data, q);
  body_at<T>(0).put(last, data.rotation);
  for_bodies<T>(model.bodies, [&](int i) KSL_INLINED { one(i, place(model, data, i, q, last)); }, lanes);
}

/// The axis of a body's joint: z of its axes.
template <class T> KSL_LANES vec3<T> axis_of(const data_view<T> &data, int i) {
  const T *z = numbers_of<9>(data.rotation, i) + 6 * group<T>;
  return {z[0], z[group<T>], z[2 * group<T>]};
}

} // namespace KSL_ISA
} // namespace ksl
