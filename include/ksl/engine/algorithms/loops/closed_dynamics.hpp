// KSL: dynamics of mechanisms with loops, by the plan of the model (loop_view.hpp).  src/engine/loops/closed_state.hpp has the equations;
// there, states are computed that have NaN here.
#pragma once

#include "ksl/engine/algorithms/inverse/inverse_dynamics.hpp"
#include "ksl/engine/algorithms/loops/loop_equations.hpp"
#include "ksl/engine/algorithms/mass/mass_matrix_factor.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct closed_inverse_dynamics_workspace {
  loop_equations_workspace<T> equations;
  inverse_dynamics_workspace<T> inverse;
  array_of<T> tree, multiplier, projected, steady;
  array_of<T> shares; ///< (freedoms, drives), where drives are more

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    equations.lay_out(memory, model);
    inverse.lay_out(memory, model);
    inverse.pose = equations.world.pose;
    lay_out_efforts(memory, model);
  }
  /// All but the equations and what the tree needs.
  KSL_LANES void lay_out_efforts(arena &memory, const model_view<scalar_of<T>> &model) {
    tree.lay_out(memory, model.nv), steady.lay_out(memory, model.nv);
    multiplier.lay_out(memory, model.loops ? model.loops->rows : 0);
    projected.lay_out(memory, padded_columns<T>(model.nv + 1));
    shares.lay_out(memory, model.loops ? model.loops->freedoms * model.loops->drives : 0);
  }
};

/// λ ← L⁻ᵀ λ with K = L U, where λ has what belongs to the equations of pivots, and is given for those that follow from others.
template <class T>
KSL_LANES void back_through_lower(const loop_view<scalar_of<T>> &loops, const loop_equations_workspace<T> &w,
                                  T *lambda) {
  for (int k = loops.pivots - 1; k >= 0; --k) {
    const loop_pivot &p = loops.pivot[k];
    T sum = lambda[p.row];
    for (int i = p.rows_begin; i < p.rows_end; ++i)
      sum = sum - w.lower(loops.list[i], k) * lambda[loops.list[i]];
    lambda[p.row] = sum;
  }
}

/// y (nv) ← its product with Gᵀ, at the independent coordinates.  What is left in w.multiplier makes multipliers of y at the dependent coordinates
/// by back_through_lower.
///
/// With K = L U, Kᵀ λ = y at dependent coordinates: Uᵀ z of these first; what Uᵀ z has at the independent ones is taken off y there.  That needs
/// no element of G.
template <class T>
KSL_LANES void project_efforts(const model_view<scalar_of<T>> &model, const closed_inverse_dynamics_workspace<T> &w,
                               T *y) {
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  T *const lambda = &w.multiplier[0], *const projected = &w.projected[0];
  for (int i = 0; i < loops.rows; ++i) // equations that follow from others have no multiplier
    lambda[i] = T(S(0));
  for (int j = 0; j < padded_columns<T>(model.nv + 1); ++j)
    projected[j] = j >= loops.pivots && j < model.nv ? y[loops.independent[j - loops.pivots]] : T(S(0));
  for (int k = 0; k < loops.pivots; ++k) {
    const loop_pivot &p = loops.pivot[k];
    const T *const row = w.equations.row(p.row);
    const T z = (y[p.column] + lambda[p.row]) * w.equations.lower(p.row, k);
    lambda[p.row] = z;
    for (int i = p.later_begin; i < p.later_end; ++i) {
      const int step = loops.list[i], later = loops.pivot[step].row;
      lambda[later] = lambda[later] - row[step] * z;
    }
    const int first = p.columns_begin + p.later_end - p.later_begin;
    subtract_columns(z, row, projected, loops.list + first, p.columns_end - first, loops.pivots, model.nv);
  }
  for (int j = 0; j < loops.freedoms; ++j)
    y[loops.independent[j]] = projected[loops.pivots + j];
}

/// Element (v, j) of G, by which all coordinates follow from the independent ones.
template <class T> KSL_LANES T element_of_G(const loop_view<scalar_of<T>> &loops, const loop_equations_workspace<T> &w,
                                            int v, int j) {
  const int place = loops.place[v];
  if (place >= 0)
    return T(scalar_of<T>(place == j ? 1 : 0));
  return -w.solved[(-1 - place) * (loops.freedoms + 1) + j];
}

