// Algorithms for models with followers, on top of the kernels: q̂ = G q + offset, v̂ = G v, â = G a are expanded, and results are
// reduced axis by axis: efforts, and derivatives by a motion, by Gᵀ; of motions and positions the leaders' are kept.
//
// Forward dynamics is no such projection, since Gᵀ has no inverse that would give the followers' efforts.  It solves
// (Gᵀ M̂ G) a = τ − Gᵀ (bias of v̂ = G v), densely.  The inverse of M, and its products, come from the same matrix.
#include "engine/coupled.hpp"

#include "ksl/engine/workspace.hpp"
#include "ksl/linalg.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

namespace ksl::coupled {
namespace {

constexpr std::size_t scratch_bytes = 64 << 10; ///< about the memory of the states that are expanded at a time

/// The row whose kernels run: it may have more inputs and results.
const algorithm_row &computed(const algorithm_row &row) { return row.variant_of ? *row.variant_of : row; }

/// The same extents in the expanded mechanism.
extents expanded(const model &m, extents of) {
  const model_view<double> view = m.view();
  of.nq = view.nq, of.nv = view.nv;
  return of;
}

/// Does the extent differ between the mechanism and the expanded one, and how is it reduced?
bool is_reduced(extent e) { return e == extent::nq || e == extent::nv || e == extent::motion; }
along what_is_along(extent e) {
  return e == extent::nq ? along::positions : e == extent::motion ? along::motions : along::efforts;
}

bool is_reduced(const result_row &result) {
  return std::any_of(result.shape, result.shape + result.axes, [](extent e) { return is_reduced(e); });
}

/// Reduces a result of one state in place.
template <class S> void reduce(const coupling_view<S> &c, const result_row &result, const extents &full, const extents &own, S *x) {
  int outer = 1, inner = numbers_of(result, full);
  for (int i = 0; i < result.axes; ++i) {
    const int length = length_of(result.shape[i], full);
    inner /= std::max(length, 1);
    if (is_reduced(result.shape[i]))
      reduce_axis(c, what_is_along(result.shape[i]), length, outer, inner, x);
    outer *= length_of(result.shape[i], own);
  }
}

template <class S> void expand(const coupling_view<S> &c, input x, const S *numbers, S *out) {
  if (x == input::q || x == input::q1)
    expand_position(c, numbers, out);
  else
    expand_motion(c, numbers, out);
}

/// Numbers of some states of the expanded mechanism.  Inputs and results that are the same in both have none.
template <class S> struct expansion {
  S *input_rows[most_inputs], *result_rows[most_results];
  int input_width[most_inputs], result_width[most_results];

  void lay_out(arena &memory, const algorithm_row &row, const extents &full, int states) {
    for (int i = 0; i < row.inputs; ++i) {
      input_width[i] = row.input_list[i] == input::fraction ? 0 : length_of(row.input_list[i], full.nq, full.nv);
      input_rows[i] = memory.take<S>(states * input_width[i]);
    }
    for (int r = 0; r < row.results; ++r) {
      result_width[r] = is_reduced(row.result[r]) ? numbers_of(row.result[r], full) : 0;
      result_rows[r] = memory.take<S>(states * result_width[r]);
    }
  }
};

/// An algorithm of motions: expanded, computed and reduced.  The kernel's workspace comes first in memory, since reactions of
/// the last state are read there.
template <class S> struct projection {
  const algorithm_row &row;
  const model &m;
  model_view<S> view = m.view_in<S>();
  coupling_view<S> c = m.coupling_in<S>();
  const kernels_in<S> &kernel = kernels_of_row<S>(row);

  std::size_t state_bytes(const extents &asked) const {
    arena measure;
    expansion<S> e;
    measure.take<std::byte>(static_cast<int>(kernel.workspace_bytes(view)));
    e.lay_out(measure, row, expanded(m, asked), 1);
    return measure.used();
  }

  void state(void *memory, const state_view<S> &given) const {
    const extents own = extents_of(m, given), full = expanded(m, own);
    arena pieces(memory);
    void *const workspace = pieces.take<std::byte>(static_cast<int>(kernel.workspace_bytes(view)));
    expansion<S> e;
    e.lay_out(pieces, row, full, 1);
    state_view<S> s = given;
    for (int i = 0; i < row.inputs; ++i)
      if (const input x = row.input_list[i]; e.input_width[i] && input_of(given, x)) {
        expand(c, x, input_of(given, x), e.input_rows[i]);
        input_of(s, x) = e.input_rows[i];
      }
    for (int r = 0; r < row.results; ++r)
      if (e.result_width[r])
        s.result[r] = e.result_rows[r];
    kernel.state(view, workspace, s);
    for (int r = 0; r < row.results; ++r)
      if (e.result_width[r] && given.result[r])
        store(r, e.result_rows[r], full, own, given.result[r]);
  }

  std::size_t batch(const batch_view<S> &given, std::size_t first, std::size_t end, void *memory) const {
    const extents own = extents_of(m, given), full = expanded(m, own);
    const int states = states_at_a_time(full);
    arena pieces(memory);
    expansion<S> e;
    e.lay_out(pieces, row, full, states);
    external_rows<S> *const external = pieces.take<external_rows<S>>(given.external_n);
    reaction_rows<S> *const reactions = pieces.take<reaction_rows<S>>(given.reactions_n);
    void *const inner = pieces.take<std::byte>(static_cast<int>(kernel.batch(view, given, 0, 0, nullptr)));
    for (std::size_t k = first; memory && k < end; k += static_cast<std::size_t>(states)) {
      const std::size_t n = std::min(end - k, static_cast<std::size_t>(states));
      batch_view<S> part = given;
      part.n = n, part.external = external, part.reactions = reactions;
      for (int x = 0; x < given.external_n; ++x)
        external[x] = {given.external[x].link, rows_from(given.external[x].wrench, k)};
      for (int r = 0; r < given.reactions_n; ++r)
        reactions[r] = {given.reactions[r].request, rows_from(given.reactions[r].out, k)};
      load(given, k, n, e, part);
      for (int r = 0; r < row.results; ++r) {
        part.result[r] = rows_from(given.result[r], k);
        if (e.result_width[r] && given.result[r].first)
          part.result[r] = {e.result_rows[r], e.result_width[r]};
      }
      kernel.batch(view, part, 0, n, inner);
      for (int r = 0; r < row.results; ++r)
        for (std::size_t i = 0; e.result_width[r] && given.result[r].first && i < n; ++i)
          store(r, e.result_rows[r] + static_cast<std::ptrdiff_t>(i) * e.result_width[r], full, own, ksl::row(given.result[r], k + i));
    }
    return pieces.used();
  }

private:
  /// Whole blocks of lanes.
  int states_at_a_time(const extents &full) const {
    std::size_t numbers = 1;
    for (int i = 0; i < row.inputs; ++i)
      numbers += static_cast<std::size_t>(length_of(row.input_list[i], full.nq, full.nv));
    for (int r = 0; r < row.results; ++r)
      numbers += static_cast<std::size_t>(numbers_of(row.result[r], full));
    const std::size_t blocks = scratch_bytes / (numbers * sizeof(S) * static_cast<std::size_t>(kernel.lanes));
    return kernel.lanes * static_cast<int>(std::clamp<std::size_t>(blocks, 1, 8));
  }

  /// Expands the inputs of the states k, k + 1, …, n in number.
  void load(const batch_view<S> &given, std::size_t k, std::size_t n, const expansion<S> &e, batch_view<S> &part) const {
    for (int i = 0; i < row.inputs; ++i) {
      const input x = row.input_list[i];
      const rows_view<const S> &rows = input_of(given, x);
      if (!rows.first)
        continue;
      input_of(part, x) = rows_from(rows, k);
      if (!e.input_width[i])
        continue;
      for (std::size_t j = 0; j < n; ++j)
        expand(c, x, ksl::row(rows, k + j), e.input_rows[i] + static_cast<std::ptrdiff_t>(j) * e.input_width[i]);
      input_of(part, x) = {e.input_rows[i], e.input_width[i]};
    }
  }

  void store(int r, S *numbers, const extents &full, const extents &own, S *out) const {
    reduce(c, row.result[r], full, own, numbers);
    std::copy_n(numbers, numbers_of(row.result[r], own), out);
  }
};

int ldlt(double *A, int n) { return ksl_linalg_ldlt_rmo(A, n); }
int ldlt(float *A, int n) { return ksl_linalg_ldlt_rmof(A, n); }
int invert(double *A, int n) { return ksl_linalg_symmetricMatrixInverse_rmo(A, n); }
int invert(float *A, int n) { return ksl_linalg_symmetricMatrixInverse_rmof(A, n); }
void solve(const double *A, double *x, int n) { ksl_linalg_ldlt_solve(A, x, x, n, n, 1); }
void solve(const float *A, float *x, int n) { ksl_linalg_ldlt_solvef(A, x, x, n, n, 1); }

/// What follows from the mass matrix M: the solution of M a = τ − bias, M⁻¹ τ, M⁻¹, or a triangle of M.
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
    arena measure(memory);
    memory_of_state w;
    w.lay_out(measure, *this, extents_of(m, given));
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
    S *const M = pieces.take<S>(states * nv * nv), *const bias = pieces.take<S>(states * nv), *const tau = pieces.take<S>(nv);
    batch_view<S> part = given;
    part.tau = {}, part.result[0] = {bias, nv};
    const std::size_t bytes = std::max(inertia.batch(part, 0, 0, nullptr), efforts.batch(part, 0, 0, nullptr));
    external_rows<S> *const external = pieces.take<external_rows<S>>(given.external_n);
    void *const rest = pieces.take<std::byte>(static_cast<int>(bytes));
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
      rest = memory.take<std::byte>(static_cast<int>(std::max(of.inertia.state_bytes(asked), of.efforts.state_bytes(asked))));
    }
  };

  /// M and bias are overwritten.  Where a joint moves no mass, nothing is determined: the result is NaN.
  void finish(S *M, S *bias, const S *tau, S *out) const {
    const int nv = m.nv();
    constexpr S nan = std::numeric_limits<S>::quiet_NaN();
    if (what == coupled_by::upper_triangle) {
      for (int i = 0; i < nv; ++i)
        std::copy_n(M + i * nv + i, nv - i, out + i * nv + i);
    } else if (what == coupled_by::inverse) {
      if (nv > 0 && invert(M, nv) != 0)
        std::fill_n(M, nv * nv, nan);
      std::copy_n(M, nv * nv, out);
    } else {
      for (int i = 0; i < nv; ++i)
        bias[i] = what == coupled_by::solution ? tau[i] - bias[i] : tau[i];
      if (nv > 0 && ldlt(M, nv) != 0)
        std::fill_n(bias, nv, nan);
      else if (nv > 0)
        solve(M, bias, nv);
      std::copy_n(bias, nv, out);
    }
  }
};

} // namespace

