// Computes one state in a workspace that the caller provides.
#pragma once

#include "engine/run/examine.hpp"
#include "engine/run/all_ways.hpp"
#include "engine/states/ordinary_results.hpp"
#include "engine/states/thread_memory.hpp"
#include "text/rounding.hpp"

#include <stdexcept>
#include <string>

namespace ksl {

/// Runs an algorithm for a mechanism of any kind.  The inputs that it reads and the results that it writes must not be null.  Returns
/// whether the results are ordinary (engine/kernels/algorithm.hpp).
template <class S> bool compute_ordinary(const algorithm_row &row, const model &m, data &d, const state_view<S> &s) {
  if (s.links.n > m.view().links && links_are_few(row))
    throw std::invalid_argument(std::string(row.name) + ": more links than the model has");
  require_computable(row, m);
  const way_calls<S> &calls = calls_of<S>(row, m);
  if (!s.q && calls.without_last_reactions)
    throw std::invalid_argument(std::string("reactions of ") + calls.without_last_reactions +
                                " are those of inverse_dynamics_with_reactions: there is no call for those of the "
                                "state that was computed last");
  // The workspace has room for a request that names each link and joint once.  A larger one takes memory of the thread, since nothing
  // of it is read after the call.
  const std::size_t bytes = calls.state_bytes(row, m, room_for(s));
  return calls.run_state(row, m, bytes <= d.bytes() ? d.memory() : thread_memory(kept_for::workspace, bytes), s);
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

/// Runs it, and throws result_error if results are not finite although the arguments are.  Calls from C++ (arguments unchecked) look at the
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
