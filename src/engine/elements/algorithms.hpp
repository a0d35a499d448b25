// Algorithms of models with force elements: kernels of the tree, with the forces of elements as external wrenches and with what derivatives and
// energies need besides.  Loops that the tree carries are left open.
#pragma once

#include "engine/mimic/algorithms.hpp"

namespace ksl::elements {

/// Throws std::invalid_argument if the algorithm can't be computed for a model with force elements.
void refuse(const algorithm_row &row, const model &m);

/// run_state returns false if an element has no force there, or if the kernel does.
template <class S> std::size_t state_bytes(const algorithm_row &row, const model &m, const room &wanted);
template <class S> bool run_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s);
template <class S> std::size_t batch_bytes(const algorithm_row &row, const model &m, const batch_view<S> &batch);
template <class S>
bool run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first, std::size_t end,
               void *memory);

template <class S>
inline constexpr way_calls<S> calls = {
    refuse, "a mechanism with force elements", false, state_bytes<S>, run_state<S>, batch_bytes<S>, run_batch<S>};

/// Of trees, and of those that carry loops, left open.
template <class S>
inline constexpr const way_calls<S> *ways[] = {&kernel_calls::calls<S>, &mimic::calls<S>, &calls<S>};

} // namespace ksl::elements
