// KSL: the first derivatives of inverse dynamics.
//
// Singh, Russell, Wensing, "Efficient Analytical Derivatives of Rigid-Body Dynamics Using Spatial Vector Algebra", IEEE Robotics and
// Automation Letters 7(2), 2022.  The effort of coordinate i is τ_i = S_i · f, f being the wrench through its joint.  It changes with
// coordinate k only if one of the two carries the other.
//
// If i carries k, then f changes as the wrench through joint k does, and S_i stays as it is.  With ∂f_k from (3) of
// wrench_derivatives.hpp,
//
//     ∂τ_i/∂q_k = S_i · ∂f_k/∂q_k,      and likewise by v_k and by a_k.                                           (1)
//
// If k carries i, or both are of the same joint, then all bodies beyond joint i see the motion that k adds.  With I and B summed
// over the subtree of joint i,
//
//     ∂τ_i/∂q_k = S_i · (2 B Ψ̇_k + I Ψ̈_k),   ∂τ_i/∂v_k = S_i · (2 B S_k + I (Ψ̇_k + Ṡ_k)),   ∂τ_i/∂a_k = S_i · I S_k.  (2)
//
// A position also turns S_i and f by S_k.  That changes τ_i by (S_k × S_i) · f + S_i · (S_k ×* f) = 0.
//
// Each element is a product of six-vectors of two coordinates.  O(bodies × depth), besides writing 3 nv² numbers.
#pragma once

#include "ksl/engine/algorithms/derivatives/held_in_world.hpp"
#include "ksl/engine/algorithms/derivatives/wrench_derivatives.hpp"
#include "ksl/engine/model/joint_physics.hpp"
#include "ksl/engine/steps/symmetric_matrix.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct inverse_dynamics_derivatives_workspace {
  wrench_derivatives_workspace<T> wrenches;
  array_of<int> depth;           ///< index of the last run of each body; this and the runs with plain numbers only
  array_of<coordinate_run> runs; ///< the coordinates that carry the body which is visited, from the base on

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    wrenches.lay_out(memory, model);
    memory.lay_out(is_number<T> ? model.bodies : 0, depth, runs);
  }
};

/// An element of each of the three derivatives of tau: by q, by v and by a.
template <class T> struct tau_derivatives { T by_q, by_v, by_a; };

/// The elements (1): how the effort of a coordinate with the twist S changes with a coordinate that it carries.
template <class T> KSL_LANES tau_derivatives<T> by_carried(const screw<T> &S, const wrench_derivative<T> &carried) {
  using A = algebra<T>;
  return {A::dot_cs(&carried.by_q, &S), A::dot_cs(&carried.by_v, &S), A::dot_cs(&carried.by_a, &S)};
}

/// The elements (2): how the effort of coordinate `own` changes with a coordinate that carries it or is of the same joint.  S_i · 2 B x
/// is (2 Bᵀ S_i) · x, whose linear half is zero.
template <class T>
KSL_LANES tau_derivatives<T> by_carrier(const coscrew<T> &by_a, const vec3<T> &turn,
                                        const coordinate_motion<T> &carrier) {
  using A = algebra<T>;
  return {A::dot_vv(&turn, &carrier.velocity_by_q.ang) + A::dot_cs(&by_a, &carrier.acceleration_by_q),
          A::dot_vv(&turn, &carrier.S.ang) + A::dot_cs(&by_a, &carrier.acceleration_by_v),
          A::dot_cs(&by_a, &carrier.S)};
}
template <class T>
KSL_LANES tau_derivatives<T> by_carrier(const wrench_derivative<T> &own, const coordinate_motion<T> &carrier) {
  return by_carrier(own.by_a, own.turn, carrier);
}

