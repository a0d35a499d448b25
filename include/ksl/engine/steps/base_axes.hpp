// KSL: quantities of all bodies in common axes, those of the base, but about each body's own origin.
//
// A step from a body to its parent is then a translation.  Rotating an inertia depends on the axes of its own body only, so
// bodies can be computed in lanes.  The base is the ground, or the body that floats on it.  Its axes are used rather than the
// world's, because the unit twists of a floating base are then unit vectors.  Each body keeps its own origin, so that no digits
// are lost far from the base.
#pragma once

#include "ksl/engine/model/joints.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Sets rotation[i], the axes of body i on a joint of kind K, and returns the translation from the parent's origin; both in the
/// axes of the base.  R holds the parent's axes on entry and the body's on return.
template <joint_kind K, class T>
KSL_LANES vec3<T> place(const body<scalar_of<T>> &b, const pose_workspace<T> &pose, const per_body<mat3x3, T> &rotation,
                        int i, const T *q, mat3x3<T> &R) {
  const auto D = joint<K>::computed_pose(b, pose, q);
  vec3<T> offset = {T(0), T(0), T(0)};
  if (b.parent == 0) {
    if (!b.is_base) // a body that floats on the ground is the base itself
      offset = D.t, R = D.axes();
  } else {
    algebra<T>::product_drv(&R, &D.t, &offset);
    D.rotate_axes(R);
  }
  rotation.set(i, R);
  return offset;
}

/// tau = Sᵀ f of the joint of body i, for a wrench f about its origin in the axes of the base.
template <joint_kind K, class T> KSL_LANES void
effort_in_base(const body<scalar_of<T>> &b, const per_body<mat3x3, T> &rotation, int i, const coscrew<T> &f, T *tau) {
  if (b.is_base)
    joint<K>::effort(b, f, tau);
  else
    for_coordinates<K>(b, [&](auto k) KSL_INLINED { tau[k] = joint<K>::column(k, b, rotation, i).effort(f); });
}

/// Computes the axes of all bodies in those of the base.  Then calls one<K>(i, offset from the parent's origin) and lanes(k), in
/// the order of for_bodies, which needn't be called for the ground.
template <class T, class One, class Lanes>
KSL_LANES void express_in_base(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                               const per_body<mat3x3, T> &rotation, const T *q, One one, Lanes lanes) {
  const T o = T(0), l = T(1);
  mat3x3<T> last = {l, o, o, o, l,
                    o, o, o, l}; // axes of body i − 1, usually the parent; avoids a reload of what was just stored
  sines_and_cosines(model, pose, q);
  rotation.set(0, last);
  const auto step = [&](int i) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    if (only_turns(b.kind)) {
      if (b.parent != i - 1)
        last = rotation[b.parent];
      one.template operator()<turning_kind>(i, place<turning_kind>(b, pose, rotation, i, q, last));
    } else { // reloaded from memory afterwards, which leaves more registers to the fast path
      by_slower_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
        mat3x3<T> R = rotation[b.parent];
        one.template operator()<K>(i, place<K>(b, pose, rotation, i, q, R));
      });
      last = rotation[i];
    }
  };
  for_bodies<T>(model.bodies, step, [&](auto k) KSL_INLINED {
    if (is_number<T> || k.i > 0)
      lanes(k);
  });
}

/// Sets the axes and the origins of all bodies, and S of all coordinates about the base's origin, in the frame of the base.
template <class T>
KSL_LANES void locate_joints(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                             const per_body<mat3x3, T> &rotation, const array_of<vec3<T>> &origin,
                             const array_of<screw<T>> &column, const T *q) {
  origin[0] = {T(0), T(0), T(0)};
  const auto locate = [&]<joint_kind K>(int i, const vec3<T> &offset) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    const vec3<T> &p = origin[b.parent];
    const vec3<T> o = {p.x + offset.x, p.y + offset.y, p.z + offset.z};
    origin[i] = o;
    for_coordinates<K>(b,
                       [&](auto c) KSL_INLINED { column[b.v_index + c] = joint<K>::column(c, b, rotation, i).about(o); });
  };
  express_in_base(model, pose, rotation, q, locate, [](auto) KSL_INLINED {});
}

/// Expresses a momentum in the frame of body i, whose joint is of kind K, in the frame of the base.
template <joint_kind K, class T>
KSL_LANES coscrew<T> in_base(const per_body<mat3x3, T> &rotation, const array_of<vec3<T>> &origin, int i,
                             const coscrew<T> &momentum) {
  using A = algebra<T>;
  const mat3x3<T> R = rotation[i];
  coscrew<T> p;
  if constexpr (only_turns(K)) { // a body that turns about z has no linear momentum along z
    p.lin = {R.m00 * momentum.lin.x + R.m01 * momentum.lin.y, R.m10 * momentum.lin.x + R.m11 * momentum.lin.y,
             R.m20 * momentum.lin.x + R.m21 * momentum.lin.y};
    A::product_drv(&R, &momentum.ang, &p.ang);
  } else {
    A::product_CoAdrc(&R, &momentum, &p);
  }
  const vec3<T> o = origin[i];
  A::product_CoAdtc(&o, &p, &p);
  return p;
}

} // namespace KSL_ISA
} // namespace ksl
