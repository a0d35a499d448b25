// The ways that rows are computed, and which of them computes a row for a model: the one place where this is chosen.
//
// Kernels compute trees.  What they don't know is done by ways above them: joints that follow others (mimic), springs, dampers and cylinders
// (elements), closed mechanisms (loops).  The highest way that has to act for a row and a model computes it, and is made of calls of those
// below it.  What a way does in an algorithm is a column of its row.
//
// A further way is a value of `way`, a line of way_of, and an entry of run/all_ways.hpp.
#pragma once

#include "engine/kernels/kernels.hpp"
#include "engine/states/extents.hpp"

namespace ksl {

enum class way : unsigned char { kernels, mimic, elements, loops };

/// What computes a row for a model; of the ways up to `highest`, for a way that calls those below it.
inline way way_of(const algorithm_row &row, const model &m, way highest = way::loops) {
  if (highest >= way::loops && row.loops != loops_by::tree && !m.loops().empty())
    return way::loops;
  if (highest >= way::elements && row.elements != elements_by::nothing && m.acting_force_elements() > 0)
    return way::elements;
  return m.followers() > 0 ? way::mimic : way::kernels;
}

/// What a way has.  Memory is aligned to 64 bytes.
template <class S> struct way_calls {
  /// Throws std::invalid_argument if the algorithm can't be computed for the model because of what this way is there for; says what can.
  void (*refuse)(const algorithm_row &, const model &);

  /// Whose reactions of the state that was computed last there is no call for; null: there is one.
  const char *without_last_reactions;

  /// Does run_state look at all results?  Otherwise it says of rows that need mass alone whether results are ordinary, as kernels do
  /// (engine/kernels/algorithm.hpp).
  bool looks_at_all;

  /// Computes one state, as state_kernel.
  std::size_t (*state_bytes)(const algorithm_row &, const model &, const room &);
  bool (*run_state)(const algorithm_row &, const model &, void *memory, const state_view<S> &);

  /// Computes the states [first, end) of a batch; returns whether the results of all are ordinary.
  std::size_t (*batch_bytes)(const algorithm_row &, const model &, const batch_view<S> &);
  bool (*run_batch)(const algorithm_row &, const model &, const batch_view<S> &, std::size_t first, std::size_t end,
                    void *memory);
};

/// The calls of a row and a model, from a table of ways that begins with the kernels.
template <class S, std::size_t n>
const way_calls<S> &calls_in(const way_calls<S> *const (&ways)[n], const algorithm_row &row, const model &m) {
  return *ways[static_cast<std::size_t>(way_of(row, m, static_cast<way>(n - 1)))];
}

namespace kernel_calls {

/// Bytes of the results that the kernels of a row write and the row doesn't have (algorithm_row::variant_of).
inline std::size_t unread_bytes(const algorithm_row &row, const extents &asked) {
  std::size_t bytes = 0;
  for (int r = row.results; row.variant_of && r < row.variant_of->results; ++r)
    bytes += (static_cast<std::size_t>(numbers_of(row.variant_of->result[r], asked)) * sizeof(double) + 63) / 64 * 64;
  return bytes;
}

inline void refuse(const algorithm_row &, const model &) {}

template <class S> std::size_t state_bytes(const algorithm_row &row, const model &m, const room &wanted) {
  const std::size_t bytes = kernels_of_row<S>(row).workspace_bytes(m.view_in<S>());
  return has_unread_results(row) ? bytes + unread_bytes(row, extents_of(m, wanted)) : bytes;
}

/// Results that the row doesn't have go behind the workspace, if no others are given for them.  Apart from the usual case, which then is a jump.
template <class S>
[[gnu::noinline]] bool run_with_unread(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s) {
  const kernels_in<S> &kernel = kernels_of_row<S>(row);
  state_view<S> all = s;
  arena behind(static_cast<std::byte *>(memory) + kernel.workspace_bytes(m.view_in<S>()));
  for (int r = row.results; r < row.variant_of->results; ++r)
    if (S *const unread = behind.take<S>(numbers_of(row.variant_of->result[r], extents_of(m, s))); !all.result[r])
      all.result[r] = unread;
  return kernel.state(m.view_in<S>(), memory, all);
}

template <class S> bool run_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s) {
  if (has_unread_results(row)) [[unlikely]]
    return run_with_unread(row, m, memory, s);
  return kernels_of_row<S>(row).state(m.view_in<S>(), memory, s);
}

template <class S> std::size_t batch_bytes(const algorithm_row &row, const model &m, const batch_view<S> &batch) {
  return ksl::batch_bytes(kernels_of_row<S>(row), m.view_in<S>(), batch);
}

template <class S>
bool run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first, std::size_t end,
               void *memory) {
  return kernels_of_row<S>(row).batch(m.view_in<S>(), batch, first, end, memory).ordinary;
}

template <class S>
inline constexpr way_calls<S> calls = {refuse,       nullptr,        false,       state_bytes<S>,
                                       run_state<S>, batch_bytes<S>, run_batch<S>};

} // namespace kernel_calls
} // namespace ksl