/// Efforts tau of drives that are more than the freedoms: those with Gᵀ τ = wanted (freedoms) whose weighted sum of squares is least.  Gram and
/// Schmidt's method on the rows of Gᵀ.  Replaces `wanted`.  Returns NaN where drives nearly leave a freedom, else 0.
template <class T>
KSL_LANES T share_efforts(const loop_view<scalar_of<T>> &loops, const closed_inverse_dynamics_workspace<T> &w,
                          T *wanted, T *tau) {
  using S = scalar_of<T>;
  const int n = loops.drives;
  T *const shares = &w.shares[0];
  T fault(S(0));
  const auto product = [n](const T *x, const T *y) KSL_INLINED {
    T sum = x[0] * y[0];
    for (int d = 1; d < n; ++d)
      sum = sum + x[d] * y[d];
    return sum;
  };
  for (int j = 0; j < loops.freedoms; ++j) {
    T *const g = shares + j * n;
    T largest(S(0)); // of numbers whose terms are lengths: what drives move of a freedom may be rounding
    for (int d = 0; d < n; ++d) {
      const int drive = loops.drive[d];
      const T x = element_of_G(loops, w.equations, drive, j);
      const T scaled = math<T>::fabs(x) * T(loops.column_scale[loops.independent[j]] / loops.column_scale[drive]);
      largest = math<T>::select(scaled > largest, scaled, largest);
      g[d] = x * T(loops.drive_scale[d]);
    }
    fault = fault + fault_beyond(T(least_pivot<S>()), largest);
    const T whole = product(g, g);
    for (int k = 0; k < j; ++k) {
      const T *const earlier = shares + k * n;
      const T along = product(g, earlier);
      for (int d = 0; d < n; ++d)
        g[d] = g[d] - along * earlier[d];
      wanted[j] = wanted[j] - along * wanted[k];
    }
    const T left = product(g, g);
    fault = fault + fault_beyond(math<T>::select(left > T(least_share<S>()) * whole, T(S(0)), T(S(1))), T(S(0.5)));
    const T inverse = T(S(1)) / math<T>::sqrt(left);
    for (int d = 0; d < n; ++d)
      g[d] = g[d] * inverse;
    wanted[j] = wanted[j] * inverse;
  }
  for (int d = 0; d < n; ++d) {
    T sum(S(0));
    for (int j = 0; j < loops.freedoms; ++j)
      sum = sum + wanted[j] * shares[j * n + d];
    tau[loops.drive[d]] = sum * T(loops.drive_scale[d]);
  }
  return fault;
}

/// Sets efforts at coordinates of idle bodies, drives whose scale is negative, to zero.  A fault where they are more than rounding beside those
/// of the tree (nv): no drive has power along the motion of such a body.
template <class T> KSL_LANES void leave_idle_bodies(const model_view<scalar_of<T>> &model, const T *tree, T *tau,
                                                    T &fault) {
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  T largest(S(0));
  for (int d = 0; d < loops.drives; ++d) {
    const int v = loops.drive[d];
    if (loops.drive_scale[d] > S(0))
      continue;
    for (int i = 0; i < model.nv; ++i) {
      const T force = math<T>::fabs(tree[i]) * T(loops.column_scale[i]);
      largest = math<T>::select(force > largest, force, largest);
    }
    fault = fault + fault_beyond(tau[v], largest * T(loops.tolerance / loops.column_scale[v]));
    tau[v] = T(S(0));
  }
}

/// Accelerations at which the independent coordinates have none, after solve_by_plan.
template <class T>
KSL_LANES void steady_accelerations(const loop_view<scalar_of<T>> &loops, const loop_equations_workspace<T> &w, T *a) {
  const int f = loops.freedoms;
  for (int j = 0; j < f; ++j)
    a[loops.independent[j]] = T(scalar_of<T>(0));
  for (int k = 0; k < loops.pivots; ++k)
    a[loops.pivot[k].column] = w.solved[k * (f + 1) + f];
}

