// KSL: the first derivatives of forward dynamics.
//
// With tau held, a change of the state is answered by ∂a = −M⁻¹ ∂tau, where ∂tau is that of inverse dynamics at the accelerations of
// forward dynamics (Carpentier and Mansard, "Analytical derivatives of rigid body dynamics algorithms", RSS 2018, eq. (27)).  M⁻¹ is a
// result, too.  Multiplying by it keeps sums in registers, which takes half the time of solving with the factors of M.
#pragma once

#include "ksl/engine/forward_dynamics_by_mass_matrix.hpp"
#include "ksl/engine/inverse_dynamics_derivatives.hpp"
#include "ksl/engine/mass_matrix_inverse.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct forward_dynamics_derivatives_workspace {
  forward_dynamics_by_mass_matrix_workspace<T> forward;
  inverse_dynamics_derivatives_workspace<T> derivatives;
  padded_matrix<T> W;     ///< M⁻¹; with plain numbers
  array_of<T> a;          ///< accelerations
  array_of<T> dtau;       ///< derivatives of inverse dynamics: by q, by v, by a
  array_of<int> related;  ///< the coordinates that carry one body or are carried by it, its own included; with other scalars

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    forward.lay_out(memory, model);
    derivatives.lay_out(memory, model);
    W.lay_out(memory, is_number<T> ? model.nv : 0);
    a.lay_out(memory, model.nv);
    dtau.lay_out(memory, 3 * model.nv * model.nv + (is_number<T> ? padded(1) : 0)); // registers are loaded at any column
    related.lay_out(memory, model.nv);
  }
};

/// Columns [column, column + registers) of row `row` of out = −W X.
template <int registers, class T>
KSL_LANES void multiply_columns(const padded_matrix<T> &W, const T *X, index n, index row, index column, T *out) {
  using P = native_pack<T>;
  constexpr index lanes = native_lanes<T>;
  P sum[registers];
  for (int b = 0; b < registers; ++b)
    sum[b] = P(T(0));
  for (index k = 0; k < n; ++k) {
    const P factor(W[row][k]);
    for (int b = 0; b < registers; ++b) {
      P x;
      body_lanes::read(X + k * n + column + b * lanes, x);
      sum[b] = sum[b] - factor * x;
    }
  }
  for (int b = 0; b < registers; ++b)
    store_first<T>(sum[b], out + row * n + column + b * lanes, static_cast<int>(n - column - b * lanes));
}

/// out = −W X, X without gaps.
template <class T> void negative_product(const padded_matrix<T> &W, const T *X, index n, T *out) {
  constexpr index lanes = native_lanes<T>;
  for (index row = 0; row < n; ++row) {
    index column = 0;
    for (; column + 4 * lanes <= n; column += 4 * lanes)
      multiply_columns<4>(W, X, n, row, column, out);
    for (; column < n; column += lanes)
      multiply_columns<1>(W, X, n, row, column, out);
  }
}

/// Rows [row, row + rows) of one column of both products −W X and −W Y, summed over the related coordinates.
template <int rows, class T>
KSL_LANES void multiply_related(const T *W, const T *X, const T *Y, index n, index row, index column, const array_of<int> &related,
                                index terms, T *X_out, T *Y_out) {
  T x_sum[rows], y_sum[rows];
  for (int b = 0; b < rows; ++b)
    x_sum[b] = y_sum[b] = T(0);
  for (index t = 0; t < terms; ++t) {
    const index k = related[t];
    const T x = X[k * n + column], y = Y[k * n + column];
    for (int b = 0; b < rows; ++b) {
      const T &w = W[(row + b) * n + k];
      x_sum[b] = x_sum[b] - w * x;
      y_sum[b] = y_sum[b] - w * y;
    }
  }
  for (int b = 0; b < rows; ++b)
    X_out[(row + b) * n + column] = x_sum[b], Y_out[(row + b) * n + column] = y_sum[b];
}

/// The products −W X and −W Y, where an element of X or Y is zero unless one of its coordinates carries the other.  Zeros are left
/// out; otherwise the sums are those of negative_product, to the bit.
template <class T>
void negative_products(const model_view<scalar_of<T>> &model, const array_of<int> &related, const T *W, const T *X, const T *Y, T *X_out,
                       T *Y_out) {
  const index n = model.nv;
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    for_each_ancestor(model, i, 0, [&](index ancestor, index place) KSL_INLINED { related[place] = static_cast<int>(ancestor); });
    index terms = b.ancestors;
    for (int k = b.v_index; k < b.v_end; ++k)
      related[terms++] = k;
    for (index column = b.v_index; column < b.v_index + b.nv; ++column) {
      index row = 0;
      for (; row + 4 <= n; row += 4)
        multiply_related<4>(W, X, Y, n, row, column, related, terms, X_out, Y_out);
      for (; row < n; ++row)
        multiply_related<1>(W, X, Y, n, row, column, related, terms, X_out, Y_out);
    }
  }
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
    negative_product(w.W, by_q, model.nv, da_dq);
    negative_product(w.W, by_v, model.nv, da_dv);
  } else {
    invert_factorised(model, w.forward.factor, da_dtau);
    negative_products(model, w.related, da_dtau, by_q, by_v, da_dq, da_dv);
  }
}

} // namespace KSL_ISA
} // namespace ksl
