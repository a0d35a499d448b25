// Ranges of a batch on several threads, which are kept from call to call.
#pragma once

#include <cstddef>

namespace ksl {

/// Asked once: the answer takes as long as forty states.
std::size_t all_cores();

/// How n items in whole blocks are dealt out: parts are ranges of blocks, the same for any order of execution.
struct partition {
  std::size_t items = 0;
  std::size_t items_each = 0; ///< in a part; the last one has what is left
  std::size_t parts = 0;
  std::size_t threads = 1; ///< at most so many work on it

  /// threads 0: all cores.  A thread has at least `least` items, the work of some ten microseconds: what waking it costs.
  /// Each gets several parts, so that one which other programs hold up does not hold up all.
  partition(std::size_t n, std::size_t block, std::size_t least, int threads, std::size_t parts_each = 4);
};

/// States that are worth another thread, in any algorithm: inverse dynamics, the fastest, takes about 10 ns for a joint.
constexpr std::size_t least_states(int moving_joints) { return 64 + 4096 / (1 + static_cast<std::size_t>(moving_joints)); }

/// One part: the items [first, end) of it, on a thread that has a seat of its own below partition::threads.
using part_function = void (*)(void *context, std::size_t first, std::size_t end, std::size_t seat);

/// Calls work(first, end, seat) for all parts, on this thread and on others that have nothing to do; returns when all are
/// done.  May be called by several threads at once, and from within work.  work must not throw.
void on_threads(const partition &parts, part_function work, void *context) noexcept;

template <class Work> void on_threads(const partition &parts, Work work) {
  if (parts.threads < 2) {
    if (parts.items)
      work(std::size_t(0), parts.items, std::size_t(0));
    return;
  }
  const part_function call = [](void *context, std::size_t first, std::size_t end, std::size_t seat) {
    (*static_cast<Work *>(context))(first, end, seat);
  };
  on_threads(parts, call, &work);
}

} // namespace ksl
