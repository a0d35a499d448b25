// KSL: the first derivatives of forward dynamics.
//
// With tau held, a change of the state is answered by ∂a = −M⁻¹ ∂tau, where ∂tau is that of inverse dynamics at the accelerations of
// forward dynamics (Carpentier and Mansard, "Analytical derivatives of rigid body dynamics algorithms", RSS 2018, eq. (27)).  M⁻¹ is
// applied by factors that are as sparse as the tree.
#pragma once

#include "ksl/engine/forward_dynamics_by_mass_matrix.hpp"
#include "ksl/engine/inverse_dynamics_derivatives.hpp"
#include "ksl/engine/mass_matrix_inverse.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct forward_dynamics_derivatives_workspace {
  forward_dynamics_by_mass_matrix_workspace<T> forward;
  inverse_dynamics_derivatives_workspace<T> derivatives;
  padded_matrix<T> W;        ///< M⁻¹; with plain numbers
  array_of<T> a;             ///< accelerations
  array_of<T> dtau;          ///< derivatives of inverse dynamics: by q, by v, by a
  array_of<T> solved;        ///< nv rows of those by q and by v; with plain numbers
  index pitch;               ///< between these rows

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    forward.lay_out(memory, model);
    derivatives.lay_out(memory, model);
    W.lay_out(memory, is_number<T> ? model.nv : 0);
    a.lay_out(memory, model.nv);
    dtau.lay_out(memory, 3 * model.nv * model.nv);
    pitch = is_number<T> ? padded(2 * model.nv) : 0;
    solved.lay_out(memory, model.nv * static_cast<int>(pitch));
  }
};

/// out = −M⁻¹ x of two matrices (nv, nv): with plain numbers side by side, in padded rows.
template <class T>
void solve_side_by_side(const model_view<T> &model, const forward_dynamics_derivatives_workspace<T> &w, const T *by_q, const T *by_v,
                        T *da_dq, T *da_dv) {
  const index n = model.nv;
  for (index row = 0; row < n; ++row) {
    T *const to = &w.solved[row * w.pitch];
    copy_numbers(by_q + row * n, to, n);
    copy_numbers(by_v + row * n, to + n, n);
    for (index k = 2 * n; k < w.pitch; ++k)
      to[k] = T(0); // subnormal numbers that happen to be in the padding are slow
  }
  solve_factorised(model, w.forward.factor, &w.solved[0], 2 * n, w.pitch);
  for (index row = 0; row < n; ++row) {
    const T *const from = &w.solved[row * w.pitch];
    store_negative(from, da_dq + row * n, n);
    store_negative(from + n, da_dv + row * n, n);
  }
}

/// out = −M⁻¹ x for other scalars; x is overwritten.
template <class T>
void solve_negative(const model_view<scalar_of<T>> &model, const factor_workspace<T> &w, T *x, T *out) {
  solve_factorised(model, w, x, model.nv, model.nv);
  store_negative(x, out, index(model.nv) * model.nv);
}

/// The derivatives of a = forward_dynamics(q, v, tau), each (nv, nv), row-major: with respect to q along q ⊕ s e_k with v and tau
/// held componentwise, to v, and to tau, which is M⁻¹.  External wrenches are held in their links' axes and move with them.  q (nq),
/// v and tau (nv).  O(nv² × depth).
template <class T>
void forward_dynamics_derivatives(const model_view<scalar_of<T>> &model, const forward_dynamics_derivatives_workspace<T> &w,
                                  const T *q, const T *v, const T *tau, const external_wrenches<T> &external, T *da_dq, T *da_dv,
                                  T *da_dtau) {
  const index n = index(model.nv) * model.nv;
  T *const by_q = &w.dtau[0], *const by_v = by_q + n, *const a = &w.a[0];
  forward_dynamics_by_mass_matrix(model, w.forward, q, v, tau, external, a);
  inverse_dynamics_derivatives(model, w.derivatives, q, v, a, external, by_q, by_v, by_v + n);
  if constexpr (is_number<T>) {
    invert_factorised(model, w.forward.factor, w.W);
    w.W.store(da_dtau);
    solve_side_by_side(model, w, by_q, by_v, da_dq, da_dv);
  } else {
    invert_factorised(model, w.forward.factor, da_dtau);
    solve_negative(model, w.forward.factor, by_q, da_dq);
    solve_negative(model, w.forward.factor, by_v, da_dv);
  }
}

} // namespace KSL_ISA
} // namespace ksl
