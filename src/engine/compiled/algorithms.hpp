// Batches by code that was compiled for the model alone (states/machine_code.hpp).  For one state the ways below are as fast: a call of the
// code for one state would gain some 40 ns, where Python's own call takes 500.
//
// Results have the bits of the ways below, and what the code can't compute is computed by them.
#pragma once

#include "engine/loops/algorithms.hpp"
#include "engine/states/machine_code.hpp"

namespace ksl::compiled {

/// Does a kernel write a result past the caches (ksl/engine/lanes/transpose.hpp)?
template <class S> bool is_streamed(const algorithm_row &row, const model &m, const batch_view<S> &batch);

/// Does the model have code that answers the batch?  Results that kernels write past the caches are left to them: such arrays take more time to
/// write than to compute, and the code writes through the caches.
template <class S> bool answers(const algorithm_row &row, const model &m, const batch_view<S> &batch) {
  return m.code() && m.code()->find(row, batch) && !is_streamed(row, m, batch);
}

/// As those of way_calls, for a batch that is answered; below: what computes the row otherwise.
template <class S>
std::size_t batch_bytes(const way_calls<S> &below, const algorithm_row &row, const model &m,
                        const batch_view<S> &batch);
template <class S>
bool run_batch(const way_calls<S> &below, const algorithm_row &row, const model &m, const batch_view<S> &batch,
               std::size_t first, std::size_t end, void *memory);

/// Derivatives of a batch along a closed mechanism, as loops::derive_in_lanes: by code, if the model has some.
void derive_in_lanes(bool forward, const model &m, const batch_view<double> &batch, unsigned char *done);

} // namespace ksl::compiled
