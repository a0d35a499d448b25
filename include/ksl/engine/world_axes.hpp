// KSL: axes and origins of all bodies in the world's axes, and the centre of mass of the bodies that move.
//
// Each body keeps its own origin, given relative to a *reference point*: the origin of body 1, the first that moves.  So no digits
// are lost where a robot stands or floats far from the world's origin.
#pragma once

#include "ksl/engine/joints.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Where all bodies are.
template <class T> struct world_axes {
  pose_workspace<T> pose;
  per_body<mat3x3, T> rotation; ///< axes of each body in those of the world
  per_body<vec3, T> origin;     ///< of each body, relative to the reference point; of body 0: minus the reference point

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, rotation, origin);
  }
};

/// Sets the axes and the origin of body i.  R holds the parent's axes on entry and the body's on return.
template <joint_kind K, class T>
KSL_LANES void place_in_world(const body<scalar_of<T>> &b, const world_axes<T> &w, int i, const T *q, mat3x3<T> &R) {
  const auto D = joint<K>::computed_pose(b, w.pose, q);
  if (i == 1) { // the reference point; the ground's axes are the world's
    vec3<T> world;
    algebra<T>::vec3_inverted(&D.t, &world);
    w.origin.set(0, world);
  }
  vec3<T> origin;
  const vec3<T> parent = w.origin[b.parent];
  algebra<T>::product_drv(&R, &D.t, &origin);
  algebra<T>::xpy_vv(&parent, &origin);
  D.rotate_axes(R);
  w.rotation.set(i, R);
  w.origin.set(i, origin);
}

/// Computes the axes and the origins of all bodies for q (nq).  Calls lanes(k) in the order of for_bodies.
template <class T, class Lanes>
KSL_LANES void express_in_world(const model_view<scalar_of<T>> &model, const world_axes<T> &w, const T *q, Lanes lanes) {
  const T o = T(0), l = T(1);
  mat3x3<T> last = {l, o, o, o, l, o, o, o, l}; // of body i − 1, usually the parent; avoids a reload of what was just stored
  sines_and_cosines(model, w.pose, q);
  w.rotation.set(0, last);
  w.origin.set(0, {o, o, o});
  const auto step = [&](int i) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    if (only_turns(b.kind)) {
      if (b.parent != i - 1)
        last = w.rotation[b.parent];
      place_in_world<turning>(b, w, i, q, last);
    } else { // reloaded from memory afterwards, which leaves more registers to the fast path
      by_slower_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
        mat3x3<T> R = w.rotation[b.parent];
        place_in_world<K>(b, w, i, q, R);
      });
      last = w.rotation[i];
    }
  };
  for_bodies<T>(model.bodies, step, lanes);
}

/// The mass of the bodies that move, and their first moment about the reference point.  Links that are welded to the ground don't
/// count.
template <class T> struct moving_mass {
  T mass;
  vec3<T> moment; ///< mass × centre of mass

  /// Adds a subtree whose root body has the axes R and this origin.
  KSL_LANES void add(const spatial_inertia<T> &I, const mat3x3<T> &R, const vec3<T> &origin) {
    vec3<T> h;
    algebra<T>::product_drv(&R, &I.h, &h);
    algebra<T>::axpy_vv(I.m, &origin, &h);
    algebra<T>::xpy_vv(&h, &moment);
    mass = mass + I.m;
  }
  /// The centre of mass; NaN where nothing that moves has mass.
  KSL_LANES vec3<T> center() const { return {moment.x / mass, moment.y / mass, moment.z / mass}; }
  /// The point about which momenta are taken: the centre of mass, or the reference point where nothing that moves has mass.
  KSL_LANES vec3<T> point() const {
    const T none = T(0), divisor = math<T>::select(mass > none, mass, T(1));
    return {moment.x / divisor, moment.y / divisor, moment.z / divisor};
  }
};

} // namespace KSL_ISA
} // namespace ksl
