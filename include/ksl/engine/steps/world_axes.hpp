// KSL: axes and origins of all bodies in the world's axes.
//
// Each body keeps its own origin, given relative to a *reference point*: the origin of body 1, the first that moves.  So no digits
// are lost where a robot stands or floats far from the world's origin.
#pragma once

#include "ksl/engine/model/joints.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Axes and origins of all bodies.
template <class T> struct world_axes {
  pose_workspace<T> pose;
  per_body<mat3x3, T> rotation; ///< axes of each body in those of the world
  per_body<vec3, T> origin;     ///< of each body, relative to the reference point; of body 0: minus the reference point

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, rotation, origin);
  }
};

/// Computes the axes of all bodies in those of the world for q (nq).  place<K>(i, pose in the parent, the parent's axes) is called for
/// each body before its axes are set, and lanes(k) in the order of for_bodies.
template <class T, class Place, class Lanes>
KSL_LANES void rotate_to_world(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                               const per_body<mat3x3, T> &rotation, const T *q, Place place, Lanes lanes) {
  const T o = T(0), l = T(1);
  mat3x3<T> last = {l, o, o, o, l,
                    o, o, o, l}; // of body i − 1, usually the parent; avoids a reload of what was just stored
  sines_and_cosines(model, pose, q);
  rotation.set(0, last);
  const auto put = [&]<joint_kind K>(int i, mat3x3<T> &R) KSL_INLINED {
    const auto D = joint<K>::computed_pose(model.body[i], pose, q);
    place.template operator()<K>(i, D, R);
    D.rotate_axes(R);
    rotation.set(i, R);
  };
  const auto step = [&](int i) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    if (only_turns(b.kind)) {
      if (b.parent != i - 1)
        last = rotation[b.parent];
      put.template operator()<turning_kind>(i, last);
    } else { // reloaded from memory afterwards, which leaves more registers to the fast path
      by_slower_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
        mat3x3<T> R = rotation[b.parent];
        put.template operator()<K>(i, R);
      });
      last = rotation[i];
    }
  };
  for_bodies<T>(model.bodies, step, lanes);
}

/// Computes the axes and the origins of all bodies.
template <class T>
KSL_LANES void express_in_world(const model_view<scalar_of<T>> &model, const world_axes<T> &w, const T *q) {
  w.origin.set(0, {T(0), T(0), T(0)});
  const auto place = [&]<joint_kind K>(int i, const auto &D, const mat3x3<T> &R) KSL_INLINED {
    if (i == 1) { // the reference point; the ground's axes are the world's
      vec3<T> world;
      algebra<T>::vec3_inverted(&D.t, &world);
      w.origin.set(0, world);
    }
    vec3<T> origin;
    const vec3<T> parent = w.origin[model.body[i].parent];
    algebra<T>::product_drv(&R, &D.t, &origin);
    algebra<T>::xpy_vv(&parent, &origin);
    w.origin.set(i, origin);
  };
  rotate_to_world(model, w.pose, w.rotation, q, place, [](auto) KSL_INLINED {});
}

} // namespace KSL_ISA
} // namespace ksl
