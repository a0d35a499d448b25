// Algorithms for models with followers that solve M x = y for several right-hand sides, or for a part of the coordinates: state by
// state, but for the derivatives of accelerations (algorithms.cpp).  M = Gᵀ M̂ G is dense, since a leader and its followers may be anywhere in
// the tree.
//
// With b = Gᵀ b̂ the efforts at accelerations of zero, o the coordinates whose accelerations are sought and g those whose are given:
//
//     derivatives         a = M⁻¹ (τ − b);   ∂a/∂q = −M⁻¹ ∂τ/∂q at this a, likewise by v;   ∂a/∂τ = M⁻¹
//     second derivatives  (1) of forward_dynamics_second_derivatives.hpp
//     hybrid              M_oo a_o = τ_o − (M_og a_g + b_o),   τ_g = M_gg a_g + b_g + M_go a_o
//     jump                M Δv = Gᵀ Ĵᵀ p of impulses p
//     operational space   Λ⁻¹ = J M⁻¹ Jᵀ,   bias −Λ x'' at the accelerations −M⁻¹ b,   pseudo-inverse of J: M⁻¹ Jᵀ Λ
//
// ∂τ of the projected mechanism is Gᵀ ∂τ̂ G: projections of the algorithms of trees have it.
#pragma once

#include "engine/mimic/mass_matrix.hpp"
#include "engine/mimic/projection.hpp"

#include "engine/kernels/algorithm_rows.hpp"
#include "ksl/engine/algorithms/operational_space/operational_space.hpp"