/// Efforts tau (nv) of the drives.  What is left in w.multiplier makes multipliers by back_through_lower.
template <class T>
void closed_inverse_dynamics(const model_view<scalar_of<T>> &model, const closed_inverse_dynamics_workspace<T> &given,
                             const T *q, const T *v, const T *a, const external_wrenches<T> &external, T *tau) {
  using S = scalar_of<T>;
  closed_inverse_dynamics_workspace<T> w = given;
  const loop_view<S> &loops = *model.loops;
  T *const tree = &w.tree[0];
  if (loops.steady) {
    set_loop_equations<true>(model, w.equations, q, v);
    eliminate_by_plan<true>(model, w.equations);
    solve_by_plan(model, w.equations);
    steady_accelerations(loops, w.equations, &w.steady[0]);
    a = &w.steady[0];
  } else {
    set_loop_equations<false>(model, w.equations, q, v);
    eliminate_by_plan<false>(model, w.equations);
  }
  inverse_dynamics(with_known_sines(model), w.inverse, q, v, a, external, tree);
  if (!loops.steady)
    check_accelerations(model, w.equations, w.inverse.motion, a);
  for (int i = 0; i < model.nv; ++i)
    tau[i] = w.equations.fault;
  if (loops.drives == 0) { // the independent coordinates are those of the drives
    project_efforts(model, w, tree);
    for (int j = 0; j < loops.freedoms; ++j)
      tau[loops.independent[j]] = tree[loops.independent[j]] + w.equations.fault;
    return;
  }
  T *const whole = &w.steady[0]; // free, since drives that are more are not the independent coordinates
  for (int i = 0; i < model.nv; ++i)
    whole[i] = tree[i];
  project_efforts(model, w, tree);
  solve_by_plan(model, w.equations);
  T *const wanted = &w.projected[loops.pivots];
  T fault = share_efforts(loops, w, wanted, tau);
  leave_idle_bodies(model, whole, tau, fault);
  for (int i = 0; i < model.nv; ++i)
    whole[i] = whole[i] - tau[i], tau[i] = tau[i] + fault;
  for (int d = 0; d < loops.drives; ++d)
    tau[loops.drive[d]] = tau[loops.drive[d]] + w.equations.fault;
  project_efforts(model, w, whole);
}

template <class T> struct closed_forward_dynamics_workspace {
  loop_equations_workspace<T> equations;
  inverse_dynamics_workspace<T> inverse;
  mass_matrix_workspace<T> mass;
  tree_rows<T> rows;
  array_of<T> a0, tree, MG, H, r;
  /// what freedoms' inertias are made of: the sum of the inertias of coordinates, times G², before they cancel
  array_of<T> whole;

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    const int f = model.loops ? model.loops->freedoms : 0;
    equations.lay_out(memory, model);
    inverse.lay_out(memory, model);
    mass.lay_out(memory, model);
    inverse.pose = mass.pose = equations.world.pose;
    rows.lay_out(memory, model);
    a0.lay_out(memory, model.nv), tree.lay_out(memory, model.nv);
    MG.lay_out(memory, model.nv * f), H.lay_out(memory, f * f), r.lay_out(memory, f);
    whole.lay_out(memory, f);
  }
};

/// row += x G_v, the row of G of one coordinate.
template <class T> KSL_LANES void add_row_of_G(const loop_view<scalar_of<T>> &loops,
                                               const loop_equations_workspace<T> &w, int v, const T &x, T *row) {
  const int place = loops.place[v], f = loops.freedoms;
  if (place >= 0) {
    row[place] = row[place] + x;
    return;
  }
  const T *const from = &w.solved[(-1 - place) * (f + 1)];
  for (int j = 0; j < f; ++j)
    row[j] = row[j] - x * from[j];
}

/// H = Gᵀ M G, the lower triangle, from the elements of M that the tree has; and `whole`.
template <class T> KSL_LANES void project_inertia(const model_view<scalar_of<T>> &model,
                                                  const closed_forward_dynamics_workspace<T> &w) {
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  const int f = loops.freedoms;
  for (int i = 0; i < model.nv * f; ++i)
    w.MG[i] = T(S(0));
  for (int i = 0; i < f * f; ++i)
    w.H[i] = T(S(0));
  for (int j = 0; j < f; ++j)
    w.whole[j] = T(S(0));
  for (int i = 1; i < model.bodies; ++i)
    for (int c = 0; c < model.body[i].nv; ++c) {
      const int v = model.body[i].v_index + c;
      const T *const row = w.rows[v];
      const T own = row[model.body[i].ancestors + c];
      add_row_of_G(loops, w.equations, v, own, &w.MG[v * f]);
      if (const int place = loops.place[v]; place >= 0) {
        w.whole[place] = w.whole[place] + own;
      } else {
        const T *const g = &w.equations.solved[(-1 - place) * (f + 1)];
        for (int j = 0; j < f; ++j)
          w.whole[j] = w.whole[j] + own * g[j] * g[j];
      }
      for_each_ancestor(model, i, c, [&](index ancestor, index place) KSL_INLINED {
        add_row_of_G(loops, w.equations, static_cast<int>(ancestor), row[place], &w.MG[v * f]);
        add_row_of_G(loops, w.equations, v, row[place], &w.MG[ancestor * f]);
      });
    }
  for (int v = 0; v < model.nv; ++v) {
    const int place = loops.place[v];
    const T *const of = &w.MG[v * f];
    if (place >= 0) {
      for (int j = 0; j <= place; ++j)
        w.H[place * f + j] = w.H[place * f + j] + of[j];
      continue;
    }
    const T *const g = &w.equations.solved[(-1 - place) * (f + 1)];
    for (int i = 0; i < f; ++i)
      for (int j = 0; j <= i; ++j)
        w.H[i * f + j] = w.H[i * f + j] - g[i] * of[j];
  }
}

