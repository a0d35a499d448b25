// Ranges of a batch on several threads.
#pragma once

#include <cstddef>
#include <system_error>
#include <thread>
#include <vector>

namespace ksl {

/// Asked once: the answer takes as long as forty states.
inline std::size_t all_cores() {
  static const std::size_t cores = std::thread::hardware_concurrency();
  return cores;
}

/// How n items in whole blocks are dealt out: each part is a range of blocks, the same for any order of execution.
struct partition {
  std::size_t items_each = 0;
  std::size_t parts = 0;

  /// threads 0: all cores.  A part has at least `least` items, since starting a thread costs as much as some hundred states.
  partition(std::size_t n, std::size_t block, std::size_t least, int threads) {
    const std::size_t useful = n / least, cores = threads > 0 ? static_cast<std::size_t>(threads) : all_cores();
    const std::size_t wanted = useful < 1 || cores < 1 ? 1 : useful < cores ? useful : cores;
    const std::size_t blocks = (n + block - 1) / block;
    items_each = (blocks + wanted - 1) / wanted * block;
    parts = items_each ? (n + items_each - 1) / items_each : 0;
  }
};

/// Calls work(part) for all parts, the first on this thread, and so the others where no more threads are to be had.
/// work must not throw.
template <class Work> void on_threads(std::size_t parts, Work work) {
  std::vector<std::thread> others;
  others.reserve(parts);
  std::size_t started = 1;
  try {
    for (; started < parts; ++started)
      others.emplace_back(work, started);
  } catch (const std::system_error &) {
  }
  if (parts)
    work(0);
  for (std::size_t part = started; part < parts; ++part)
    work(part);
  for (std::thread &t : others)
    t.join();
}

} // namespace ksl
