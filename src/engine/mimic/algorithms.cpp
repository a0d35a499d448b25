// Algorithms for models with followers, on top of the kernels.  Inputs are expanded: q̂ = G q + offset, v̂ = G v, â = G a.  Results are
// reduced axis by axis: efforts, and derivatives by a motion, are multiplied by Gᵀ; of motions and positions, those of leaders are
// kept.
//
// Forward dynamics is no such projection, since Gᵀ has no inverse that would give the followers' efforts.  It solves
// (Gᵀ M̂ G) a = τ − Gᵀ (bias of v̂ = G v), densely.  The inverse of M, and its products, come from the same matrix.  Algorithms that
// solve more than one such system are in systems.hpp.
//
// Of three coordinates, the last of which follows the second by r:
//
//     G = [ 1  0 ]      τ = Gᵀ τ̂ = [ τ̂₁         ]      M = Gᵀ M̂ G = [ M̂₁₁            M̂₁₂ + r M̂₁₃             ]
//         [ 0  1 ]                  [ τ̂₂ + r τ̂₃ ]                   [ M̂₂₁ + r M̂₃₁   M̂₂₂ + 2 r M̂₂₃ + r² M̂₃₃ ]
//         [ 0  r ]
//
//     mimic_by                                                computed by
//     projection                                              projection.hpp: the kernel, expanded before and reduced after
//     solution, product, inverse, upper_triangle              dense, below: M, and one right side
//     derivatives of solutions, hybrid, jump, operational_…   systems.hpp: several right sides, or a part of M
#include "engine/mimic/algorithms.hpp"

#include "engine/kernels/one_state.hpp"
#include "engine/mimic/projection.hpp"
#include "engine/mimic/systems.hpp"
#include "engine/states/ordinary_results.hpp"

#include <stdexcept>
#include <string>

namespace ksl::mimic {
namespace {

/// Computes what follows from the mass matrix M at once: the solution of M a = τ − bias, M⁻¹ τ, M⁻¹, or a triangle of M.
template <class S> struct dense {
  const mimic_by what;
  const model &m;
  projection<S> inertia{rows::mass_matrix, m}, efforts{rows::inverse_dynamics, m};

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
    state_view<S> s = given;
    s.a = w.zero, s.result[0] = w.bias;
    if (what == mimic_by::solution)
      efforts.state(w.rest, s);
    s.result[0] = w.M;
    inertia.state(w.rest, s);
    finish_dense(what, m.nv(), w.M, w.bias, given.tau, given.result[0]);
  }

  std::size_t batch_bytes(const batch_view<S> &given) const {
    arena measure;
    lay_out(measure, given);
    return measure.used();
  }

  /// Two calls of kernels for some states at a time, b = Gᵀ b̂ at v̂ = G v and â = 0, and M = Gᵀ M̂ G; then each state is solved by itself.
  void batch(const batch_view<S> &given, std::size_t first, std::size_t end, void *memory) const {
    const int nv = m.nv(), states = states_at_a_time();
    arena pieces(memory);
    auto [M, bias, tau, external, rest, part] = lay_out(pieces, given);
    for (std::size_t k = first; k < end; k += static_cast<std::size_t>(states)) {
      const std::size_t n = std::min(end - k, static_cast<std::size_t>(states));
      part.n = n, part.external = external;
      part.q = rows_from(given.q, k), part.v = rows_from(given.v, k);
      for (int x = 0; x < given.external_n; ++x)
        external[x] = {given.external[x].link, rows_from(given.external[x].wrench, k)};
      part.result[0] = {bias, nv};
      if (what == mimic_by::solution)
        efforts.batch(part, 0, n, rest);
      part.result[0] = {M, nv * nv};
      inertia.batch(part, 0, n, rest);
      for (std::size_t i = 0; i < n && given.result[0].first; ++i) {
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(i) * nv;
        for (int j = 0; j < nv; ++j) // the result may lie where the efforts are
          tau[j] = given.tau.first ? ksl::row(given.tau, k + i)[j] : S(0);
        finish_dense(what, nv, M + at * nv, bias + at, tau, ksl::row(given.result[0], k + i));
      }
    }
  }

private:
  int states_at_a_time() const { return 4 * inertia.kernel.lanes; }

  struct memory_of_batch {
    S *M, *bias; ///< of some states
    S *tau;      ///< of one
    external_rows<S> *external;
    void *rest;
    batch_view<S> part; ///< these states
  };
  memory_of_batch lay_out(arena &memory, const batch_view<S> &given) const {
    const std::ptrdiff_t nv = m.nv(), states = states_at_a_time();
    memory_of_batch w = {};
    w.M = memory.take<S>(states * nv * nv), w.bias = memory.take<S>(states * nv), w.tau = memory.take<S>(nv);
    w.external = memory.take<external_rows<S>>(given.external_n);
    w.part = given;
    // efforts of the batch are none of the inputs of either call
    w.part.tau = {}, w.part.result[0] = {w.bias, nv};
    w.rest = memory.take<std::byte>(
        static_cast<std::ptrdiff_t>(std::max(inertia.batch_bytes(w.part), efforts.batch_bytes(w.part))));
    return w;
  }

