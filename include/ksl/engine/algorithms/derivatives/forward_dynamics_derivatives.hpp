// KSL: the first derivatives of forward dynamics.
//
// tau = ID(q, v, a) holds identically for the accelerations a of forward dynamics.  Differentiated with tau held, and by tau, it gives
// (Carpentier and Mansard, "Analytical derivatives of rigid body dynamics algorithms", RSS 2018, eq. (27))
//
//     ∂a/∂q = −M⁻¹ ∂ID/∂q,   ∂a/∂v = −M⁻¹ ∂ID/∂v,   ∂a/∂tau = M⁻¹.                                               (1)
//
// M⁻¹ is a result, too.  Multiplying by it keeps sums in registers, which takes half the time of solving with the factors of M.
//
// One pass over the bodies serves all of (1):
// - Motions, subtree inertias I and the wrenches f through the joints are computed without joint accelerations.  Then
//   tau − Sᵀ f is the effort that accelerates, and M_ik = S_k · I_i S_i for each k that carries i.                    (2)
// - M⁻¹, and from it a, follow.
// - The accelerations change the wrenches, and what depends on them, linearly.  Let a'_λ be the acceleration that they add to the
//   body that carries a joint.  Then of a coordinate of this joint
//
//     Ψ̈ changes by a'_λ × S,    f by I a'_λ + Σ I_k S_k a_k, the sum over the coordinates k of the joint and beyond it.     (3)
//
// - ∂ID follows as in inverse_dynamics_derivatives.hpp.
#pragma once

#include "ksl/engine/algorithms/derivatives/inverse_dynamics_derivatives.hpp"
#include "ksl/engine/algorithms/mass/mass_matrix_inverse.hpp"
#include "ksl/engine/model/joint_physics.hpp"

namespace ksl {

/// What joint accelerations add at a coordinate (3).
template <class T> struct acceleration_change {
  screw<T> carrier;  ///< a'_λ: to the acceleration of the body that carries the joint
  coscrew<T> wrench; ///< to the wrench through the joint: the sum of I_k S_k a_k
};

inline namespace KSL_ISA {

constexpr int column_groups = 4; ///< how many groups of columns are multiplied together

template <class T> struct forward_dynamics_derivatives_workspace {
  inverse_dynamics_derivatives_workspace<T> derivatives;
  factor_workspace<T> factor;
  per_coordinate<acceleration_change, T> change; ///< with plain numbers
  array_of<screw<T>> acceleration;               ///< what joint accelerations add to the acceleration of each body
  array_of<coscrew<T>> wrench; ///< the sum of I_k S_k a_k over the coordinates of each body's joint and beyond
  padded_matrix<T> W;          ///< M⁻¹; with plain numbers
  array_of<T> a, rest;         ///< accelerations, and the efforts that cause them: tau − bias
  array_of<T> dtau;            ///< derivatives of inverse dynamics by q, then by v
  array_of<int> related;       ///< lists of related coordinates, for each group of columns (list_related)

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    derivatives.lay_out(memory, model);
    factor.lay_out(memory, model);
    memory.lay_out(is_number<T> ? model.nv : 0, change);
    memory.lay_out(model.nv, a, rest);
    memory.lay_out(model.bodies, acceleration, wrench);
    W.lay_out(memory, is_number<T> ? model.nv : 0);
    dtau.lay_out(memory, std::ptrdiff_t(2) * model.nv * model.nv +
                             (is_number<T> ? padded(1) : 0)); // registers are loaded at any column
    related.lay_out(memory, column_groups * model.nv);
  }
};

/// Sets I S of all coordinates, and rest = tau − Sᵀ f (2).
template <class T> KSL_LANES void set_momenta(const model_view<scalar_of<T>> &model,
                                              const wrench_derivatives_workspace<T> &w, const T *tau, T *rest) {
  if constexpr (is_number<T>) {
    using P = native_pack<T>;
    using A = algebra<P>;
    for (int k = 0; k < model.nv; k += native_lanes<T>) {
      const auto d = w.subtree.template get<P>(k);
      const auto S = w.coordinate.template part<screw, P>(k);
      coscrew<P> momentum;
      A::product_Ms(&d.I, &S, &momentum);
      w.derivative.template set_part<coscrew, P, 12>(k, momentum);
      store_first<T>(load_first(tau + k, model.nv - k) - A::dot_cs(&d.f, &S), rest + k, model.nv - k);
    }
  } else {
    using A = algebra<T>;
    for (int i = 1; i < model.bodies; ++i) {
      const subtree_dynamics<T> &d = w.subtree.at(last_coordinate(model, i));
      for (int k = model.body[i].v_index; k < model.body[i].v_index + model.body[i].nv; ++k) {
        const screw<T> &S = w.coordinate.at(k).S;
        A::product_Ms(&d.I, &S, &w.derivative.at(k).by_a);
        rest[k] = tau[k] - A::dot_cs(&d.f, &S);
      }
    }
  }
}

/// Sets the rows of M (tree_rows.hpp): row i has S_k · I_i S_i for the coordinates k that carry i (2).
template <class T> KSL_LANES void set_mass_rows(const model_view<scalar_of<T>> &model,
                                                const inverse_dynamics_derivatives_workspace<T> &w,
                                                const tree_rows<T> &rows) {
  const wrench_derivatives_workspace<T> &d = w.wrenches;
  rows.clear_padding(model.nv);
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    if constexpr (is_number<T>) { // several elements of a row in lanes
      using P = native_pack<T>;
      const int runs = extend_runs<T>(model, w, i);
      for (int row = b.v_index; row < b.v_index + b.nv; ++row) {
        const auto momentum = in_all_lanes<P, coscrew>(d.derivative.template part<coscrew, T, 12>(row));
        T *to = rows[row];
        for (int r = 0; r < runs; ++r) {
          const coordinate_run run = w.runs[r];
          for (int k = run.first; k < run.end; k += native_lanes<T>) {
            const auto S = d.coordinate.template part<screw, P>(k);
            store_first<T>(algebra<P>::dot_cs(&momentum, &S), to + (k - run.first), run.end - k);
          }
          to += run.end - run.first;
        }
      }
    } else {
      const coordinate_motion<T> *const coordinate = &d.coordinate.at(0);
      for (int row = b.v_index; row < b.v_index + b.nv; ++row) {
        const coscrew<T> momentum = d.derivative.at(row).by_a;
        T *to = rows[row] + b.ancestors + b.nv;
        for_carriers(model, i, [&](index first, index end) KSL_INLINED {
          to -= end - first;
          for (index k = first; k < end; ++k)
            to[k - first] = algebra<T>::dot_cs(&momentum, &coordinate[k].S);
        });
      }
    }
  }
}

