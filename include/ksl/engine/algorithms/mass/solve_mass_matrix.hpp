// KSL: M⁻¹ x in O(bodies), and the jump of velocities that impulses cause.
//
// Both are the articulated-body algorithm (Featherstone, RBDA (2008), table 7.1) without gravity and velocities.
#pragma once

#include "ksl/engine/algorithms/forward/forward_dynamics.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> using solve_mass_matrix_workspace = forward_dynamics_workspace<T>;
template <class T> using velocity_jump_workspace = forward_dynamics_workspace<T>;

/// start_articulated (articulated_bodies.hpp) at rest and without gravity: sets axes, offsets and inertias of all bodies for q (nq).  The
/// bias forces are minus the external wrenches.
template <class T>
void start_at_rest(const model_view<scalar_of<T>> &model, const forward_dynamics_workspace<T> &w, const T *q,
                   const external_wrenches<T> &external) {
  const auto place = [&]<joint_kind K>(int i, const vec3<T> &offset) KSL_INLINED { w.offset[i] = offset; };
  express_in_base(model, w.pose, w.rotation, q, place, [&](auto k) KSL_INLINED {
    using P = typename decltype(k)::scalar;
    const spatial_inertia<P> I = rotated(own_inertia(model, k), w.rotation[k]);
    articulated_inertia<P> A;
    algebra<P>::spatial_inertia_toArticulated(&I, &A);
    const P zero(scalar_of<P>(0));
    w.A.set(k, A);
    w.wrench.set(k, {{zero, zero, zero}, {zero, zero, zero}});
  });
  subtract_external(model, w.pose, external, w.wrench, [&](int i, coscrew<T> &f) KSL_INLINED {
    const mat3x3<T> R = w.rotation[i];
    algebra<T>::product_CoAdrc(&R, &f, &f);
  });
}

/// a (nv) with M a = tau (nv), at positions q (nq).  O(bodies), about 400 flops for each.
template <class T>
void solve_mass_matrix(const model_view<scalar_of<T>> &model, const solve_mass_matrix_workspace<T> &w, const T *q,
                       const T *tau, T *a) {
  start_at_rest(model, w, q, {});
  eliminate_joints(model, w, tau);
  accelerate_joints(model, w, a);
}

/// The jump dv (nv) of the joint velocities caused by impulses on links, at positions q (nq): M dv = Σ Jᵀ impulse.  The impulses are
/// external wrenches integrated over time, N s and N m s.  O(bodies).
template <class T>
void velocity_jump(const model_view<scalar_of<T>> &model, const velocity_jump_workspace<T> &w, const T *q,
                   const external_wrenches<T> &impulses, T *dv) {
  start_at_rest(model, w, q, impulses);
  for (int k = 0; k < model.nv; ++k)
    dv[k] = T(0); // the efforts, which the jump replaces one by one
  eliminate_joints(model, w, dv);
  accelerate_joints(model, w, dv);
}

} // namespace KSL_ISA
} // namespace ksl