void require_projection(const algorithm_row &row, const model &m) {
  if (m.followers() && row.coupled == coupled_by::refusal)
    throw std::invalid_argument(std::string(row.name) + " is not available for robots with mimic joints; load the robot with " +
                                "mimic=\"independent\" (mimic_independent in C and C++), which gives each joint a coordinate of its own");
}

template <class S> std::size_t state_bytes(const algorithm_row &row, const model &m, const extents &asked) {
  if (row.coupled == coupled_by::projection)
    return projection<S>{computed(row), m}.state_bytes(asked);
  return dense<S>{row.coupled, m}.state_bytes(asked);
}

template <class S> void run_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s) {
  if (row.coupled == coupled_by::projection)
    return projection<S>{computed(row), m}.state(memory, s);
  dense<S>{row.coupled, m}.state(memory, s);
}

template <class S>
std::size_t run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first, std::size_t end,
                      void *memory) {
  if (row.coupled == coupled_by::projection)
    return projection<S>{computed(row), m}.batch(batch, first, end, memory);
  return dense<S>{row.coupled, m}.batch(batch, first, end, memory);
}

#define KSL_INSTANTIATE(S)                                                                                             \
  template std::size_t state_bytes<S>(const algorithm_row &, const model &, const extents &);                          \
  template void run_state<S>(const algorithm_row &, const model &, void *, const state_view<S> &);                     \
  template std::size_t run_batch<S>(const algorithm_row &, const model &, const batch_view<S> &, std::size_t, std::size_t, void *);
KSL_INSTANTIATE(double)
KSL_INSTANTIATE(float)
#undef KSL_INSTANTIATE

} // namespace ksl::coupled
