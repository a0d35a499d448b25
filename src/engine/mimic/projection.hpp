// Results of the expanded mechanism, reduced axis by axis (algorithms.cpp).
#pragma once

#include "engine/kernels/kernels.hpp"
#include "engine/states/extents.hpp"
#include "ksl/engine/lanes/workspace.hpp"

#include <algorithm>

namespace ksl::mimic {

inline constexpr std::size_t scratch_bytes = 64 << 10; ///< about the memory of the states that are expanded at a time

/// What a user's extents are in the expanded mechanism.
inline extents expanded(const model &m, extents of) {
  const model_view<double> view = m.view();
  of.nq = view.nq, of.nv = view.nv;
  return of;
}

/// Does the extent differ between the mechanism and the expanded one, and how is it reduced?
inline bool is_reduced(extent e) { return e == extent::nq || e == extent::nv || e == extent::motion; }
inline along what_is_along(extent e) {
  return e == extent::nq ? along::positions : e == extent::motion ? along::motions : along::efforts;
}

inline bool is_reduced(const result_row &result) {
  return std::any_of(result.shape, result.shape + result.axes, [](extent e) { return is_reduced(e); });
}

/// A result is an array with axes, row-major.  From axis i it looks like (outer, length, inner): those before it have been reduced already, those behind
/// it haven't.  A mass matrix of 3 coordinates, of which the last follows the first, M = Gᵀ M̂ G:
///
///     (3, 3)   axis 0: (1, 3, 3) → (1, 2, 3)   axis 1: (2, 3, 1) → (2, 2, 1)   (2, 2)
///              Gᵀ M̂                            (Gᵀ M̂) G, likewise along rows
///
/// Reduces a result of one state to out.  Overwrites x.
template <class S> void reduce(const coupling_view<S> &c, const result_row &result, const extents &full,
                               const extents &own, S *x, S *out) {
  int last = result.axes - 1; // of the axes that differ, and so it is written to the result
  while (!is_reduced(result.shape[last]))
    --last;
  std::ptrdiff_t outer = 1, inner = numbers_of(result, full);
  for (int i = 0; i <= last; ++i) {
    const int length = length_of(result.shape[i], full);
    inner /= std::max(length, 1);
    if (is_reduced(result.shape[i]))
      reduce_axis(c, what_is_along(result.shape[i]), length, outer, inner, x, i == last ? out : x);
    outer *= length_of(result.shape[i], own);
  }
}

template <class S>
void expand(const coupling_view<S> &c, const algorithm_row &row, input x, const S *numbers, S *out) {
  if (x == input::q || x == input::q1)
    expand_position(c, numbers, out);
  else if (x == input::tau && row.loops == loops_by::plan) // elsewhere these are no efforts
    expand_effort(c, numbers, out);
  else
    expand_motion(c, numbers, out);
}

/// Numbers of some states of the expanded mechanism.  Inputs and results that are the same in both have none.
template <class S> struct expansion {
  S *input_rows[most_inputs] = {}, *result_rows[most_results] = {};
  int input_width[most_inputs] = {};
  std::ptrdiff_t result_width[most_results] = {};

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

/// Computes an algorithm whose results are reduced axis by axis: inputs are expanded, the kernel runs, and results are reduced.  The
/// kernel's workspace is at the beginning of the memory, where calls for reactions of the last state read it.
template <class S> struct projection {
  const algorithm_row &row;
  const model &m;
  model_view<S> view = m.view_in<S>();
  coupling_view<S> c = m.coupling_in<S>();
  const kernels_in<S> &kernel = kernels_of_row<S>(row);

  std::size_t state_bytes(const extents &asked) const {
    arena measure;
    expansion<S> e;
    measure.take<std::byte>(static_cast<std::ptrdiff_t>(kernel.workspace_bytes(view)));
    e.lay_out(measure, row, expanded(m, asked), 1);
    return measure.used();
  }

  /// Returns what the kernel does.
  /// Inputs and results that are the same in both mechanisms stay where the caller has them; others get memory behind the kernel's.
  bool state(void *memory, const state_view<S> &given) const {
    const extents own = extents_of(m, given), full = expanded(m, own);
    arena pieces(memory);
    void *const workspace = pieces.take<std::byte>(static_cast<std::ptrdiff_t>(kernel.workspace_bytes(view)));
    expansion<S> e;
    e.lay_out(pieces, row, full, 1);
    state_view<S> s = given;
    for (int i = 0; i < row.inputs; ++i)
      if (const input x = row.input_list[i]; e.input_width[i] && input_of(given, x)) {
        expand(c, row, x, input_of(given, x), e.input_rows[i]);
        input_of(s, x) = e.input_rows[i];
      }
    for (int r = 0; r < row.results; ++r)
      if (e.result_width[r])
        s.result[r] = e.result_rows[r];
    const bool ordinary = kernel.state(view, workspace, s);
    for (int r = 0; r < row.results; ++r)
      if (e.result_width[r] && given.result[r])
        reduce(c, row.result[r], full, own, e.result_rows[r], given.result[r]);
    return ordinary;
  }

  std::size_t batch_bytes(const batch_view<S> &given) const {
    arena measure;
    lay_out(measure, given);
    return measure.used();
  }

  ///
  ///     given (n, nq or nv) ── expand ──▸ input_rows (n, n̂q or n̂v) ── kernel, in lanes ──▸ result_rows (n, width) ── reduce ──▸ given
  ///
  /// Part by part of some states, which stay in the caches meanwhile.  Numbers that are the same in both mechanisms, wrenches and poses, go by as
  /// they are.
  void batch(const batch_view<S> &given, std::size_t first, std::size_t end, void *memory) const {
    const extents own = extents_of(m, given), full = expanded(m, own);
    const int states = states_at_a_time(full);
    arena pieces(memory);
    const auto [e, external, reactions, inner] = lay_out(pieces, given);
    for (std::size_t k = first; k < end; k += static_cast<std::size_t>(states)) {
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
          reduce(c, row.result[r], full, own, e.result_rows[r] + static_cast<std::ptrdiff_t>(i) * e.result_width[r],
                 ksl::row(given.result[r], k + i));
    }
  }

private:
  struct memory_of_batch {
    expansion<S> e;
    external_rows<S> *external;
    reaction_rows<S> *reactions;
    void *inner; ///< of the kernel
  };
  memory_of_batch lay_out(arena &memory, const batch_view<S> &given) const {
    const extents full = expanded(m, extents_of(m, given));
    memory_of_batch w;
    w.e.lay_out(memory, row, full, states_at_a_time(full));
    w.external = memory.take<external_rows<S>>(given.external_n);
    w.reactions = memory.take<reaction_rows<S>>(given.reactions_n);
    w.inner = memory.take<std::byte>(static_cast<std::ptrdiff_t>(ksl::batch_bytes(kernel, view, given)));
    return w;
  }

  /// How many states are expanded at a time: whole blocks of lanes.
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
  void load(const batch_view<S> &given, std::size_t k, std::size_t n, const expansion<S> &e,
            batch_view<S> &part) const {
    for (int i = 0; i < row.inputs; ++i) {
      const input x = row.input_list[i];
      const rows_view<const S> &rows = input_of(given, x);
      if (!rows.first)
        continue;
      input_of(part, x) = rows_from(rows, k);
      if (!e.input_width[i])
        continue;
      for (std::size_t j = 0; j < n; ++j)
        expand(c, row, x, ksl::row(rows, k + j), e.input_rows[i] + static_cast<std::ptrdiff_t>(j) * e.input_width[i]);
      input_of(part, x) = {e.input_rows[i], e.input_width[i]};
    }
  }
};

} // namespace ksl::mimic
