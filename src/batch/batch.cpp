#include "batch/compute_batch.hpp"

#include "batch/threads.hpp"
#include "engine/kernels/one_state.hpp"
#include "engine/run/all_ways.hpp"
#include "engine/states/ordinary_results.hpp"
#include "engine/states/thread_memory.hpp"
#include "text/rounding.hpp"

#include <atomic>

// A call of compute_batch is cut into parts of whole blocks, a block being as many states as a kernel has lanes (threads.hpp):
//
//     states       |  block  |  block  |  block  |  block  |  … |rest|
//     parts        |─────── part 0 ────|─────── part 1 ────|  …
//     workspaces   memory + 0 bytes, memory + bytes, …           one for each seat, that is for each thread at work
//
// The workspaces are in one piece of memory that the calling thread keeps, so that the second call of its kind allocates nothing.  Blocks begin at the
// same states on any number of threads, and results have the same bits.

namespace ksl {
namespace {

/// Is an algorithm that asks for one link or two given fewer?
bool lacks_link(const algorithm_row &row, const model &m, const link_list &links) {
  return links.n < least_links(row.request) || (links_are_few(row) && links.n > m.view().links);
}

/// Memory of one state: that of its way, and a copy of its numbers.
template <class S> struct memory_of_one {
  void *workspace;
  copied_state<S> state;
  memory_of_one(arena &memory, const algorithm_row &row, const batch_view<S> &batch, const extents &of,
                std::size_t bytes)
      : workspace(memory.take<std::byte>(static_cast<std::ptrdiff_t>(bytes))), state() {
    state.lay_out(memory, computed(row), of, batch);
  }
};

template <class S> bool compute_one(const algorithm_row &row, const model &m, const batch_view<S> &batch,
                                    std::size_t k) {
  const way_calls<S> &calls = calls_of<S>(row, m);
  const extents of = extents_of(m, batch);
  const std::size_t bytes = calls.state_bytes(row, m, room_for(batch));
  arena measure;
  const memory_of_one<S> measured(measure, row, batch, of, bytes);
  arena pieces(thread_memory(kept_for::workspace, measure.used()));
  const memory_of_one<S> one(pieces, row, batch, of, bytes);
  return calls.run_state(row, m, one.workspace, one.state.load(computed(row), of, batch, k)) &&
         (calls.looks_at_all || row.needs_mass || ordinary_results(row, m, batch, k, k + 1));
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
  return run_part_of_batch(row, m, batch, first, end,
                           thread_memory(kept_for::workspace, bytes_of_batch(row, m, batch)));
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
  const std::size_t bytes = bytes_of_batch(row, m, batch);
  std::byte *memory = thread_memory(kept_for::workspace, bytes * parts.threads);
  // whether all results are finite, as far as a sum tells; only if not, the states are looked at one by one, for a message
  std::atomic<bool> ordinary{true};
  on_threads(parts, [&](std::size_t first, std::size_t end, std::size_t seat) {
    if (!run_part_of_batch(row, m, batch, first, end, memory + bytes * seat))
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