namespace ksl::mimic {

/// Is the algorithm one of those here, rather than of algorithms.cpp?
inline bool has_systems(mimic_by how) {
  switch (how) {
  case mimic_by::solution_derivatives:
  case mimic_by::solution_second_derivatives:
  case mimic_by::hybrid:
  case mimic_by::jump:
  case mimic_by::operational_inverse:
  case mimic_by::operational_inertia:
  case mimic_by::operational_space: return true;
  case mimic_by::projection:
  case mimic_by::solution:
  case mimic_by::product:
  case mimic_by::inverse:
  case mimic_by::upper_triangle:
  case mimic_by::refusal: return false;
  }
  __builtin_unreachable();
}

/// Is it one of the quantities of operational space, which are about frames?
inline bool is_operational(mimic_by how) {
  return how == mimic_by::operational_inverse || how == mimic_by::operational_inertia ||
         how == mimic_by::operational_space;
}

/// The model without gravity and without joint physics.
template <class S> model_view<S> weightless(model_view<S> view) {
  view.gravity = {S(0), S(0), S(0)};
  view.physics = nullptr;
  return view;
}

/// view: of the expanded mechanism.
template <class S> struct systems {
  const mimic_by what;
  const model &m;
  const model_view<S> view = m.view_in<S>();
  const coupling_view<S> coupling = m.coupling_in<S>();
  projection<S> inertia{rows::mass_matrix, m, view, coupling}, efforts{rows::inverse_dynamics, m, view, coupling};
  projection<S> derivatives{rows::inverse_dynamics_derivatives, m, view, coupling},
      second{rows::inverse_dynamics_second_derivatives, m, view, coupling};
  projection<S> columns{rows::jacobian, m, view, coupling}, rates{rows::frame_accelerations, m, view, coupling};
  projection<S> impulses{rows::inverse_dynamics, m, weightless<S>(view), coupling};

  std::size_t state_bytes(const extents &asked) const {
    arena measure;
    memory_of_state pieces;
    pieces.lay_out(measure, *this, asked);
    return measure.used();
  }

  void state(void *memory, const state_view<S> &given) const {
    arena pieces(memory);
    memory_of_state w;
    w.lay_out(pieces, *this, extents_of(m, given));
    std::fill_n(w.zero, m.nv(), S(0));
    run(inertia, w, given, w.M);
    switch (what) {
    case mimic_by::solution_derivatives: return set_derivatives(w, given);
    case mimic_by::solution_second_derivatives: return set_second_derivatives(w, given);
    case mimic_by::hybrid: return set_hybrid(w, given);
    case mimic_by::jump: return set_jump(w, given);
    default: return set_operational(w, given);
    }
  }

  /// The derivatives of the accelerations in the states [first, end).  All that is computed for the expanded mechanism runs in lanes, a few
  /// blocks of states at a time; the bits are those of single states.
  void derivatives_batch(const batch_view<S> &given, std::size_t first, std::size_t end, void *memory) const {
    const int nv = m.nv(), states = states_at_a_time();
    const std::ptrdiff_t matrix = static_cast<std::ptrdiff_t>(nv) * nv;
    arena pieces(memory);
    // of each part of states: bias b → a = M⁻¹ (τ − b), by factors in place of M; derivatives of efforts at this a, and M again as their third;
    // products
    auto [M, by_q, by_v, a, external, rest, part] = lay_out_derivatives(pieces, given);
    for (std::size_t k = first; k < end; k += static_cast<std::size_t>(states)) {
      const std::size_t n = std::min(end - k, static_cast<std::size_t>(states));
      part.n = n, part.external = external;
      part.q = rows_from(given.q, k), part.v = rows_from(given.v, k), part.a = {};
      for (int x = 0; x < given.external_n; ++x)
        external[x] = {given.external[x].link, rows_from(given.external[x].wrench, k)};
      part.result[0] = {a, nv};
      efforts.batch(part, 0, n, rest);
      part.result[0] = {M, matrix};
      inertia.batch(part, 0, n, rest);
      for (std::size_t i = 0; i < n; ++i)
        accelerate(M + static_cast<std::ptrdiff_t>(i) * matrix, given.tau.first ? row(given.tau, k + i) : nullptr,
                   a + static_cast<std::ptrdiff_t>(i) * nv);
      part.a = {a, nv}, part.result[0] = {by_q, matrix};
      derivatives.batch(part, 0, n, rest);
      for (std::size_t i = 0; i < n; ++i) {
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(i) * matrix;
        const auto wanted = [&](int r) { return given.result[r].first ? row(given.result[r], k + i) : nullptr; };
        set_products(M + at, by_q + at, by_v + at, wanted(0), wanted(1), wanted(2));
      }
    }
  }
  std::size_t derivatives_batch_bytes(const batch_view<S> &given) const {
    arena measure;
    lay_out_derivatives(measure, given);
    return measure.used();
  }

private:
  int states_at_a_time() const { return 4 * inertia.kernel.lanes; }

  struct memory_of_derivatives {
    S *M, *by_q, *by_v, *a; ///< of some states
    external_rows<S> *external;
    void *rest;
    batch_view<S> part; ///< these states
  };
  memory_of_derivatives lay_out_derivatives(arena &memory, const batch_view<S> &given) const {
    const std::ptrdiff_t states = states_at_a_time(), matrix = static_cast<std::ptrdiff_t>(m.nv()) * m.nv();
    memory_of_derivatives w = {};
    w.M = memory.take<S>(states * matrix), w.by_q = memory.take<S>(states * matrix);
    w.by_v = memory.take<S>(states * matrix), w.a = memory.take<S>(states * m.nv());
    w.external = memory.take<external_rows<S>>(given.external_n);
    batch_view<S> &part = w.part = given;
    part.tau = {}, part.result[0] = {w.by_q, matrix}, part.result[1] = {w.by_v, matrix}, part.result[2] = {w.M, matrix};
    w.rest = memory.take<std::byte>(static_cast<std::ptrdiff_t>(
        std::max({inertia.batch_bytes(part), efforts.batch_bytes(part), derivatives.batch_bytes(part)})));
    return w;
  }

  struct memory_of_state {
    S *M;               ///< (nv, nv)
    S *x, *zero;        ///< (nv)
    S *matrix;          ///< (nv, nv) of derivatives and of hybrid dynamics; by_q and by_v are two of them
    S *first;           ///< (3, nv, nv) first derivatives of the accelerations, where second ones are asked for
    S *J, *solved;      ///< (6 frames, nv) of frames, and the same rows times M⁻¹
    S *square, *pivots; ///< (6 frames, 6 frames), (4 × 6 frames)
    int *user;          ///< (expanded nv) which of the user's coordinates each coordinate is, or follows
    bool *is_given;     ///< (nv)
    void *rest;

    void lay_out(arena &memory, const systems &of, const extents &asked) {
      const int nv = of.m.nv(), all = of.m.view().nv;
      const bool frames = is_operational(of.what), hybrid = of.what == mimic_by::hybrid;
      const bool twice = of.what == mimic_by::solution_second_derivatives;
      const int rows = frames ? 6 * asked.links : 0;
      M = memory.take<S>(nv * nv), x = memory.take<S>(nv), zero = memory.take<S>(nv);
      matrix = memory.take<S>(frames ? 0 : 2 * nv * nv), first = memory.take<S>(twice ? 3 * nv * nv : 0);
      J = memory.take<S>(rows * nv), solved = memory.take<S>(rows * nv);
      square = memory.take<S>(rows * rows), pivots = memory.take<S>(4 * rows);
      user = memory.take<int>(hybrid ? all : 0), is_given = memory.take<bool>(hybrid ? nv : 0);
      std::size_t most = std::max(of.inertia.state_bytes(asked), of.efforts.state_bytes(asked));
      if (of.what == mimic_by::solution_derivatives || twice)
        most = std::max(most, of.derivatives.state_bytes(asked));
      if (twice)
        most = std::max(most, of.second.state_bytes(asked));
      if (frames)
        most = std::max({most, of.columns.state_bytes(asked), of.rates.state_bytes(asked)});
      rest = memory.take<std::byte>(static_cast<std::ptrdiff_t>(most));
    }
  };

  static void run(const projection<S> &p, const memory_of_state &w, state_view<S> s, S *out, S *second = nullptr,
                  S *third = nullptr) {
    s.result[0] = out, s.result[1] = second, s.result[2] = third;
    p.state(w.rest, s);
  }

  /// w.x = τ − (efforts at the accelerations a); without tau, minus these efforts.
  void missing_efforts(const memory_of_state &w, const state_view<S> &given, const S *a, const S *tau) const {
    state_view<S> s = given;
    s.a = a;
    run(efforts, w, s, w.x);
    for (int i = 0; i < m.nv(); ++i)
      w.x[i] = tau ? tau[i] - w.x[i] : -w.x[i];
  }

  /// x = M⁻¹ x by the factors of M, which replace M.  NaN if M is singular.
  void solve_in_place(S *M, S *x) const {
    const auto fault = ldlt(M, m.nv());
    solve(M, x, m.nv());
    mark(fault, x, m.nv());
  }

  /// a = M⁻¹ (τ − a), where a is the bias on entry.  M is replaced by its factors.
  void accelerate(S *M, const S *tau, S *a) const {
    for (int i = 0; i < m.nv(); ++i)
      a[i] = (tau ? tau[i] : S(0)) - a[i];
    solve_in_place(M, a);
  }

  /// The derivatives of a by q, v and τ: −M⁻¹ ∂τ, by (1) of forward_dynamics_derivatives.hpp, and M⁻¹, which replaces M.
  void set_products(S *M, const S *by_q, const S *by_v, S *da_dq, S *da_dv, S *da_dtau) const {
    const int nv = m.nv();
    mark(invert(M, nv), M, nv * nv);
    const S *const X[] = {by_q, by_v};
    S *const out[] = {da_dq, da_dv};
    for (int which = 0; which < 2; ++which)
      for (int i = 0; i < nv && out[which]; ++i) {
        S *const row_i = out[which] + i * nv;
        std::fill_n(row_i, nv, S(0));
        for (int j = 0; j < nv; ++j)
          for (int k = 0; k < nv; ++k)
            row_i[k] -= M[i * nv + j] * X[which][j * nv + k];
      }
    if (da_dtau)
      std::copy_n(M, nv * nv, da_dtau);
  }

  /// w.M has M on entry, its factors once a is known, M again as the derivative of efforts by accelerations, and M⁻¹ at the end.
  void set_derivatives(const memory_of_state &w, const state_view<S> &given) const {
    S *const by_q = w.matrix, *const by_v = w.matrix + m.nv() * m.nv();
    missing_efforts(w, given, w.zero, given.tau);
    solve_in_place(w.M, w.x);
    state_view<S> s = given;
    s.a = w.x;
    run(derivatives, w, s, by_q, by_v, w.M); // the last one is M again
    set_products(w.M, by_q, by_v, given.result[0], given.result[1], given.result[2]);
  }

  /// −M times the second derivatives of a, from those of inverse dynamics at the accelerations that solve the system, and then times −M⁻¹.  Results are
  /// (nv, nv, nv): a matrix over (k, m) for each effort i, so that what M⁻¹ combines is one matrix apart.  The equations
  /// are those of ksl/engine/algorithms/derivatives/forward_dynamics_second_derivatives.hpp, without zeros to leave out.
  void set_second_derivatives(const memory_of_state &w, const state_view<S> &given) const {
    const int nv = m.nv(), matrix = nv * nv;
    state_view<S> s = given;
    for (int which = 0; which < 3; ++which)
      s.result[which] = w.first + which * matrix;
    set_derivatives(w, s);
    s = given;
    s.a = w.x;
    // now w.first has a_q, a_v and M⁻¹, (nv, nv) each, and w.M is M⁻¹, too
    second.state(w.rest, s);
    for (int i = 0; i < nv; ++i)
      add_products(w, given.result[0] + i * matrix, given.result[2] + i * matrix, given.result[3] + i * matrix);
    for (int r = 0; r < 4; ++r)
      for (int at = 0; at < matrix; ++at) { // one of (k, m), for all i
        S *const X = given.result[r] + at;
        for (int i = 0; i < nv; ++i)
          w.x[i] = X[i * matrix];
        for (int i = 0; i < nv; ++i) {
          S sum = 0;
          for (int l = 0; l < nv; ++l)
            sum -= w.M[i * nv + l] * w.x[l];
          X[i * matrix] = sum;
        }
      }
  }

  /// Adds to the second derivatives of one effort, i, the terms with first derivatives of the accelerations.  On entry by_tau has
  /// dM_il/dq_k.
  ///
  ///     by_q += M_q a_q + (M_q a_q)ᵀ,   by_qv += M_q a_v,   by_tau = M_q M⁻¹,     (M_q x)_km = Σ_l ∂M_il/∂q_k x_lm
  void add_products(const memory_of_state &w, S *by_q, S *by_qv, S *by_tau) const {
    const int nv = m.nv(), matrix = nv * nv;
    S *const M = w.matrix, *const product = w.matrix + matrix;
    std::copy_n(by_tau, matrix, M);
    std::fill_n(by_tau, matrix, S(0));
    std::fill_n(product, matrix, S(0));
    S *const to[] = {product, by_qv, by_tau};
    for (int which = 0; which < 3; ++which)
      for (int l = 0; l < nv; ++l)
        for (int k = 0; k < nv; ++k)
          for (int c = 0; c < nv; ++c)
            to[which][k * nv + c] += M[l * nv + k] * w.first[which * matrix + l * nv + c];
    for (int k = 0; k < nv; ++k)
      for (int c = 0; c < nv; ++c)
        by_q[k * nv + c] += product[k * nv + c] + product[c * nv + k];
  }

  /// Finds the coordinates whose accelerations are given.  That of a follower is given if that of its leader is.
  void find_given(const memory_of_state &w, const link_list &links) const {
    for (int i = 0; i < coupling.nv; ++i)
      w.user[coupling.in_v[i]] = i, w.is_given[i] = false;
    for (int f = 0; f < coupling.followers; ++f)
      w.user[coupling.follower[f].v] = w.user[coupling.follower[f].leader_v];
    for (int k = 0; k < links.n; ++k) {
      const body<S> *b = &view.body[view.link[links.index[k]].body];
      // a universal joint is two bodies, whose coordinates follow each other; links are on the second
      for (int v = b->ends_universal ? b->v_index - 1 : b->v_index; v < b->v_index + b->nv; ++v)
        w.is_given[w.user[v]] = true;
    }
  }

  /// Hybrid dynamics.  With o the coordinates whose accelerations are not given: M_oo a_o = τ_o − (efforts at the given accelerations)_o.
  void set_hybrid(const memory_of_state &w, const state_view<S> &given) const {
    const int nv = m.nv();
    find_given(w, given.links);
    //     w.zero     accelerations with a_o = 0          w.matrix   [ M_oo (n, n), its factors; then τ (nv) │ from nv² on τ_o − …, then a_o (n) ]
    //     w.x        −(M_g a_g + b) (nv)
    S *const a = w.zero, *const part = w.matrix, *const x = w.matrix + nv * nv;
    for (int i = 0; i < nv; ++i)
      a[i] = w.is_given[i] ? given.a[i] : S(0);
    missing_efforts(w, given, a, nullptr);
    int n = 0;
    for (int i = 0; i < nv; ++i)
      if (!w.is_given[i])
        x[n++] = given.tau[i] + w.x[i];
    int at = 0;
    for (int i = 0; i < nv; ++i)
      for (int k = 0; k < nv; ++k)
        if (!w.is_given[i] && !w.is_given[k])
          part[at++] = w.M[i * nv + k];
    const auto fault = ldlt(part, n);
    solve(part, x, n);
    mark(fault, x, n);
    S *const found = w.matrix; // in place of `part`, which isn't needed any more
    for (int i = 0; i < nv; ++i) {
      // −w.x = M_g a_g + b, the efforts with a_o = 0
      S sum = -w.x[i];
      int k = 0;
      for (int j = 0; j < nv; ++j)
        if (!w.is_given[j])
          sum += w.M[i * nv + j] * x[k++];
      found[i] = w.is_given[i] ? sum : given.tau[i];
    }
    n = 0;
    for (int i = 0; i < nv; ++i) {
      given.result[1][i] = found[i];
      given.result[0][i] = w.is_given[i] ? a[i] : x[n++];
    }
  }

  /// The jump dv of M dv = Gᵀ Ĵᵀ impulses.  At rest and without gravity, the efforts of inverse dynamics are minus the right side.
  void set_jump(const memory_of_state &w, const state_view<S> &given) const {
    state_view<S> s = given;
    s.v = s.a = w.zero;
    run(impulses, w, s, w.x);
    for (int i = 0; i < m.nv(); ++i)
      w.x[i] = -w.x[i];
    solve_in_place(w.M, w.x);
    std::copy_n(w.x, m.nv(), given.result[0]);
  }

  /// Sets w.J, the Jacobians of all frames, w.solved = J M⁻¹ and w.square = J M⁻¹ Jᵀ.  M is replaced by its factors.
  void set_inverse(const memory_of_state &w, const state_view<S> &given) const {
    const int nv = m.nv(), rows = 6 * given.links.n;
    for (int f = 0; f < given.links.n; ++f) {
      state_view<S> s = given;
      s.links = {1, given.links.index + f};
      run(columns, w, s, w.J + 6 * f * nv);
    }
    const auto fault = ldlt(w.M, nv);
    std::copy_n(w.J, rows * nv, w.solved);
    for (int i = 0; i < rows; ++i)
      // row i of J M⁻¹ is M⁻¹ times row i of J: M is symmetric
      solve(w.M, w.solved + i * nv, nv);
    for (int i = 0; i < rows; ++i)
      for (int k = 0; k <= i; ++k) {
        S sum = 0;
        for (int j = 0; j < nv; ++j)
          sum += w.solved[i * nv + j] * w.J[k * nv + j];
        w.square[i * rows + k] = w.square[k * rows + i] = sum;
      }
    mark(fault, w.square, std::ptrdiff_t(rows) * rows);
  }

  /// The definitions of ksl/engine/algorithms/operational_space/operational_space.hpp.
  ///
  ///     w.square    J M⁻¹ Jᵀ → Λ, its pseudo-inverse (rows, rows); as it is for operational_inverse      result 0
  ///     w.pivots    memory of the inversion, and then x'' = J̇ v − J M⁻¹ b, accelerations without efforts
  ///                 bias −Λ x''                                                                       result 1, for operational_space
  ///     w.solved    J M⁻¹ (rows, nv): M⁻¹ Jᵀ Λ is its transpose times Λ, (nv, rows)                       result 2
  ///                 the rank of J M⁻¹ Jᵀ                                                              result 3, or 1 of operational_inertia
  void set_operational(const memory_of_state &w, const state_view<S> &given) const {
    const int nv = m.nv(), rows = 6 * given.links.n;
    set_inverse(w, given);
    S rank = 0;
    if (what != mimic_by::operational_inverse)
      rank = invert_semidefinite(rows, w.square, w.pivots);
    if (what == mimic_by::operational_space) {
      missing_efforts(w, given, w.zero, nullptr);
      solve(w.M, w.x, nv); // the accelerations without efforts
      state_view<S> s = given;
      s.a = w.x, s.frame.kind = acceleration_kind::rate;
      run(rates, w, s, w.pivots);
      for (int i = 0; i < rows; ++i) {
        S sum = 0;
        for (int k = 0; k < rows; ++k)
          sum -= w.square[i * rows + k] * w.pivots[k];
        given.result[1][i] = sum;
      }
      for (int i = 0; i < nv; ++i)
        for (int c = 0; c < rows; ++c) {
          S sum = 0;
          for (int k = 0; k < rows; ++k)
            sum += w.solved[k * nv + i] * w.square[k * rows + c];
          given.result[2][i * rows + c] = sum;
        }
      *given.result[3] = rank;
    } else if (what == mimic_by::operational_inertia) {
      *given.result[1] = rank;
    }
    std::copy_n(w.square, rows * rows, given.result[0]);
  }
};

} // namespace ksl::mimic