/// Adds the physics of joints: armature to the diagonal of M, and damping, friction and springs to the bias.
template <class T> void add_physics(const model_view<scalar_of<T>> &model, const tree_rows<T> &rows, const T *q,
                                    const T *v, T *rest) {
  for_each_row(model, [&](const auto &, index row, index place) {
    const coordinate_physics<scalar_of<T>> &c = model.physics[row];
    rows[row][place] = rows[row][place] + T(c.armature);
    rest[row] = rest[row] - passive_effort(c, q, v[row]);
  });
}

/// Adds what accelerations change at a coordinate (3): to Ψ̈, and to the wrench through the joint.
template <class T> KSL_LANES void accelerate(const screw<T> &carrier, coordinate_motion<T> &c) {
  screw<T> turned;
  algebra<T>::cross_ss(&carrier, &c.S, &turned); // a'_λ × S
  algebra<T>::xpy_ss(&turned, &c.acceleration_by_q);
}
template <class T>
KSL_LANES void accelerate(const screw<T> &carrier, const coscrew<T> &wrench, subtree_dynamics<T> &d) {
  coscrew<T> f;
  algebra<T>::product_Ms(&d.I, &carrier, &f); // I a'_λ
  algebra<T>::xpy_cc(&wrench, &f);
  algebra<T>::xpy_cc(&f, &d.f);
}

/// Sets the accelerations that the joint accelerations a add to the bodies: a' = a'_λ + Σ S a.
template <class T> KSL_LANES void accelerate_bodies(const model_view<scalar_of<T>> &model,
                                                    const forward_dynamics_derivatives_workspace<T> &w, const T *a) {
  const wrench_derivatives_workspace<T> &d = w.derivatives.wrenches;
  const vec3<T> zero = {T(0), T(0), T(0)};
  w.acceleration[0] = {zero, zero}, w.wrench[0] = {zero, zero};
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    const screw<T> carrier = w.acceleration[b.parent];
    screw<T> own = carrier;
    for (int k = b.v_index; k < b.v_index + b.nv; ++k) {
      const screw<T> S = d.coordinate.template part<screw, T>(k);
      algebra<T>::axpy_ss(a[k], &S, &own);
      if constexpr (is_number<T>)
        w.change.template set_part<screw, T>(k, carrier);
    }
    w.acceleration[i] = own;
    w.wrench[i] = {zero, zero};
    if constexpr (!is_number<T>) {
      read_again();
      for (int k = b.v_index; k < b.v_index + b.nv; ++k)
        accelerate(w.acceleration[b.parent], d.coordinate.at(k));
    }
  }
}

