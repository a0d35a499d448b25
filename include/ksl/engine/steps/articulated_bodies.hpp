// KSL: bodies whose joints are eliminated from the leaves to the root: what the articulated-body algorithm and its relatives begin with.
//
// forward_dynamics.hpp has the algorithm; hybrid dynamics, M⁻¹ x and operational-space inertias share its quantities.
#pragma once

#include "ksl/engine/steps/articulated_inertia.hpp"
#include "ksl/engine/steps/base_axes.hpp"
#include "ksl/engine/steps/external_wrenches.hpp"
#include "ksl/engine/steps/newton_euler.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// What eliminating one coordinate of a joint leaves, from which its acceleration follows.
template <class T> struct coordinate_state {
  coscrew<T> U;
  T D_inverse, u;
};

/// All quantities are about each body's origin and in the axes of the base.
template <class T> struct articulated_workspace {
  pose_workspace<T> pose;
  per_body<mat3x3, T> rotation;       ///< axes of each body
  per_body<body_motion, T> motion;    ///< of each body, without joint accelerations
  per_body<coscrew, T> wrench;        ///< bias force p of each body
  per_body<articulated_inertia, T> A; ///< of each body
  array_of<vec3<T>> offset;           ///< from the parent's origin to that of each body
  array_of<coordinate_state<T>> coordinate;
  array_of<screw<T>> acceleration; ///< a' of each body, caused by the joint accelerations

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, rotation, motion, wrench, A, offset, acceleration);
    memory.lay_out(model.nv, coordinate);
  }
};

/// Sets axes, offsets and inertias of all bodies, their motions without joint accelerations, and the wrenches p that these motions
/// need.
template <class T>
void start_articulated(const model_view<scalar_of<T>> &model, const articulated_workspace<T> &w, const T *q, const T *v,
                       const external_wrenches<T> &external) {
  w.motion.set(0, ground_motion<T>(model));
  const auto move = [&]<joint_kind K>(int i, const vec3<T> &offset) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    w.offset[i] = offset;
    body_motion<T> m = w.motion[b.parent];
    m.acceleration = acceleration_at(m, offset);
    if constexpr (joint<K>::is_free)
      if (b.is_base) { // it floats on the ground; from here on all axes are those of this body
        const auto D = joint<K>::kept_pose(b, w.pose);
        D.to_body(m.acceleration);
      }
    joint<K>::add_steady_motion(b, w.rotation, i, v + b.v_index, m);
    w.motion.set(i, m);
  };
  express_in_base(model, w.pose, w.rotation, q, move, [&](auto k) KSL_INLINED {
    using P = typename decltype(k)::scalar;
    const spatial_inertia<P> I = rotated(own_inertia(model, k), w.rotation[k]);
    articulated_inertia<P> A;
    algebra<P>::spatial_inertia_toArticulated(&I, &A);
    w.A.set(k, A);
    w.wrench.set(k, newton_euler(I, w.motion[k]));
  });
  subtract_external(model, w.pose, external, w.wrench, [&](int i, coscrew<T> &f) KSL_INLINED {
    const mat3x3<T> R = w.rotation[i];
    algebra<T>::product_CoAdrc(&R, &f, &f);
  });
}

} // namespace KSL_ISA
} // namespace ksl