  struct memory_of_state {
    S *M, *bias, *zero;
    void *rest;
    void lay_out(arena &memory, const dense &of, const extents &asked) {
      const int nv = of.m.nv();
      M = memory.take<S>(nv * nv), bias = memory.take<S>(nv), zero = memory.take<S>(nv);
      rest = memory.take<std::byte>(
          static_cast<std::ptrdiff_t>(std::max(of.inertia.state_bytes(asked), of.efforts.state_bytes(asked))));
    }
  };
};

/// One state, whose results nobody has looked at.
/// The three structs of this room, by the row's mimic_by, as the table above has them.
template <class S> void compute_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s) {
  if (row.mimic == mimic_by::projection)
    projection<S>{computed(row), m}.state(memory, s);
  else if (has_systems(row.mimic))
    systems<S>{row.mimic, m}.state(memory, s);
  else
    dense<S>{row.mimic, m}.state(memory, s);
}

/// Memory of systems that are solved state by state.
template <class S> struct memory_of_states {
  void *workspace;
  copied_state<S> state;
  memory_of_states(arena &memory, const algorithm_row &row, const model &m, const batch_view<S> &batch)
      : workspace(memory.take<std::byte>(static_cast<std::ptrdiff_t>(state_bytes<S>(row, m, room_for(batch))))),
        state() {
    state.lay_out(memory, computed(row), extents_of(m, batch), batch);
  }
};

} // namespace

void refuse(const algorithm_row &row, const model &m) {
  if (!m.followers() || row.mimic != mimic_by::refusal)
    return;
  throw std::invalid_argument(
      std::string(row.name) + " is not available for robots with mimic joints, whose mass matrix has other zeros " +
      "than those of the tree; use " +
      (row.needs_mass ? "solve_mass_matrix or mass_matrix_inverse" : "mass_matrix or mass_matrix_upper") +
      ", or load the robot with mimic=\"independent\" (mimic_independent in C and C++), which gives each joint a " +
      "coordinate of its own");
}

template <class S> std::size_t state_bytes(const algorithm_row &row, const model &m, const room &wanted) {
  const extents asked = extents_of(m, wanted);
  if (row.mimic == mimic_by::projection)
    return projection<S>{computed(row), m}.state_bytes(asked);
  if (has_systems(row.mimic))
    return systems<S>{row.mimic, m}.state_bytes(asked);
  return dense<S>{row.mimic, m}.state_bytes(asked);
}

/// All results are looked at: a sum in a kernel tells of M̂, not of what has been solved with M since.
template <class S> bool run_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s) {
  compute_state(row, m, memory, s);
  return ordinary_results(row, m, s);
}

template <class S> std::size_t batch_bytes(const algorithm_row &row, const model &m, const batch_view<S> &batch) {
  if (row.mimic == mimic_by::projection)
    return projection<S>{computed(row), m}.batch_bytes(batch);
  if (!has_systems(row.mimic))
    return dense<S>{row.mimic, m}.batch_bytes(batch);
  if (row.mimic == mimic_by::solution_derivatives)
    return systems<S>{row.mimic, m}.derivatives_batch_bytes(batch);
  arena measure;
  const memory_of_states<S> states(measure, row, m, batch);
  return measure.used();
}

template <class S>
bool run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first, std::size_t end,
               void *memory) {
  if (row.mimic == mimic_by::projection) {
    projection<S>{computed(row), m}.batch(batch, first, end, memory);
  } else if (!has_systems(row.mimic)) {
    dense<S>{row.mimic, m}.batch(batch, first, end, memory);
  } else if (row.mimic == mimic_by::solution_derivatives) {
    systems<S>{row.mimic, m}.derivatives_batch(batch, first, end, memory);
  } else {
    arena pieces(memory);
    const memory_of_states<S> states(pieces, row, m, batch);
    for (std::size_t k = first; k < end; ++k)
      compute_state(row, m, states.workspace, states.state.load(computed(row), extents_of(m, batch), batch, k));
  }
  return ordinary_results(row, m, batch, first, end);
}

#define KSL_INSTANTIATE(S)                                                                                             \
  template std::size_t state_bytes<S>(const algorithm_row &, const model &, const room &);                             \
  template bool run_state<S>(const algorithm_row &, const model &, void *, const state_view<S> &);                     \
  template std::size_t batch_bytes<S>(const algorithm_row &, const model &, const batch_view<S> &);                    \
  template bool run_batch<S>(const algorithm_row &, const model &, const batch_view<S> &, std::size_t, std::size_t,    \
                             void *);
KSL_INSTANTIATE(double)
KSL_INSTANTIATE(float)
#undef KSL_INSTANTIATE

} // namespace ksl::mimic
