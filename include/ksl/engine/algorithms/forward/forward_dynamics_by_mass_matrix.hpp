// KSL: forward dynamics through the mass matrix: a = M⁻¹ (tau − bias).
//
// Featherstone, RBDA (2008), section 6.1.  It is slower than the articulated-body algorithm, except for very small mechanisms.  The
// two have nothing in common but the model, so that each checks the other.
#pragma once

#include "ksl/engine/algorithms/inverse/inverse_dynamics.hpp"
#include "ksl/engine/algorithms/mass/mass_matrix_factor.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct forward_dynamics_by_mass_matrix_workspace {
  inverse_dynamics_workspace<T> inverse;
  mass_matrix_workspace<T> mass;
  factor_workspace<T> factor;
  array_of<T> zero; ///< no accelerations

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    inverse.lay_out(memory, model);
    mass.lay_out(memory, model);
    factor.lay_out(memory, model);
    zero.lay_out(memory, model.nv);
  }
};

/// Accelerations a (nv) for positions q (nq), velocities v (nv) and joint efforts tau (nv) under gravity and external wrenches.
/// Leaves the factors of M in the workspace.  O(nv × depth²).
template <class T>
void forward_dynamics_by_mass_matrix(const model_view<scalar_of<T>> &model,
                                     const forward_dynamics_by_mass_matrix_workspace<T> &w, const T *q, const T *v,
                                     const T *tau, const external_wrenches<T> &external, T *a) {
  T *const zero = &w.zero[0];
  for (int k = 0; k < model.nv; ++k)
    zero[k] = T(0);
  inverse_dynamics(model, w.inverse, q, v, zero, external, zero); // the bias, in place of the accelerations
  rows_of_mass_matrix(model, w.mass, w.factor.rows, q);
  factorise(model, w.factor);
  for (int k = 0; k < model.nv; ++k)
    a[k] = tau[k] - zero[k];
  solve_factorised(model, w.factor, a);
}

} // namespace KSL_ISA
} // namespace ksl
