// Algorithms for models with followers, on top of the kernels.  Inputs are expanded: q̂ = G q + offset, v̂ = G v, â = G a.  Results are
// reduced axis by axis: efforts, and derivatives by a motion, are multiplied by Gᵀ; of motions and positions, those of leaders are
// kept.
//
// Forward dynamics is no such projection, since Gᵀ has no inverse that would give the followers' efforts.  It solves
// (Gᵀ M̂ G) a = τ − Gᵀ (bias of v̂ = G v), densely.  The inverse of M, and its products, come from the same matrix.  Algorithms that
// solve more than one such system are in systems.hpp.
#include "engine/mimic/algorithms.hpp"

#include "engine/mimic/projection.hpp"
#include "engine/mimic/systems.hpp"
#include "engine/states/one_state.hpp"

#include <stdexcept>
#include <string>

namespace ksl::coupled {
namespace {

/// Computes what follows from the mass matrix M at once: the solution of M a = τ − bias, M⁻¹ τ, M⁻¹, or a triangle of M.
template <class S> struct dense {
  const coupled_by what;
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
    if (what == coupled_by::solution)
      efforts.state(w.rest, s);
    s.result[0] = w.M;
    inertia.state(w.rest, s);
    finish(w.M, w.bias, given.tau, given.result[0]);
  }

  std::size_t batch(const batch_view<S> &given, std::size_t first, std::size_t end, void *memory) const {
    const int nv = m.nv(), states = 4 * inertia.kernel.lanes;
    arena pieces(memory);
    S *const M = pieces.take<S>(static_cast<std::ptrdiff_t>(states) * nv * nv),
             *const bias = pieces.take<S>(states * nv), *const tau = pieces.take<S>(nv);
    batch_view<S> part = given;
    part.tau = {}, part.result[0] = {bias, nv};
    const std::size_t bytes = std::max(inertia.batch(part, 0, 0, nullptr), efforts.batch(part, 0, 0, nullptr));
    external_rows<S> *const external = pieces.take<external_rows<S>>(given.external_n);
    void *const rest = pieces.take<std::byte>(static_cast<std::ptrdiff_t>(bytes));
    for (std::size_t k = first; memory && k < end; k += static_cast<std::size_t>(states)) {
      const std::size_t n = std::min(end - k, static_cast<std::size_t>(states));
      part.n = n, part.external = external;
      part.q = rows_from(given.q, k), part.v = rows_from(given.v, k);
      for (int x = 0; x < given.external_n; ++x)
        external[x] = {given.external[x].link, rows_from(given.external[x].wrench, k)};
      part.result[0] = {bias, nv};
      if (what == coupled_by::solution)
        efforts.batch(part, 0, n, rest);
      part.result[0] = {M, nv * nv};
      inertia.batch(part, 0, n, rest);
      for (std::size_t i = 0; i < n && given.result[0].first; ++i) {
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(i) * nv;
        for (int j = 0; j < nv; ++j) // the result may lie where the efforts are
          tau[j] = given.tau.first ? ksl::row(given.tau, k + i)[j] : S(0);
        finish(M + at * nv, bias + at, tau, ksl::row(given.result[0], k + i));
      }
    }
    return pieces.used();
  }

private:
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

  /// Sets the result, and overwrites M and bias.  If a joint moves no mass, M is singular, and the result is NaN.
  void finish(S *M, S *bias, const S *tau, S *out) const {
    const int nv = m.nv();
    constexpr S nan = std::numeric_limits<S>::quiet_NaN();
    if (what == coupled_by::upper_triangle) {
      for (int i = 0; i < nv; ++i)
        std::copy_n(M + i * nv + i, nv - i, out + i * nv + i);
    } else if (what == coupled_by::inverse) {
      if (invert(M, nv) != 0)
        std::fill_n(M, nv * nv, nan);
      std::copy_n(M, nv * nv, out);
    } else {
      for (int i = 0; i < nv; ++i)
        bias[i] = what == coupled_by::solution ? tau[i] - bias[i] : tau[i];
      if (ldlt(M, nv) != 0)
        std::fill_n(bias, nv, nan);
      else
        solve(M, bias, nv);
      std::copy_n(bias, nv, out);
    }
  }
};

} // namespace

void require_projection(const algorithm_row &row, const model &m) {
  if (!m.followers() || row.coupled != coupled_by::refusal)
    return;
  throw std::invalid_argument(
      std::string(row.name) + " is not available for robots with mimic joints, whose mass matrix has other zeros " +
      "than those of the tree; use " +
      (row.needs_mass ? "solve_mass_matrix or mass_matrix_inverse" : "mass_matrix or mass_matrix_upper") +
      ", or load the robot with mimic=\"independent\" (mimic_independent in C and C++), which gives each joint a " +
      "coordinate of its own");
}

template <class S> std::size_t state_bytes(const algorithm_row &row, const model &m, const extents &asked) {
  if (row.coupled == coupled_by::projection)
    return projection<S>{computed(row), m}.state_bytes(asked);
  if (has_systems(row.coupled))
    return systems<S>{row.coupled, m}.state_bytes(asked);
  return dense<S>{row.coupled, m}.state_bytes(asked);
}

template <class S> void run_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s) {
  if (row.coupled == coupled_by::projection) {
    projection<S>{computed(row), m}.state(memory, s);
    return;
  }
  if (has_systems(row.coupled))
    return systems<S>{row.coupled, m}.state(memory, s);
  dense<S>{row.coupled, m}.state(memory, s);
}

template <class S>
std::size_t run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first,
                      std::size_t end, void *memory) {
  if (row.coupled == coupled_by::projection)
    return projection<S>{computed(row), m}.batch(batch, first, end, memory);
  if (!has_systems(row.coupled))
    return dense<S>{row.coupled, m}.batch(batch, first, end, memory);
  if (row.coupled == coupled_by::solution_derivatives)
    return systems<S>{row.coupled, m}.derivatives_batch(batch, first, end, memory);
  arena pieces(memory);
  one_state_memory<S> state;
  state.lay_out(pieces, row, m, batch, state_bytes<S>(row, m, extents_of(m, batch)));
  for (std::size_t k = first; memory && k < end; ++k)
    run_state<S>(row, m, state.workspace, state.load(row, m, batch, k));
  return pieces.used();
}

#define KSL_INSTANTIATE(S)                                                                                             \
  template std::size_t state_bytes<S>(const algorithm_row &, const model &, const extents &);                          \
  template void run_state<S>(const algorithm_row &, const model &, void *, const state_view<S> &);                     \
  template std::size_t run_batch<S>(const algorithm_row &, const model &, const batch_view<S> &, std::size_t,          \
                                    std::size_t, void *);
KSL_INSTANTIATE(double)
KSL_INSTANTIATE(float)
#undef KSL_INSTANTIATE

} // namespace ksl::coupled
