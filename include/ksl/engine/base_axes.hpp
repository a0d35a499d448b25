// KSL: bodies about their own origins, but in common axes: those of the base.
//
// A step between bodies is then a shift, and turning an inertia waits for nothing but its own axes, so that bodies can lie
// in lanes.  The base is the ground, or the body that floats on it; its axes rather than the world's, so that a floating
// base's unit twists are unit vectors.  Origins stay the bodies' own, so that no digit is lost far from the base.
#pragma once

#include "ksl/engine/joints.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// The axes of body i on a joint of kind K (rotation), and the translation from the parent's origin, both in the axes of the
/// base.  R: the parent's axes, and the body's afterwards.
template <joint_kind K, class T>
KSL_LANES vec3<T> place(const body<scalar_of<T>> &b, const pose_workspace<T> &pose, const per_body<mat3x3, T> &rotation, int i,
                        const T *q, mat3x3<T> &R) {
  const auto D = joint<K>::computed_pose(b, pose, q);
  vec3<T> offset = {T(0), T(0), T(0)};
  if (!joint<K>::is_free || !b.is_base) { // the axes of what floats on the ground are those of the base
    algebra<T>::product_drv(&R, &D.t, &offset);
    D.rotate_axes(R);
  }
  rotation.set(i, R);
  return offset;
}

/// tau = Sᵀ f of the joint of body i, for a wrench f about its origin in the axes of the base.
template <joint_kind K, class T>
KSL_LANES void effort_in_base(const body<scalar_of<T>> &b, const per_body<mat3x3, T> &rotation, int i, const coscrew<T> &f, T *tau) {
  if (b.is_base)
    joint<K>::effort(b, f, tau);
  else
    for_each_coordinate<joint<K>::nv>([&](auto k) KSL_INLINED {
      tau[k] = joint<K>::template column<k>(b, rotation, i).effort(f);
    });
}

/// Axes of all bodies in those of the base, then, as for_bodies does it, one<K>(i, offset from the parent's origin) and
/// lanes(k).
template <class T, class One, class Lanes>
KSL_LANES void express_in_base(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                               const per_body<mat3x3, T> &rotation, const T *q, One one, Lanes lanes) {
  const T o = T(0), l = T(1);
  mat3x3<T> last = {l, o, o, o, l, o, o, o, l}; // of body i − 1, mostly the parent: what was just stored need not be loaded
  sines_and_cosines(model, pose, q);
  rotation.set(0, last);
  const auto step = [&](int i) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    if (only_turns(b.kind)) {
      if (b.parent != i - 1)
        last = rotation[b.parent];
      one.template operator()<turning>(i, place<turning>(b, pose, rotation, i, q, last));
    } else { // through memory, so that the fast path has its registers
      by_slower_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
        mat3x3<T> R = rotation[b.parent];
        one.template operator()<K>(i, place<K>(b, pose, rotation, i, q, R));
      });
      last = rotation[i];
    }
  };
  for_bodies<T>(model.bodies, step, lanes);
}

} // namespace KSL_ISA
} // namespace ksl
