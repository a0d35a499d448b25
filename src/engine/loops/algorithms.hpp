// Algorithms of mechanisms with loops.  Rows say which they are (algorithm_row::loops); results that are those of the tree at the given
// numbers, poses and energies for example, take the ways of trees.
//
// The words: `loops` is the topic, and a loop one joint that closes one with its equations; a mechanism is `closed`, and so are its
// dynamics, be they kernels (closed_dynamics.hpp) that follow the model's `plan` of elimination (closed_by_plan.hpp), or solved with
// pivots of the state's own, where the plan doesn't fit (closed_state.hpp).
//
// Single precision is computed in double precision and rounded, since ranks and redundant equations need more digits than it has.
#pragma once

#include "engine/elements/algorithms.hpp"

#include <string>

namespace ksl::loops {

/// Throws std::invalid_argument if the algorithm is not defined for mechanisms with loops; says what is.
void refuse(const algorithm_row &row, const model &m);

/// The bytes that one state needs, or more.  They are counted once for nearly all calls: to count takes as long as to compute a four-bar.
template <class S> std::size_t state_bytes(const algorithm_row &row, const model &m, const room &wanted);

/// Computes one state.  Returns false, and NaN in all results, where the numbers are not those of the closed mechanism or don't determine
/// a result.
template <class S> bool run_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s);

/// States that the model's plan fits are computed in lanes, the others with pivots of their own.
template <class S> std::size_t batch_bytes(const algorithm_row &row, const model &m, const batch_view<S> &batch);
template <class S>
bool run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first, std::size_t end,
               void *memory);

/// Why run_state has no result; empty if it has one.  Allocates.
template <class S> std::string reason(const algorithm_row &row, const model &m, const state_view<S> &s);

template <class S>
inline constexpr way_calls<S> calls = {refuse,       "a mechanism with loops", false,       state_bytes<S>,
                                       run_state<S>, batch_bytes<S>,           run_batch<S>};

} // namespace ksl::loops