/// The matrices (nv, nv), row-major, that elements are written to: all three, or only those by q and by v.
template <class T, bool three = true> struct tau_derivative_matrices {
  T *by_q, *by_v, *by_a;
  index n;

  KSL_LANES void set(index row, index column, const tau_derivatives<T> &x) const {
    const index at = row * n + column;
    by_q[at] = x.by_q, by_v[at] = x.by_v;
    if constexpr (three)
      by_a[at] = x.by_a;
  }
  /// Sets as many columns as P has lanes.  Those beyond the end of a row are written over by the next row; nothing is written
  /// beyond the end of the matrix.
  template <class P> KSL_LANES void set_columns(index row, index column, const tau_derivatives<P> &x) const {
    const index at = row * n + column, left = n * n - at;
    if (left >= native_lanes<T>) [[likely]] {
      body_lanes::write(x.by_q, by_q + at);
      body_lanes::write(x.by_v, by_v + at);
      if constexpr (three)
        body_lanes::write(x.by_a, by_a + at);
    } else {
      store_first<T>(x.by_q, by_q + at, static_cast<int>(left));
      store_first<T>(x.by_v, by_v + at, static_cast<int>(left));
      if constexpr (three)
        store_first<T>(x.by_a, by_a + at, static_cast<int>(left));
    }
  }
  void clear_all() const {
    for (index k = 0; k < n * n; ++k)
      by_q[k] = by_v[k] = by_a[k] = T(0);
  }
};

/// Changes the list of runs to that of body i, and returns how many runs it has.  Bodies must be visited in order: the list begins
/// with that of the parent.
template <class T> KSL_LANES int extend_runs(const model_view<scalar_of<T>> &model,
                                             const inverse_dynamics_derivatives_workspace<T> &w, int i) {
  const body<scalar_of<T>> &b = model.body[i];
  const int end = b.v_index + b.nv;
  int depth = 0;
  if (b.parent > 0) {
    const body<scalar_of<T>> &carrier = model.body[b.parent];
    depth = w.depth[b.parent];
    w.runs[depth].end = carrier.v_index + carrier.nv; // another child may have extended it
    if (b.parent == i - 1)
      w.runs[depth].end = end;
    else
      w.runs[++depth] = {b.v_index, end};
  } else {
    w.runs[0] = {b.v_index, end};
  }
  w.depth[i] = depth;
  return depth + 1;
}

/// Sets row `row` of the matrices, a coordinate of body b, with columns in the lanes of registers of plain numbers.  From left to
/// right the columns are
/// - the coordinates that carry the row's, and those of its own joint: (2), in runs with zeros between them;
/// - the coordinates that it carries: (1);
/// - zeros.
template <class T, bool three>
KSL_LANES void set_row(const body<T> &b, const inverse_dynamics_derivatives_workspace<T> &w, int runs, int row,
                       const tau_derivative_matrices<T, three> &out) {
  using P = native_pack<T>;
  constexpr int lanes = native_lanes<T>;
  const wrench_derivatives_workspace<T> &d = w.wrenches;
  const tau_derivatives<P> none = {P(T(0)), P(T(0)), P(T(0))};
  const int n = static_cast<int>(out.n);
  int k = 0;
  for (int r = 0; r < runs; ++r) {
    const coordinate_run run = w.runs[r];
    for (; k < run.first; k += lanes)
      out.set_columns(row, k, none);
    for (k = run.first; k < run.end; k += lanes) {
      const wrench_derivative<P> own = d.derivative.template in_all_lanes<P>(row);
      out.set_columns(row, k, by_carrier(own, d.coordinate.template get<P>(k)));
    }
    k = run.end;
  }
  const auto S = in_all_lanes<P, screw>(d.coordinate.template part<screw, T>(row));
  for (; k < b.v_end; k += lanes)
    out.set_columns(row, k, by_carried(S, d.derivative.template get<P>(k)));
  for (k = b.v_end; k < n; k += lanes)
    out.set_columns(row, k, none);
}

template <class T, bool three>
KSL_LANES void set_rows(const model_view<T> &model, const inverse_dynamics_derivatives_workspace<T> &w,
                        const tau_derivative_matrices<T, three> &out) {
  for (int i = 1; i < model.bodies; ++i) {
    const body<T> &b = model.body[i];
    const int runs = extend_runs<T>(model, w, i);
    for (int row = b.v_index; row < b.v_index + b.nv; ++row)
      set_row(b, w, runs, row, out);
  }
}

