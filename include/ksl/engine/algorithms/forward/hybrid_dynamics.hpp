// KSL: hybrid dynamics: some joints' accelerations are given, and the others' efforts.
//
// Featherstone, RBDA (2008), section 9.2: the articulated-body algorithm, with the quantities of forward_dynamics.hpp.  A joint whose
// acceleration q̈ is given is not eliminated: relative to its parent, its body moves as is known.  The parent feels all of its
// articulated inertia and, as a bias force,
//
//     p + A S q̈.                                                                                                 (1)
//
// When a', the acceleration that joint accelerations cause, is known for the body, the effort follows:
//
//     τ = Sᵀ (A a' + p).                                                                                         (2)
#pragma once

#include "ksl/engine/algorithms/forward/forward_dynamics.hpp"
#include "ksl/engine/model/joint_physics.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct hybrid_dynamics_workspace {
  forward_dynamics_workspace<T> forward;
  array_of<int> given; ///< for each body: is the acceleration of its joint given

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    forward.lay_out(memory, model);
    given.lay_out(memory, model.bodies);
  }
};

/// Adds A and the bias force (1) of body i, whose joint has the given accelerations a, to those of its parent.
template <joint_kind K, class T>
KSL_LANES void pass_given(const body<scalar_of<T>> &b, const forward_dynamics_workspace<T> &w, int i, const T *a) {
  using A = algebra<T>;
  articulated_inertia<T> inertia = w.A[i];
  coscrew<T> p = w.wrench[i], f;
  screw<T> own = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  for_coordinates<K>(b, [&](auto k) KSL_INLINED { joint<K>::column(k, b, w.rotation, i).add(a[k], own); });
  if (b.parent == 0)
    return;
  A::product_As(&inertia, &own, &f); // (1)
  A::xpy_cc(&f, &p);
  A::product_CoAdtc(&w.offset[i], &p, &p);
  add_wrench(w.wrench, b.parent, p);
  A::articulated_inertia_translated(&inertia, &w.offset[i], &inertia);
  articulated_inertia<T> sum = w.A[b.parent];
  A::articulated_inertia_added(&sum, &inertia, &sum);
  w.A.set(b.parent, sum);
}

/// Sets a' of body i, whose joint has the given accelerations a, and the efforts of its joint (2).
template <joint_kind K, class T>
KSL_LANES void accelerate_given(const body<scalar_of<T>> &b, const forward_dynamics_workspace<T> &w, int i, const T *a,
                                T *tau) {
  using A = algebra<T>;
  const articulated_inertia<T> inertia = w.A[i];
  coscrew<T> p = w.wrench[i], f;
  screw<T> s;
  A::product_Adtinvs(&w.offset[i], &w.acceleration[b.parent], &s);
  for_coordinates<K>(b, [&](auto k) KSL_INLINED { joint<K>::column(k, b, w.rotation, i).add(a[k], s); });
  w.acceleration[i] = s;
  A::product_As(&inertia, &s, &f); // (2)
  A::xpy_cc(&f, &p);
  effort_in_base<K>(b, w.rotation, i, p, tau);
}

/// Writes the transmitted efforts of a joint, but for armature, to `left`: the motors' efforts less damping, friction and springs.
template <joint_kind K, class T>
KSL_LANES const T *without_physics(const model_view<scalar_of<T>> &model, const body<scalar_of<T>> &b, const T *q,
                                   const T *v, const T *tau, T *left) {
  for (int k = 0; k < coordinates<K>(b); ++k)
    left[k] = tau[b.v_index + k] - passive_effort(model.physics[b.v_index + k], q, v[b.v_index + k]);
  return left;
}

/// Accelerations and efforts of all joints, a_out and tau_out (nv), for positions q (nq) and velocities v (nv), under gravity and
/// external wrenches.  For the joints that directly carry the links named, accelerations are given, in a (nv); for the others, efforts,
/// in tau (nv).  O(bodies).
template <class T>
void hybrid_dynamics(const model_view<scalar_of<T>> &model, const hybrid_dynamics_workspace<T> &w, const T *q,
                     const T *v, const T *a, const T *tau, int links, const int *link,
                     const external_wrenches<T> &external, T *a_out, T *tau_out) {
  for (int i = 0; i < model.bodies; ++i)
    w.given[i] = 0;
  for (int k = 0; k < links; ++k) {
    const int i = model.link[link[k]].body;
    w.given[i] = 1;
    if (model.body[i].ends_universal)
      w.given[model.body[i].parent] = 1;
  }
  for (int k = 0; k < model.nv; ++k) // first, since the results may be in place of a and tau
    a_out[k] = a[k], tau_out[k] = tau[k];
  start_articulated(model, w.forward, q, v, external);
  T left[6];
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      if (w.given[i])
        pass_given<K>(b, w.forward, i, a_out + b.v_index);
      else
        pass_to_parent<K>(b, w.forward, i,
                          model.physics ? without_physics<K>(model, b, q, v, tau_out, left) : tau_out + b.v_index,
                          physics_of(model, b));
    });
  }
  w.forward.acceleration[0] = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      if (w.given[i])
        accelerate_given<K>(b, w.forward, i, a_out + b.v_index, tau_out + b.v_index);
      else
        accelerate<K>(b, w.forward, i, a_out + b.v_index);
    });
    for (int k = b.v_index; model.physics && w.given[i] && k < b.v_index + b.nv; ++k)
      tau_out[k] = tau_out[k] + (T(model.physics[k].armature) * a_out[k] + passive_effort(model.physics[k], q, v[k]));
  }
}

} // namespace KSL_ISA
} // namespace ksl
