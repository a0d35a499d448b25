// Runs ranges of a batch on several threads.  The threads are kept from call to call.
//
// A part is the unit of work; a seat is the number of the thread that computes it, by which it finds a workspace that no other uses.
#pragma once

#include <cstddef>

namespace ksl {

/// Number of cores that the process may use (cores.hpp).  The system is asked once, since the query takes as long as computing
/// thousands of states.
std::size_t all_cores() noexcept;

/// Sets the result of all_cores() from now on; 0 restores what the system says.  For tests, which need more threads than a small machine
/// has cores.
void assume_cores(std::size_t cores) noexcept;

/// How n items are divided into parts.  A part is a range of whole blocks, so that the parts do not depend on the order in
/// which they are executed.
struct partition {
  std::size_t items = 0;
  std::size_t items_each = 0; ///< in a part; the last part may have fewer
  std::size_t parts = 0;
  std::size_t threads = 1; ///< at most this many work on it

  /// n items in blocks of `block`.  threads: the most to use; 0, or more than all_cores(), is all cores.  A thread gets
  /// at least `least` items, about ten microseconds of work, which is what waking it costs.  There are `parts_each`
  /// parts for each thread, so that the others can take over from a thread that is descheduled.
  partition(std::size_t n, std::size_t block, std::size_t least, int threads, std::size_t parts_each = 4);
};

/// How many states make another thread worthwhile, in any algorithm.  Inverse dynamics, the fastest, takes about 10 ns for a
/// joint.
constexpr std::size_t least_states(int moving_joints) {
  return 64 + 4096 / (1 + static_cast<std::size_t>(moving_joints));
}

/// Computes one part, the items [first, end).  `seat` is the number of the executing thread within this call, less than
/// partition::threads; no two threads at work have the same.
using part_function = void (*)(void *context, std::size_t first, std::size_t end, std::size_t seat);

/// Calls work(first, end, seat) for all parts, on this thread and on idle worker threads.  Returns when all parts are done.
/// May be called by several threads at once, and from within work.  work must not throw.
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
