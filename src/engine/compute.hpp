// Computes one state in a workspace that the caller provides.
#pragma once

#include "engine/coupled.hpp"
#include "engine/examine.hpp"
#include "engine/thread_memory.hpp"

#include "ksl/engine/lanes/workspace.hpp"

#include <stdexcept>
#include <string>

namespace ksl {

/// Does a row have fewer results than its kernels write?
constexpr bool has_unread_results(const algorithm_row &row) { return row.variant_of && row.results < row.variant_of->results; }

/// The same state with memory for those that the row doesn't have: the end of the workspace, which is longer by unread_bytes than
/// any algorithm needs.
template <class S> state_view<S> with_unread_results(const algorithm_row &row, const model &m, data &d, state_view<S> s) {
  arena memory(static_cast<std::byte *>(d.memory()) + d.bytes() - unread_bytes(row, extents_of(m, s)));
  for (int r = row.results; r < row.variant_of->results; ++r)
    s.result[r] = memory.take<S>(numbers_of(row.variant_of->result[r], extents_of(m, s)));
  return s;
}

/// Runs an algorithm.  The inputs that it reads and the results that it writes must not be null.
/// Returns whether the results are ordinary (engine/algorithm.hpp).
template <class S> bool compute_ordinary(const algorithm_row &row, const model &m, data &d, const state_view<S> &s) {
  if (s.links.n > m.view().links && links_are_few(row))
    throw std::invalid_argument(std::string(row.name) + ": more links than the model has");
  if (m.followers() == 0 && has_unread_results(row))
    return kernels_of_row<S>(row).state(m.view_in<S>(), d.memory(), with_unread_results(row, m, d, s));
  if (m.followers() == 0)
    return kernels_of_row<S>(row).state(m.view_in<S>(), d.memory(), s);
  coupled::require_projection(row, m);
  // the workspace has room for requests for each link and joint once; what a request for more leaves in memory is not read again
  const std::size_t bytes = coupled::state_bytes<S>(row, m, extents_of(m, s));
  coupled::run_state<S>(row, m, bytes <= d.bytes() ? d.memory() : thread_memory(kept_for::workspace, bytes), s);
  return ordinary_results(row, m, s);
}

/// The same; results that are not finite though the arguments are throw result_error.  In C++ those of algorithms that need mass alone
/// are looked at, where it costs least.
template <class S>
void compute(const algorithm_row &row, const model &m, data &d, const state_view<S> &s, arguments_are given = arguments_are::unchecked) {
  const bool ordinary = compute_ordinary<S>(row, m, d, s);
  if (!ordinary || (given == arguments_are::finite && !row.needs_mass && !ordinary_results(row, m, s)))
    examine_state(row, m, d.memory(), s, given);
}

} // namespace ksl
