// Runs an algorithm on many states: one state in each lane, ranges of states on several threads.
#pragma once

#include "engine/run/examine.hpp"
#include "ksl/model.hpp"

#include <cstddef>

namespace ksl {

/// Runs an algorithm on the states of a batch, on at most `threads` threads (0: all cores).  Inputs that the row doesn't name
/// are taken as zero, and results that it doesn't name are not written.  Throws std::bad_alloc, std::runtime_error for an unusable
/// KSL_ISA, std::invalid_argument for an algorithm that robots with mimic joints don't have, and result_error if results are not
/// finite although the arguments are; nothing else.
template <class S>
void compute_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, int threads,
                   arguments_are given = arguments_are::unchecked);

/// Runs it on the states [first, end) of the batch, on the calling thread.  Returns whether the results are ordinary, instead of
/// throwing result_error.
template <class S>
bool compute_states(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first,
                    std::size_t end);

} // namespace ksl
