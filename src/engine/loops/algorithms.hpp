// Algorithms for mechanisms with loops, instead of the kernels of the tree.  Rows say which they are (algorithm_row::closed); results that
// are those of the tree at the given numbers, poses and energies for example, take the usual way.
//
// Single precision is computed in double precision and rounded, since ranks and redundant equations need more digits than it has.
#pragma once

#include "engine/kernels/algorithm.hpp"
#include "ksl/model.hpp"

#include <string>

namespace ksl::loops {

/// Is the algorithm computed here for this model?
inline bool is_closed(const algorithm_row &row, const model &m) {
  return !m.loops().empty() && row.closed != closed_by::tree;
}

/// Throws std::invalid_argument if the algorithm is not defined for mechanisms with loops; says what is.
void require_closed(const algorithm_row &row, const model &m);

/// How many external wrenches, joints in one request for reactions, and links memory must have room for.
struct room { int externals = 0, joints = 0, requests = 1, links = 0; };
template <class S> room room_for(const state_view<S> &s);
template <class S> room room_for(const batch_view<S> &batch);

/// The bytes that one state needs, or more.  They are counted once for nearly all calls: to count takes as long as to compute a four-bar.
template <class S> std::size_t state_bytes(const algorithm_row &row, const model &m, room wanted);

/// The room for a wrench on each link, and for one request that names each joint once: that of ksl::data.
inline room room_of_data(const model &m) {
  return {static_cast<int>(m.links().size()), static_cast<int>(m.joints().size() + m.loops().size()), 1};
}
inline bool fits(room wanted, room given) {
  return wanted.externals <= given.externals && wanted.joints <= given.joints && wanted.requests <= given.requests;
}

/// Computes one state.  Returns false, and NaN in all results, where the numbers are not those of the closed mechanism or don't determine
/// a result.
template <class S> bool run_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s);

/// As batch_kernel.  by_plan: states that the model's plan fits are computed in lanes, otherwise all with pivots of their own.
template <class S>
batch_outcome run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first,
                        std::size_t end, void *memory, bool by_plan = true);

/// Why run_state has no result; empty if it has one.  Allocates.
template <class S> std::string reason(const algorithm_row &row, const model &m, const state_view<S> &s);

} // namespace ksl::loops
