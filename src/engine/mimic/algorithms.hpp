// Runs kernels for any model.  Kernels see the expanded mechanism.  If joints follow others (mimic joints), a user's numbers are
// expanded and results are reduced here, and nowhere else.  Mechanisms with loops have algorithms of their own (loops/algorithms.hpp).  For
// other models this costs two comparisons.
#pragma once

#include "engine/run/examine.hpp"
#include "engine/elements/algorithms.hpp"
#include "engine/kernels/kernels.hpp"
#include "engine/loops/algorithms.hpp"
#include "ksl/model.hpp"

namespace ksl {

/// The extents of what a user gives and gets, with requests of so many links and joints.
inline extents extents_of(const model &m, int links, int joints) {
  const loop_view<double> *const loops = m.view().loops;
  return {m.nq(),
          m.nv(),
          links,
          joints,
          m.tree_elements(),
          static_cast<int>(m.links().size()),
          loops ? loops->freedoms : 0};
}
template <class View> extents extents_of(const model &m, const View &view) {
  return extents_of(m, view.links.n, view.joints ? view.joints->n : 0);
}

/// Bytes of the results that the kernels of a row write and the row doesn't have (algorithm_row::variant_of).
inline std::size_t unread_bytes(const algorithm_row &row, const extents &asked) {
  std::size_t bytes = 0;
  for (int r = row.results; row.variant_of && r < row.variant_of->results; ++r)
    bytes += (static_cast<std::size_t>(numbers_of(row.variant_of->result[r], asked)) * sizeof(double) + 63) / 64 * 64;
  return bytes;
}

namespace coupled {

/// Throws std::invalid_argument if the algorithm can't be computed for a model with followers.
void require_projection(const algorithm_row &row, const model &m);

template <class S> std::size_t state_bytes(const algorithm_row &row, const model &m, const extents &asked);
template <class S> void run_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s);
template <class S>
std::size_t run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first,
                      std::size_t end, void *memory);

} // namespace coupled

template <class S> const kernels_in<S> &kernels_of_row(const algorithm_row &row) {
  return in_precision<S>(*(kernels().*row.kernels));
}

/// Throws std::invalid_argument if the algorithm can't be computed for the model: for one with followers, or with loops.
inline void require_computable(const algorithm_row &row, const model &m) {
  coupled::require_projection(row, m);
  loops::require_closed(row, m);
  elements::require_possible(row, m);
}

/// Computes states of a batch, as a batch_kernel does.
template <class S>
batch_outcome run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first,
                        std::size_t end, void *memory) {
  if (loops::is_closed(row, m))
    return loops::run_batch<S>(row, m, batch, first, end, memory);
  if (elements::act_in(row, m))
    return elements::run_batch<S>(row, m, batch, first, end, memory);
  if (m.followers())
    return {coupled::run_batch<S>(row, m, batch, first, end, memory),
            ordinary_results(row, m, batch, first, memory ? end : first)};
  return kernels_of_row<S>(row).batch(m.view_in<S>(), batch, first, end, memory);
}

} // namespace ksl
