#include "batch/compute_batch.hpp"

#include "batch/threads.hpp"
#include "engine/mimic/algorithms.hpp"
#include "engine/states/one_state.hpp"
#include "text/rounding.hpp"
#include "engine/states/thread_memory.hpp"

#include <atomic>

namespace ksl {
namespace {

/// The batch without the inputs and results that the row doesn't name.
template <class S> batch_view<S> as_row_names(const algorithm_row &row, const batch_view<S> &given) {
  batch_view<S> batch = given;
  for (input x : {input::v, input::a, input::tau, input::q1, input::fraction})
    if (!row.reads(x))
      input_of(batch, x) = {};
  if (row.external == external_use::none)
    batch.external_n = 0;
  if (row.request != request_kind::reactions)
    batch.reactions_n = 0;
  for (int r = row.results; r < most_results; ++r)
    batch.result[r] = {};
  return batch;
}

/// Is an algorithm that asks for one link or two given fewer?
bool lacks_link(const algorithm_row &row, const model &m, const link_list &links) {
  return links.n < least_links(row.request) || (links_are_few(row) && links.n > m.view().links);
}

template <class S> bool compute_one(const algorithm_row &row, const model &m, const batch_view<S> &batch,
                                    std::size_t k) {
  const bool closed = loops::is_closed(row, m), forced = elements::act_in(row, m), // or both
      direct = m.followers() == 0 && !closed && !forced;
  const kernels_in<S> &kernel = kernels_of_row<S>(row);
  const model_view<S> view = m.view_in<S>();
  const std::size_t bytes = closed   ? loops::state_bytes<S>(row, m, loops::room_for(batch))
                            : forced ? elements::state_bytes<S>(row, m, elements::room_for(batch))
                            : direct ? kernel.workspace_bytes(view)
                                     : coupled::state_bytes<S>(row, m, extents_of(m, batch));
  one_state_memory<S> state;
  arena measure(nullptr);
  state.lay_out(measure, row, m, batch, bytes);
  arena memory(thread_memory(kept_for::workspace, measure.used()));
  state.lay_out(memory, row, m, batch, bytes);
  bool ordinary = true;
  if (closed)
    return loops::run_state<S>(row, m, state.workspace, state.load(row, m, batch, k));
  if (forced)
    return elements::run_state<S>(row, m, state.workspace, state.load(row, m, batch, k)) &&
           ordinary_results(row, m, batch, k, k + 1);
  if (direct)
    ordinary = kernel.state(view, state.workspace, state.load(row, m, batch, k));
  else
    coupled::run_state(row, m, state.workspace, state.load(row, m, batch, k));
  return direct && row.needs_mass ? ordinary : ordinary_results(row, m, batch, k, k + 1);
}

} // namespace

template <class S>
bool compute_states(const algorithm_row &row, const model &m, const batch_view<S> &given, std::size_t first,
                    std::size_t end) {
  const batch_view<S> batch = as_row_names(row, given);
  if (first == end || lacks_link(row, m, batch.links))
    return true;
  require_computable(row, m);
  if (end - first == 1)
    return compute_one(row, m, batch, first);
  std::byte *const memory = thread_memory(kept_for::workspace, run_batch(row, m, batch, 0, 0, nullptr).bytes);
  return run_batch(row, m, batch, first, end, memory).ordinary;
}

template <class S>
void compute_batch(const algorithm_row &row, const model &m, const batch_view<S> &given, int threads,
                   arguments_are arguments) {
  const nearest_rounding rounding;
  if (given.n == 0)
    return;
  // now, or the first call whose results are looked at would allocate
  thread_memory(kept_for::workspace, examination_bytes(row, m, given));
  if (given.n == 1) {
    if (!compute_states(row, m, given, 0, given.n))
      examine_states(row, m, given, 0, given.n, arguments);
    return;
  }
  if (lacks_link(row, m, given.links))
    return;
  require_computable(row, m);
  const batch_view<S> batch = as_row_names(row, given);
  const partition parts(batch.n, static_cast<std::size_t>(kernels_of_row<S>(row).lanes),
                        least_states(m.moving_joints()), threads);
  const std::size_t bytes = run_batch(row, m, batch, 0, 0, nullptr).bytes;
  std::byte *memory = thread_memory(kept_for::workspace, bytes * parts.threads);
  std::atomic<bool> ordinary{true};
  on_threads(parts, [&](std::size_t first, std::size_t end, std::size_t seat) {
    if (!run_batch(row, m, batch, first, end, memory + bytes * seat).ordinary)
      ordinary.store(false, std::memory_order_relaxed);
  });
  if (!ordinary.load())
    examine_states(row, m, batch, 0, batch.n, arguments);
}

template void compute_batch(const algorithm_row &, const model &, const batch_view<double> &, int, arguments_are);
template void compute_batch(const algorithm_row &, const model &, const batch_view<float> &, int, arguments_are);
template bool compute_states(const algorithm_row &, const model &, const batch_view<double> &, std::size_t,
                             std::size_t);
template bool compute_states(const algorithm_row &, const model &, const batch_view<float> &, std::size_t, std::size_t);

} // namespace ksl
