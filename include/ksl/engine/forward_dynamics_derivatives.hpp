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
  array_of<int> related;  ///< the coordinates that carry one body or are carried by it, its own included; of some columns

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    forward.lay_out(memory, model);
    derivatives.lay_out(memory, model);
    W.lay_out(memory, is_number<T> ? model.nv : 0);
    a.lay_out(memory, model.nv);
    dtau.lay_out(memory, 3 * model.nv * model.nv + (is_number<T> ? padded(1) : 0)); // registers are loaded at any column
    related.lay_out(memory, model.nv);
  }
};

/// Rows [row, row + rows) of both products −W X and −W Y, summed over the related coordinates: as many columns as P has lanes.
/// The rows of W begin at distances of `pitch`.
template <class P, int rows, class T>
KSL_LANES void multiply_related(const T *W, index pitch, const T *X, const T *Y, index n, index row, index column,
                                const array_of<int> &related, index terms, T *X_out, T *Y_out) {
  P x_sum[rows], y_sum[rows];
  for (int b = 0; b < rows; ++b)
    x_sum[b] = y_sum[b] = P(T(0));
  for (index t = 0; t < terms; ++t) {
    const index k = related[t];
    P x, y;
    body_lanes::read(X + k * n + column, x);
    body_lanes::read(Y + k * n + column, y);
    for (int b = 0; b < rows; ++b) {
      const P w(W[(row + b) * pitch + k]);
      x_sum[b] = x_sum[b] - w * x;
      y_sum[b] = y_sum[b] - w * y;
    }
  }
  for (int b = 0; b < rows; ++b) {
    const index at = (row + b) * n + column;
    if constexpr (is_number<T>) {
      store_first<T>(x_sum[b], X_out + at, static_cast<int>(n - column));
      store_first<T>(y_sum[b], Y_out + at, static_cast<int>(n - column));
    } else {
      X_out[at] = x_sum[b], Y_out[at] = y_sum[b];
    }
  }
}

/// All rows of these columns.  Sums of several rows hide each other's latency.
template <class P, class T>
KSL_LANES void multiply_columns(const T *W, index pitch, const T *X, const T *Y, index n, index column, const array_of<int> &related,
                                index terms, T *X_out, T *Y_out) {
  index row = 0;
  for (; row + 4 <= n; row += 4)
    multiply_related<P, 4>(W, pitch, X, Y, n, row, column, related, terms, X_out, Y_out);
  if (row + 2 <= n) {
    multiply_related<P, 2>(W, pitch, X, Y, n, row, column, related, terms, X_out, Y_out);
    row += 2;
  }
  if (row < n)
    multiply_related<P, 1>(W, pitch, X, Y, n, row, column, related, terms, X_out, Y_out);
}

/// Lists the coordinates that carry any of the columns [column, end) or are carried by one, in order, and returns their number.
template <class S> KSL_LANES index list_related(const model_view<S> &model, index column, index end, const array_of<int> &related) {
  index terms = 0, carried = 0; // coordinates before `carried` that come after the columns are carried by one of them
  for (int i = 1; i < model.bodies; ++i) {
    const body<S> &b = model.body[i];
    if (b.v_index < end && b.v_index + b.nv > column && b.v_end > carried)
      carried = b.v_end;
    if ((b.v_index < end && b.v_end > column) || b.v_index < carried)
      for (int k = b.v_index; k < b.v_index + b.nv; ++k)
        related[terms++] = k;
  }
  return terms;
}

/// The products −W X and −W Y, where an element of X or Y is zero unless one of its coordinates carries the other.  With plain
/// numbers, columns are in lanes.  Zeros that are left out don't change the sums, which begin with +0.
template <class T>
void negative_products(const model_view<scalar_of<T>> &model, const array_of<int> &related, const T *W, index pitch, const T *X,
                       const T *Y, T *X_out, T *Y_out) {
  const index n = model.nv;
  if constexpr (is_number<T>) {
    constexpr index lanes = native_lanes<T>;
    for (index column = 0; column < n; column += lanes) {
      const index terms = list_related(model, column, column + lanes, related);
      multiply_columns<native_pack<T>>(W, pitch, X, Y, n, column, related, terms, X_out, Y_out);
    }
  } else {
    for (int i = 1; i < model.bodies; ++i) {
      const body<scalar_of<T>> &b = model.body[i];
      const index terms = list_related(model, b.v_index, b.v_index + b.nv, related);
      for (index column = b.v_index; column < b.v_index + b.nv; ++column)
        multiply_columns<T>(W, pitch, X, Y, n, column, related, terms, X_out, Y_out);
    }
  }
}

/// The derivatives of a = forward_dynamics(q, v, tau), each (nv, nv), row-major: with respect to q along q ⊕ s e_k with v and tau
/// held componentwise, to v, and to tau, which is M⁻¹.  External wrenches are held in the axes in which they are given, those of
/// their links, which move, or of the world.  q (nq), v and tau (nv).  O(nv² × depth).
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
    negative_products(model, w.related, w.W[0], w.W.pitch(), by_q, by_v, da_dq, da_dv);
  } else {
    invert_factorised(model, w.forward.factor, da_dtau);
    negative_products(model, w.related, da_dtau, model.nv, by_q, by_v, da_dq, da_dv);
  }
}

} // namespace KSL_ISA
} // namespace ksl
