// KSL: the second derivatives of forward dynamics.
//
// tau = ID(q, v, a(q, v, tau)) holds identically.  Differentiated twice, it gives M times each second derivative of a (Singh, Russell,
// Wensing, IEEE Transactions on Robotics 40, 2024, section VI).  Subscripts are derivatives; those of tau are derivatives of inverse
// dynamics at these accelerations:
//
//     M a_qq = −(tau_qq + M_q a_q + (M_q a_q)ᵀ),   M a_vv = −tau_vv,   M a_qv = −(tau_qv + M_q a_v),   M a_qτ = −M_q M⁻¹.  (1)
//
// Element (i, k, m) of M_q x is the sum of dM_il/dq_k x_lm over l; the transpose exchanges k and m.  dM_il/dq_k is zero unless i, l
// and k are on one path from the ground, and such terms are left out.  Products by M⁻¹ keep their sums in registers.
#pragma once

#include "ksl/engine/algorithms/derivatives/forward_dynamics_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/inverse_dynamics_second_derivatives.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct forward_dynamics_second_derivatives_workspace {
  forward_dynamics_derivatives_workspace<T> first;
  inverse_dynamics_second_derivatives_workspace<T> second;
  array_of<T> da_dq, da_dv, M_inverse;
  array_of<T> M_by_q;        ///< dM_il/dq_k for one i, all l and k
  array_of<T> product;       ///< M_q a_q for one i
  array_of<T> columns;       ///< a few columns of a matrix with nv rows
  array_of<int> subtree_end; ///< for each coordinate: index after the last coordinate that it carries

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    first.lay_out(memory, model);
    second.lay_out(memory, model);
    memory.lay_out(model.nv * model.nv, da_dq, da_dv, M_inverse, M_by_q, product);
    // room for the widest registers, since the library measures workspaces without knowing which it will have
    columns.lay_out(memory, model.nv * column_registers * (is_number<T> ? padded(1) : 1));
    subtree_end.lay_out(memory, model.nv);
  }
  static constexpr int column_registers = 4;
};

/// X = −M⁻¹ X, where X has nv rows of `width` numbers.
template <class T>
void multiply_in_place(const forward_dynamics_second_derivatives_workspace<T> &w, index n, index width, T *X) {
  using P = lanes_of_coordinates<T>;
  constexpr index registers = forward_dynamics_second_derivatives_workspace<T>::column_registers;
  constexpr index lanes = static_cast<index>(sizeof(P) / sizeof(T)), block = registers * lanes;
  T *const columns = &w.columns[0];
  for (index first = 0; first < width; first += block) {
    const index count = width - first < block ? width - first : block;
    for (index l = 0; l < n; ++l)
      for (index c = 0; c < block; ++c)
        columns[l * block + c] = c < count ? X[l * width + first + c] : T(0);
    for (index i = 0; i < n; ++i) {
      P sum[registers];
      for (P &x : sum)
        x = P(T(0));
      for (index l = 0; l < n; ++l) {
        const P factor(w.M_inverse[i * n + l]);
        for (index r = 0; r < registers; ++r) {
          P x;
          body_lanes::read(columns + l * block + r * lanes, x);
          sum[r] = sum[r] - factor * x;
        }
      }
      T *const out = X + i * width + first;
      if constexpr (is_number<T>) {
        for (index r = 0; r * lanes < count; ++r)
          store_first<T>(sum[r], out + r * lanes, static_cast<int>(count - r * lanes));
      } else {
        for (index c = 0; c < count; ++c)
          out[c] = sum[c];
      }
    }
  }
}

/// Adds Σ_l M_lk X_l to each row k of `out`; X and `out` have rows of nv numbers.  M_lk is dM_il/dq_k, zero unless i, l and k are on
/// one path.
template <class T>
void add_product(const array_of<int> &subtree_end, index n, index i, const T *M, const T *X, T *out) {
  const auto on_one_path = [&](index a, index b)
                               KSL_INLINED { return a < b ? b < subtree_end[a] : a < subtree_end[b]; };
  for (index l = 0; l < n; ++l) {
    if (!on_one_path(i, l))
      continue;
    for (index k = 0; k < n; ++k) {
      if (!on_one_path(i, k) || !on_one_path(l, k))
        continue;
      const T factor = M[l * n + k];
      const T *const from = X + l * n;
      T *const to = out + k * n;
      for (index m = 0; m < n; ++m)
        to[m] = to[m] + factor * from[m];
    }
  }
}

/// Replaces the second derivatives of efforts by −M times those of accelerations: the right sides of (1), with the sign changed.
template <class T>
void add_products_of_first_derivatives(const forward_dynamics_second_derivatives_workspace<T> &w, index n, T *by_qq,
                                       T *by_qv, T *by_qtau) {
  const index matrix = n * n;
  T *const M = &w.M_by_q[0], *const product = &w.product[0];
  for (index i = 0; i < n; ++i) {
    T *const by_tau = by_qtau + i * matrix, *const by_q = by_qq + i * matrix;
    for (index k = 0; k < matrix; ++k)
      M[k] = by_tau[k], by_tau[k] = product[k] = T(0);
    add_product(w.subtree_end, n, i, M, &w.da_dq[0], product);
    add_product(w.subtree_end, n, i, M, &w.da_dv[0], by_qv + i * matrix);
    add_product(w.subtree_end, n, i, M, &w.M_inverse[0], by_tau);
    for (index k = 0; k < n; ++k)
      for (index m = 0; m < n; ++m)
        by_q[k * n + m] = by_q[k * n + m] + (product[k * n + m] + product[m * n + k]);
  }
}

/// The second derivatives of a = forward_dynamics(q, v, tau), each (nv, nv, nv), row-major.  Element (i, k, m) of d2a_dqdq is the
/// derivative along q ⊕ s e_m of the derivative of acceleration i along q ⊕ s e_k, v and tau held componentwise; in k and m it is
/// symmetric unless these are of one joint with several coordinates.  That of d2a_dvdv is by v_k and v_m, that of d2a_dqdv by q_k and v_m,
/// and that of d2a_dqdtau by q_k and tau_m.  External wrenches are held in the axes in which they are given, those of their links, which
/// move, or of the world.  q (nq), v and tau (nv).  O(nv⁴).
template <class T>
void forward_dynamics_second_derivatives(const model_view<scalar_of<T>> &model,
                                         const forward_dynamics_second_derivatives_workspace<T> &w, const T *q,
                                         const T *v, const T *tau, const external_wrenches<T> &external, T *d2a_dqdq,
                                         T *d2a_dvdv, T *d2a_dqdv, T *d2a_dqdtau) {
  const index n = model.nv;
  for (int i = 1; i < model.bodies; ++i)
    for (int k = 0; k < model.body[i].nv; ++k)
      w.subtree_end[model.body[i].v_index + k] = model.body[i].v_end;
  forward_dynamics_derivatives(model, w.first, q, v, tau, external, &w.da_dq[0], &w.da_dv[0], &w.M_inverse[0]);
  inverse_dynamics_second_derivatives(model, w.second, q, v, &w.first.a[0], external, d2a_dqdq, d2a_dvdv, d2a_dqdv,
                                      d2a_dqdtau);
  add_products_of_first_derivatives(w, n, d2a_dqdq, d2a_dqdv, d2a_dqdtau);
  T *const results[] = {d2a_dqdq, d2a_dvdv, d2a_dqdv, d2a_dqdtau};
  for (T *x : results)
    multiply_in_place(w, n, n * n, x);
}

} // namespace KSL_ISA
} // namespace ksl
