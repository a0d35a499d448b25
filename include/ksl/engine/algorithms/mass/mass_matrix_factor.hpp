// KSL: the factors of the mass matrix that are as sparse as the tree, M = Lᵀ D L, and the solution of M x = y by them.
//
// Featherstone, RBDA (2008), section 6.5, table 6.3.  L is a unit lower triangle and D is diagonal.  Coordinates k are eliminated from
// the leaves to the root.  With i and j among the coordinates that carry k, i carrying j or equal to it,
//
//     D_k = M_kk,   M_ji ← M_ji − (M_kj / D_k) M_ki,   L_kj = M_kj / D_k.                                         (1)
//
// i, j and k are on one path, so that no new elements are created.  The rows of L are those of tree_rows.hpp, with D in the place of
// the ones.
#pragma once

#include "ksl/engine/algorithms/mass/mass_matrix.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Holds the rows of M, and then those of its factors.
template <class T> struct factor_workspace {
  tree_rows<T> rows;
  array_of<T> D_inverse; ///< of each coordinate
  array_of<int> path;    ///< the coordinates on the path from the ground to one coordinate, by their places

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    rows.lay_out(memory, model);
    D_inverse.lay_out(memory, model.nv);
    path.lay_out(memory, model.longest_path);
  }
};

template <class T> struct mass_matrix_factor_workspace {
  mass_matrix_workspace<T> mass;
  factor_workspace<T> factor;

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    mass.lay_out(memory, model);
    factor.lay_out(memory, model);
  }
};

/// Sets the rows of M for q (nq).
template <class T>
void rows_of_mass_matrix(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w,
                         const tree_rows<T> &rows, const T *q) {
  rows.clear_padding(model.nv);
  set_mass_matrix(model, w, q, rows);
}

/// Replaces the rows of M by those of its factors (1).  O(nv × depth²).  For a chain it costs a third of dense Cholesky factors.
template <class T> void factorise(const model_view<scalar_of<T>> &model, const factor_workspace<T> &w) {
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    for (int c = b.nv - 1; c >= 0; --c) {
      T *const row = w.rows[b.v_index + c];
      const index n = b.ancestors + c;
      const T D_inverse = T(1) / row[n]; // 1 / D_k
      w.D_inverse[b.v_index + c] = D_inverse;
      for_each_ancestor(model, i, c, [&](index ancestor, index place) KSL_INLINED {
        subtract_scaled(row[place] * D_inverse, row, w.rows[ancestor], place + 1); // M_ji of all i up to j
      });
      const T diagonal = row[n];
      scale(D_inverse, row, n); // L_kj
      row[n] = diagonal;        // scale() may have overwritten it
    }
  }
}

/// x = M⁻¹ x = L⁻¹ D⁻¹ L⁻ᵀ x for one vector.  L⁻ᵀ goes from the leaves to the root, L⁻¹ from the root to the leaves.
template <class T> void solve_factorised(const model_view<scalar_of<T>> &model, const factor_workspace<T> &w, T *x) {
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    for (int c = b.nv - 1; c >= 0; --c)
      for_each_ancestor(model, i, c, [&](index ancestor, index place) KSL_INLINED {
        x[ancestor] = x[ancestor] - w.rows[b.v_index + c][place] * x[b.v_index + c];
      });
  }
  for_each_row(model, [&](const auto &, index row, index place) KSL_INLINED {
    w.path[place] = static_cast<int>(row);
    T sum = w.D_inverse[row] * x[row];
    for (index k = 0; k < place; ++k)
      sum = sum - w.rows[row][k] * x[w.path[k]];
    x[row] = sum;
  });
}

/// The rows of L, row by row without gaps, with D on the diagonal, for q (nq): M = Lᵀ D L.  O(nv × depth²).
template <class T>
void mass_matrix_factor(const model_view<scalar_of<T>> &model, const mass_matrix_factor_workspace<T> &w, const T *q,
                        T *LD) {
  rows_of_mass_matrix(model, w.mass, w.factor.rows, q);
  factorise(model, w.factor);
  store_tree_rows(model, w.factor.rows, LD);
}

} // namespace KSL_ISA
} // namespace ksl