/// How much of `whole` a freedom's inertia must be, once the others have been taken off, so that it isn't rounding.
template <class S> inline S least_inertia() {
  return of_precision<S>(loop_tolerance::inertia, loop_tolerance::inertia_single);
}

/// r ← H⁻¹ r by the factors L D Lᵀ, which replace H.  NaN where a freedom moves no mass.
template <class T> KSL_LANES void solve_by_factors(T *H, const T *whole, T *r, int f, T &fault) {
  using S = scalar_of<T>;
  for (int k = 0; k < f; ++k) {
    T D = H[k * f + k], terms = whole[k];
    for (int j = 0; j < k; ++j)
      terms = terms + H[k * f + j] * H[k * f + j] * whole[j];
    for (int j = 0; j < k; ++j) // row k holds L_kj D_j until it is divided
      D = D - H[k * f + j] * H[k * f + j] * H[j * f + j];
    fault = fault + fault_beyond(math<T>::select(D > T(least_inertia<S>()) * terms, T(S(0)), T(S(1))), T(S(0.5)));
    const T inverse = T(S(1)) / D;
    H[k * f + k] = D;
    for (int i = k + 1; i < f; ++i) {
      T x = H[i * f + k];
      for (int j = 0; j < k; ++j)
        x = x - H[i * f + j] * H[j * f + j] * H[k * f + j];
      H[i * f + k] = x * inverse;
    }
  }
  for (int i = 0; i < f; ++i)
    for (int j = 0; j < i; ++j)
      r[i] = r[i] - H[i * f + j] * r[j];
  for (int i = f - 1; i >= 0; --i) {
    r[i] = r[i] / H[i * f + i];
    for (int j = i + 1; j < f; ++j)
      r[i] = r[i] - H[j * f + i] * r[j];
  }
}

/// Accelerations a (nv) under efforts tau (nv), gravity and external wrenches.
template <class T>
void closed_forward_dynamics(const model_view<scalar_of<T>> &model, const closed_forward_dynamics_workspace<T> &given,
                             const T *q, const T *v, const T *tau, const external_wrenches<T> &external, T *a) {
  using S = scalar_of<T>;
  closed_forward_dynamics_workspace<T> w = given;
  const loop_view<S> &loops = *model.loops;
  const int f = loops.freedoms;
  set_loop_equations<true>(model, w.equations, q, v);
  eliminate_by_plan<true>(model, w.equations);
  solve_by_plan(model, w.equations);
  T *const a0 = &w.a0[0], *const tree = &w.tree[0], *const r = &w.r[0];
  steady_accelerations(loops, w.equations, a0);
  const model_view<S> known = with_known_sines(model);
  inverse_dynamics(known, w.inverse, q, v, a0, external, tree);
  rows_of_mass_matrix(known, w.mass, w.rows, q);
  for (int j = 0; j < f; ++j)
    r[j] = T(S(0));
  for (int i = 0; i < model.nv; ++i)
    add_row_of_G(loops, w.equations, i, tau[i] - tree[i], r);
  project_inertia(model, w);
  solve_by_factors(&w.H[0], &w.whole[0], r, f, w.equations.fault);
  for (int i = 0; i < model.nv; ++i) {
    T sum = a0[i] + w.equations.fault;
    for (int j = 0; j < f; ++j)
      sum = sum + element_of_G(loops, w.equations, i, j) * r[j];
    a[i] = sum;
  }
}

} // namespace KSL_ISA
} // namespace ksl