/// Adds what the joint accelerations a contribute (3) to the quantities without them, and sets the derivatives of inverse dynamics.
template <class T>
KSL_LANES void accelerate(const model_view<scalar_of<T>> &model, const forward_dynamics_derivatives_workspace<T> &w,
                          const T *a, const tau_derivative_matrices<T, false> &dtau) {
  using A = algebra<T>;
  const wrench_derivatives_workspace<T> &d = w.derivatives.wrenches;
  w.change.clear_beyond(model.nv);
  accelerate_bodies(model, w, a);
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    coscrew<T> f = w.wrench[i];
    for (int k = b.v_index; k < b.v_index + b.nv; ++k) {
      const coscrew<T> momentum = d.derivative.template part<coscrew, T, 12>(k);
      A::axpy_cc(a[k], &momentum, &f);
    }
    A::xpy_cc(&f, &w.wrench[b.parent]);
    if constexpr (is_number<T>) {
      for (int k = b.v_index; k < b.v_index + b.nv; ++k)
        w.change.template set_part<coscrew, T, 6>(k, f);
    } else {
      subtree_dynamics<T> &subtree = d.subtree.at(b.v_index + b.nv - 1);
      w.wrench[i] = f;
      read_again();
      accelerate(w.acceleration[b.parent], w.wrench[i], subtree);
      read_again();
      for (int k = b.v_index; k < b.v_index + b.nv; ++k) {
        set_derivative(subtree, d.coordinate.at(k), d.derivative.at(k));
        set_elements(model, d, i, k, dtau);
      }
    }
  }
  if constexpr (is_number<T>) {
    using P = native_pack<T>;
    for (int k = 0; k < model.nv; k += native_lanes<T>) {
      auto c = d.coordinate.template get<P>(k);
      auto subtree = d.subtree.template get<P>(k);
      const auto change = w.change.template get<P>(k);
      accelerate(change.carrier, c);
      accelerate(change.carrier, change.wrench, subtree);
      d.coordinate.template set_part<screw, P, 12>(k, c.acceleration_by_q);
      d.derivative.template set<P>(k, derivative_of(subtree, c, d.derivative.template part<coscrew, P, 12>(k)));
    }
    set_rows(model, w.derivatives, dtau);
  }
}

/// a = W x for a symmetric W, whose rows begin at distances of `pitch`.  With plain numbers, several elements of a are in lanes.
/// Since W = M⁻¹ is a result anyway, this takes a fraction of the time of substitutions with the factors of M.
template <class T> KSL_LANES void multiply_symmetric(const T *W, index pitch, const T *x, index n, T *a) {
  using P = lanes_of_coordinates<T>;
  for (index i = 0; i < n; i += static_cast<index>(sizeof(P) / sizeof(T))) {
    P sum(T(0));
    for (index k = 0; k < n; ++k) {
      P w;
      body_lanes::read(W + k * pitch + i, w);
      sum = sum + w * P(x[k]);
    }
    if constexpr (is_number<T>)
      store_first<T>(sum, a + i, static_cast<int>(n - i));
    else
      a[i] = sum;
  }
}

