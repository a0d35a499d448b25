// Algorithms of models whose joints follow others (mimic joints).  Kernels see the expanded mechanism: a user's numbers are expanded and
// results are reduced here, and nowhere else.
#pragma once

#include "engine/states/ways.hpp"

namespace ksl::mimic {

/// Throws std::invalid_argument if the algorithm can't be computed for a model with followers.
void refuse(const algorithm_row &row, const model &m);

template <class S> std::size_t state_bytes(const algorithm_row &row, const model &m, const room &wanted);
template <class S> bool run_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s);
template <class S> std::size_t batch_bytes(const algorithm_row &row, const model &m, const batch_view<S> &batch);
template <class S>
bool run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first, std::size_t end,
               void *memory);

template <class S>
inline constexpr way_calls<S> calls = {refuse,       nullptr,        true,        state_bytes<S>,
                                       run_state<S>, batch_bytes<S>, run_batch<S>};

/// Of trees without force elements.
template <class S> inline constexpr const way_calls<S> *ways[] = {&kernel_calls::calls<S>, &calls<S>};

} // namespace ksl::mimic
