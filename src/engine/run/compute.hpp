// Computes one state in a workspace that the caller provides.
#pragma once

#include "engine/mimic/algorithms.hpp"
#include "engine/run/examine.hpp"
#include "engine/elements/algorithms.hpp"
#include "text/rounding.hpp"
#include "engine/states/thread_memory.hpp"

#include "ksl/engine/lanes/workspace.hpp"

#include <stdexcept>
#include <string>

namespace ksl {

/// Do the row's kernels, which are those of another row, write more results than this row has?
constexpr bool has_unread_results(const algorithm_row &row) {
  return row.variant_of && row.results < row.variant_of->results;
}

/// The state with memory for the results that kernels write and the row doesn't have.  They go to the end of the workspace, where
/// ksl::data has unread_bytes more than any algorithm needs.
template <class S> state_view<S> with_unread_results(const algorithm_row &row, const model &m, data &d,
                                                     state_view<S> s) {
  arena memory(static_cast<std::byte *>(d.memory()) + d.bytes() - unread_bytes(row, extents_of(m, s)));
  for (int r = row.results; r < row.variant_of->results; ++r)
    s.result[r] = memory.take<S>(numbers_of(row.variant_of->result[r], extents_of(m, s)));
  return s;
}

/// Runs an algorithm for a mechanism of any kind.  The inputs that it reads and the results that it writes must not be null.  Returns
/// whether the results are ordinary (engine/kernels/algorithm.hpp).
template <class S> bool compute_ordinary(const algorithm_row &row, const model &m, data &d, const state_view<S> &s) {
  if (s.links.n > m.view().links && links_are_few(row))
    throw std::invalid_argument(std::string(row.name) + ": more links than the model has");
  if (loops::is_closed(row, m)) {
    loops::require_closed(row, m);
    if (!s.q)
      throw std::invalid_argument(
          "reactions of a mechanism with loops are those of inverse_dynamics_with_reactions: there is no call for those "
          "of the state that was computed last");
    const loops::room wanted = loops::room_for(s);
    if (row.closed != closed_by::linear &&           // which needs much
        loops::fits(wanted, loops::room_of_data(m))) // what it is made for: the bytes need not be counted
      return loops::run_state<S>(row, m, d.memory(), s);
    const std::size_t needed = loops::state_bytes<S>(row, m, wanted);
    return loops::run_state<S>(row, m, needed <= d.bytes() ? d.memory() : thread_memory(kept_for::workspace, needed),
                               s);
  }
  if (elements::act_in(row, m)) {
    elements::require_possible(row, m);
    if (!s.q)
      throw std::invalid_argument("reactions of a mechanism with force elements are those of "
                                  "inverse_dynamics_with_reactions: there is no call for those of the state that was "
                                  "computed last");
    const std::size_t needed = elements::state_bytes<S>(row, m, elements::room_for(s));
    return elements::run_state<S>(row, m, needed <= d.bytes() ? d.memory() : thread_memory(kept_for::workspace, needed),
                                  s);
  }
  if (m.followers() == 0 && has_unread_results(row))
    return kernels_of_row<S>(row).state(m.view_in<S>(), d.memory(), with_unread_results(row, m, d, s));
  if (m.followers() == 0)
    return kernels_of_row<S>(row).state(m.view_in<S>(), d.memory(), s);
  coupled::require_projection(row, m);
  // The workspace has room for a request that names each link and joint once.  A larger one takes memory of the thread, since nothing
  // of it is read after the call.
  const std::size_t bytes = coupled::state_bytes<S>(row, m, extents_of(m, s));
  coupled::run_state<S>(row, m, bytes <= d.bytes() ? d.memory() : thread_memory(kept_for::workspace, bytes), s);
  return ordinary_results(row, m, s);
}

template <class S>
void examine_results(const algorithm_row &row, const model &m, data &d, const state_view<S> &s, arguments_are given,
                     bool ordinary) {
  if (!ordinary || (given == arguments_are::finite && !row.needs_mass && !ordinary_results(row, m, s)))
    examine_state(row, m, d.memory(), s, given);
}

/// Runs an algorithm for a mechanism of any kind, in any mode of rounding.
template <class S>
void compute_in_general(const algorithm_row &row, const model &m, data &d, const state_view<S> &s,
                        arguments_are given) {
  const nearest_rounding rounding;
  examine_results(row, m, d, s, given, compute_ordinary<S>(row, m, d, s));
}

/// The same.  Throws result_error if results are not finite although the arguments are.  Calls from C++ (arguments unchecked) look at the
/// results of algorithms that need mass only, where that costs least.
///
/// Most calls are for trees: what else could act is asked once, and what the row says is known where the call is compiled.  For one state
/// of a small arm each nanosecond is one in a hundred and fifty.
template <class S>
[[gnu::always_inline]] inline void compute(const algorithm_row &row, const model &m, data &d, const state_view<S> &s,
                                           arguments_are given = arguments_are::unchecked) {
  if (m.is_tree_alone() && !has_unread_results(row) && !links_are_few(row) && nearest_rounding::is_set()) [[likely]]
    examine_results(row, m, d, s, given, kernels_of_row<S>(row).state(m.view_in<S>(), d.memory(), s));
  else
    compute_in_general(row, m, d, s, given);
}

} // namespace ksl