/// Computes a block of both products −W X and −W Y: the rows [row, row + rows), and from `column` on as many columns as P has lanes.
/// Sums are over the related coordinates only (list_related).  The rows of W begin at distances of `pitch`; its columns are read as rows,
/// since it is symmetric.
template <class P, int rows, class T>
KSL_LANES void multiply_related(const T *W, index pitch, const T *X, const T *Y, index n, index row, index column,
                                const int *related, index terms, T *X_out, T *Y_out) {
  P x_sum[rows], y_sum[rows];
  for (int b = 0; b < rows; ++b)
    x_sum[b] = y_sum[b] = P(T(0));
  for (index t = 0; t < terms; ++t) {
    const index k = related[t], at = k * n;
    const T *const w_k = W + (is_number<T> ? k * pitch : at) + row;
    P x, y;
    body_lanes::read(X + at + column, x);
    body_lanes::read(Y + at + column, y);
    for (int b = 0; b < rows; ++b) {
      const P w(w_k[b]);
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

/// A group of columns: the first one, and the coordinates that are related to any of them.
struct related_columns {
  index column, terms;
  const int *related;
};

/// Computes all rows of a few groups of columns; a group has as many columns as P has lanes.  Rows are taken in blocks of up to four:
/// a block stays in the nearest cache for all groups, and the sums of several rows hide each other's latency.
template <class P, class T>
KSL_LANES void multiply_columns(const T *W, index pitch, const T *X, const T *Y, index n,
                                const related_columns *columns, index groups, T *X_out, T *Y_out) {
  const auto multiply = [&](auto rows, index row)
                            KSL_INLINED {
    for (index g = 0; g < groups; ++g)
      multiply_related<P, rows>(W, pitch, X, Y, n, row, columns[g].column, columns[g].related, columns[g].terms, X_out,
                                Y_out);
  };
  index row = 0;
  for (; row + 4 <= n; row += 4)
    multiply(coordinate_number<4>{}, row);
  if (row + 2 <= n) {
    multiply(coordinate_number<2>{}, row);
    row += 2;
  }
  if (row < n)
    multiply(coordinate_number<1>{}, row);
}

/// Two coordinates are related if one carries the other, or if they are of the same joint.  This lists, in ascending order, the
/// coordinates that are related to any of the columns [column, end), and returns how many there are.
template <class S> KSL_LANES index list_related(const model_view<S> &model, index column, index end, int *related) {
  index terms = 0,
        carried =
            0; // carried: where the subtrees of the columns end; a later body that begins before it is in one of them
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

/// The products −W X and −W Y, where an element of X or Y is zero unless its row and its column are related.  Leaving out these zeros
/// doesn't change the sums, which begin with +0.  With plain numbers, columns are in lanes.
template <class T>
void negative_products(const model_view<scalar_of<T>> &model, const array_of<int> &related, const T *W, index pitch,
                       const T *X, const T *Y, T *X_out, T *Y_out) {
  using P = lanes_of_coordinates<T>;
  constexpr index lanes = static_cast<index>(sizeof(P) / sizeof(T));
  const index n = model.nv;
  related_columns columns[column_groups] = {};
  for (index column = 0; column < n;) {
    index groups = 0;
    for (; column < n && groups < (is_number<T> ? 1 : column_groups); column += lanes, ++groups) {
      int *const list = &related[groups * n];
      columns[groups] = {column, list_related(model, column, column + lanes, list), list};
    }
    multiply_columns<P>(W, pitch, X, Y, n, columns, groups, X_out, Y_out);
  }
}

/// The derivatives of a = forward_dynamics(q, v, tau), each (nv, nv), row-major: with respect to q along q ⊕ s e_k with v and tau
/// held componentwise, to v, and to tau, which is M⁻¹.  External wrenches are held in the axes in which they are given, those of
/// their links, which move, or of the world.  q (nq), v and tau (nv).  O(nv² × depth).
template <class T>
void forward_dynamics_derivatives(const model_view<scalar_of<T>> &model,
                                  const forward_dynamics_derivatives_workspace<T> &w, const T *q, const T *v,
                                  const T *tau, const external_wrenches<T> &external, T *da_dq, T *da_dv, T *da_dtau) {
  const index n = model.nv;
  const inverse_dynamics_derivatives_workspace<T> &d = w.derivatives;
  T *const by_q = &w.dtau[0], *const by_v = by_q + n * n, *const a = &w.a[0], *const rest = &w.rest[0];
  for (index k = 0; k < n; ++k)
    a[k] = T(0);
  forward_motions(model, d.wrenches, q, v, a, external); // a is zero here
  sum_subtrees<false>(model, d.wrenches);
  set_momenta(model, d.wrenches, tau, rest); // (2)
  set_mass_rows(model, d, w.factor.rows);
  if (model.physics)
    add_physics(model, w.factor.rows, q, v, rest);
  factorise(model, w.factor);
  const T *W = da_dtau;
  index pitch = n;
  if constexpr (is_number<T>) {
    invert_factorised(model, w.factor, w.W);
    w.W.store(da_dtau);
    W = w.W[0], pitch = w.W.pitch();
  } else {
    invert_factorised(model, w.factor, da_dtau);
  }
  multiply_symmetric(W, pitch, rest, n, a);                                           // a = M⁻¹ (tau − bias)
  accelerate(model, w, a, tau_derivative_matrices<T, false>{by_q, by_v, nullptr, n}); // (3)
  if (external.axes == expressed_in::world)
    add_turning_of_external(model, d.wrenches, external, by_q);
  if (model.physics)
    add_physics_derivatives(model, v, by_q, by_v, static_cast<T *>(nullptr));
  negative_products(model, w.related, W, pitch, by_q, by_v, da_dq, da_dv); // (1)
}

} // namespace KSL_ISA
} // namespace ksl