/// Sets the elements of coordinate k of body i with the coordinates that carry it and those of its joint, in its row (2) and in its
/// column (1).  How the wrench changes with k is in d.derivative.  A call of its own: what the loops need then is all that lives in
/// registers.
template <class T, bool three>
KSL_NOT_INLINED void set_elements(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &d,
                                  int i, int k, const tau_derivative_matrices<T, three> &matrices) {
  const tau_derivative_matrices<T, three> out = matrices;
  const coordinate_motion<T> *const coordinate = &d.coordinate.at(0);
  const wrench_derivative<T> &own = d.derivative.at(k);
  const index n = out.n, row = k * n, joint = model.body[i].v_index;
  for_carriers(model, i, [&](index first, index end) KSL_INLINED {
    const coscrew<T> by_a = own.by_a;
    const vec3<T> turn = own.turn;
    for (index m = first; m < end; ++m)
      out.set(k, m, by_carrier(by_a, turn, coordinate[m]));
    const coscrew<T> by_q = own.by_q, by_v = own.by_v;
    for (index m = first, column = m * n + k; m < end && m < joint; ++m, column += n) {
      const screw<T> S = coordinate[m].S;
      out.by_q[column] = algebra<T>::dot_cs(&by_q, &S), out.by_v[column] = algebra<T>::dot_cs(&by_v, &S);
      if constexpr (three)
        out.by_a[column] = out.by_a[row + m]; // both are S_m · I S_k
    }
  });
}

/// Sets the elements of all coordinates of body i's joint, and adds the dynamics of its subtree to its parent's.
template <class T>
KSL_LANES void set_joint(const model_view<scalar_of<T>> &model, const inverse_dynamics_derivatives_workspace<T> &w,
                         int i, const tau_derivative_matrices<T> &out) {
  const wrench_derivatives_workspace<T> &d = w.wrenches;
  const body<scalar_of<T>> &b = model.body[i];
  const int own_end = b.v_index + b.nv;
  const auto &subtree = d.subtree.at(own_end - 1);
  for (int k = b.v_index; k < own_end; ++k) {
    wrench_derivative<T> &own = d.derivative.at(k);
    algebra<T>::product_Ms(&subtree.I, &d.coordinate.at(k).S, &own.by_a);
    set_derivative(subtree, d.coordinate.at(k), own);
    set_elements(model, d, i, k, out);
  }
  if (b.parent > 0)
    add_dynamics(subtree, d.subtree.at(last_coordinate(model, b.parent)));
}

/// The derivatives of inverse_dynamics at q (nq), v and a (nv), without the zeros that follow from the shape of the tree unless T
/// is a plain number.
template <class T>
void elements_of_inverse_dynamics_derivatives(const model_view<scalar_of<T>> &model,
                                              const inverse_dynamics_derivatives_workspace<T> &w, const T *q,
                                              const T *v, const T *a, const external_wrenches<T> &external, T *dtau_dq,
                                              T *dtau_dv, T *dtau_da) {
  forward_motions(model, w.wrenches, q, v, a, external);
  const tau_derivative_matrices<T> out = {dtau_dq, dtau_dv, dtau_da, model.nv};
  if constexpr (is_number<T>) {
    sum_subtrees(model, w.wrenches);
    set_rows(model, w, out);
  } else {
    for (int i = model.bodies - 1; i > 0; --i)
      set_joint(model, w, i, out);
  }
  if (external.axes == expressed_in::world)
    add_turning_of_external(model, w.wrenches, external, dtau_dq);
  if (model.physics)
    add_physics_derivatives(model, v, dtau_dq, dtau_dv, dtau_da);
}

/// The derivatives of tau = inverse_dynamics(q, v, a), each (nv, nv), row-major: with respect to q along q ⊕ s e_k with v and a
/// held componentwise, to v, and to a, which is the mass matrix.  External wrenches are held in the axes in which they
/// are given, those of their links, which move, or of the world.  q (nq), v and a (nv).
template <class T>
void inverse_dynamics_derivatives(const model_view<scalar_of<T>> &model,
                                  const inverse_dynamics_derivatives_workspace<T> &w, const T *q, const T *v,
                                  const T *a, const external_wrenches<T> &external, T *dtau_dq, T *dtau_dv,
                                  T *dtau_da) {
  if constexpr (!is_number<T>)
    tau_derivative_matrices<T>{dtau_dq, dtau_dv, dtau_da, model.nv}.clear_all();
  elements_of_inverse_dynamics_derivatives(model, w, q, v, a, external, dtau_dq, dtau_dv, dtau_da);
}

} // namespace KSL_ISA
} // namespace ksl
