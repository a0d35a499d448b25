// KSL: the inverse of the mass matrix.
//
// With the factors M = Lᵀ D L (mass_matrix_factor.hpp), W = M⁻¹ satisfies
//
//     L W = D⁻¹ L⁻ᵀ,   an upper triangle with the diagonal D⁻¹ (Takahashi, Fagan and Chen 1973).                  (1)
//
// So row i of W, up to the diagonal, is a combination of the rows j of the coordinates that carry i:
//
//     W_ik = −Σ L_ij W_jk  for k < i,   W_ii = 1/D_i − Σ L_ij W_ij.                                               (2)
//
// That takes half as many operations as columns of solutions.  Carpentier, "Analytical inverse of the joint space inertia matrix"
// (2018), propagates articulated inertias instead, at 60 operations for each pair of a joint and an ancestor.
#pragma once

#include "ksl/engine/algorithms/mass/mass_matrix_factor.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct mass_matrix_inverse_workspace {
  mass_matrix_workspace<T> mass;
  factor_workspace<T> factor;
  padded_matrix<T> W; ///< with plain numbers

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    mass.lay_out(memory, model);
    factor.lay_out(memory, model);
    W.lay_out(memory, is_number<T> ? model.nv : 0);
  }
};

/// Copies row `row` of W to the column of the same number, in the rows from `first` on that are above the diagonal.  Whole registers
/// are stored, so that a reload doesn't have to wait for the store.
template <class T> KSL_LANES void mirror_row(const padded_matrix<T> &W, index first, index row) {
  using P = native_pack<T>;
  constexpr index lanes = native_lanes<T>;
  const index block = row / lanes * lanes;
  P number;
  for (int k = 0; k < lanes; ++k)
    number.set(k, T(k));
  const auto here = number == P(T(row - block));
  const T *const from = W[row];
  for (index k = first; k < row; ++k) {
    P x;
    body_lanes::read(W[k] + block, x);
    body_lanes::write(math<P>::select(here, P(from[k]), x), W[k] + block);
  }
}

/// W = M⁻¹ from the factors (2).  Rows begin at distances of W.pitch().  Elements of coordinates in different trees are zero.
template <class T> void invert_factorised(const model_view<scalar_of<T>> &model, const factor_workspace<T> &w,
                                          const padded_matrix<T> &W) {
  using P = native_pack<T>;
  constexpr index lanes = native_lanes<T>;
  index first = 0; // first column of the tree that the row belongs to
  for_each_row(model, [&](const auto &b, index row, index place) KSL_INLINED {
    if (b.parent == 0)
      first = b.v_index;
    w.path[place] = static_cast<int>(row);
    const T *const L = w.rows[row];
    T *const out = W[row];
    for (index k = 0; k < W.pitch(); k += lanes) {
      P sum(T(0));
      if (k + lanes > first && k < row)
        for (index a = 0; a < place; ++a) {
          P x;
          body_lanes::read(W[w.path[a]] + k, x);
          sum = sum - P(L[a]) * x;
        }
      body_lanes::write(sum, out + k);
    }
    T diagonal = w.D_inverse[row];
    for (index a = 0; a < place; ++a)
      diagonal = diagonal - L[a] * out[w.path[a]];
    mirror_row(W, first, row);
    set_lane(out, row, diagonal);
  });
}

/// Sets the elements [k, k + count) of row `row` of W and of the column of the same number (2).  A number of L is read once for all of them.
template <int count, class T>
KSL_LANES void set_inverse_elements(const factor_workspace<T> &w, index place, index n, index row, index k, T *W) {
  const T *const L = w.rows[row];
  const int *const path = &w.path[0];
  T sum[count];
  for (T &x : sum)
    x = T(0);
  for (index a = 0; a < place; ++a) {
    const T l = L[a], *const above = W + path[a] * n + k;
    for (int c = 0; c < count; ++c)
      sum[c] = sum[c] - l * above[c];
  }
  for (int c = 0; c < count; ++c)
    W[row * n + k + c] = W[(k + c) * n + row] = sum[c];
}

/// The inverse for other scalars, in a matrix without gaps.
template <class T> void invert_factorised(const model_view<scalar_of<T>> &model, const factor_workspace<T> &w, T *W) {
  const index n = model.nv;
  index first = 0;
  for_each_row(model, [&](const auto &b, index row, index place) KSL_INLINED {
    if (b.parent == 0)
      first = b.v_index;
    w.path[place] = static_cast<int>(row);
    for (index k = 0; k < first; ++k)
      W[row * n + k] = W[k * n + row] = T(0);
    index k = first;
    for (; k + 4 <= row; k += 4)
      set_inverse_elements<4>(w, place, n, row, k, W);
    for (; k < row; ++k)
      set_inverse_elements<1>(w, place, n, row, k, W);
    const T *const L = w.rows[row];
    T diagonal = w.D_inverse[row];
    for (index a = 0; a < place; ++a)
      diagonal = diagonal - L[a] * W[row * n + w.path[a]];
    W[row * n + row] = diagonal;
  });
}

/// M⁻¹ (nv, nv), row-major and symmetric, for q (nq).  O(nv² × depth) additions and multiplications, in lanes.
template <class T>
void mass_matrix_inverse(const model_view<scalar_of<T>> &model, const mass_matrix_inverse_workspace<T> &w, const T *q,
                         T *W) {
  rows_of_mass_matrix(model, w.mass, w.factor.rows, q);
  factorise(model, w.factor);
  if constexpr (is_number<T>) {
    invert_factorised(model, w.factor, w.W);
    w.W.store(W);
  } else {
    invert_factorised(model, w.factor, W);
  }
}

} // namespace KSL_ISA
} // namespace ksl
