// What computes a row for any model.
#pragma once

#include "engine/loops/algorithms.hpp"

namespace ksl {

/// All ways, in the order of `way`.
template <class S>
inline constexpr const way_calls<S> *all_ways[] = {&kernel_calls::calls<S>, &mimic::calls<S>, &elements::calls<S>,
                                                   &loops::calls<S>};

template <class S> const way_calls<S> &calls_of(const algorithm_row &row, const model &m) {
  return calls_in(all_ways<S>, row, m);
}

/// Throws std::invalid_argument if the algorithm can't be computed for the model.  Kernels compute all algorithms of trees that aren't private.
inline void require_computable(const algorithm_row &row, const model &m) {
  if (m.is_tree_alone() && row.loops != loops_by::plan)
    return;
  for (const way_calls<double> *calls : all_ways<double>)
    calls->refuse(row, m);
}

} // namespace ksl
