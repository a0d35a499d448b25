// What computes a row for any model.
#pragma once

#include "engine/compiled/algorithms.hpp"

#include <iterator>

namespace ksl {

/// All ways, in the order of `way`.
template <class S>
inline constexpr const way_calls<S> *all_ways[] = {&kernel_calls::calls<S>, &mimic::calls<S>, &elements::calls<S>,
                                                   &loops::calls<S>};

template <class S> const way_calls<S> &calls_of(const algorithm_row &row, const model &m) {
  return calls_in(all_ways<S>, row, m);
}

/// Bytes and results of a batch: by code that was compiled for the model, if it answers, and otherwise by the way of row and model.
template <class S> std::size_t bytes_of_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch) {
  const way_calls<S> &calls = calls_of<S>(row, m);
  return compiled::answers(row, m, batch) ? compiled::batch_bytes(calls, row, m, batch)
                                          : calls.batch_bytes(row, m, batch);
}
template <class S>
bool run_part_of_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first,
                       std::size_t end, void *memory) {
  const way_calls<S> &calls = calls_of<S>(row, m);
  return compiled::answers(row, m, batch) ? compiled::run_batch(calls, row, m, batch, first, end, memory)
                                          : calls.run_batch(row, m, batch, first, end, memory);
}

/// Throws std::invalid_argument if the algorithm can't be computed for the model.
inline void require_computable(const algorithm_row &row, const model &m) {
  if (row.mimic != mimic_by::refusal && row.elements != elements_by::refusal && row.loops != loops_by::refusal &&
      row.loops != loops_by::plan)
    return;
  for (std::size_t i = std::size(all_ways<double>);
       i-- > 0;) // what the highest way refuses doesn't depend on those below
    all_ways<double>[i]->refuse(row, m);
}

} // namespace ksl
