// The threads that batches are dealt out to: made when first needed, asleep between calls.
#include "batch/threads.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <exception>
#include <mutex>
#include <new>
#include <pthread.h>
#include <thread>
#include <vector>

namespace ksl {
namespace {

/// What one call wants done; lives on the caller's stack.
struct job {
  const partition &parts;
  part_function work;
  void *context;
  std::atomic<std::size_t> next{0};    ///< part
  std::size_t seats = 1;               ///< taken; the first is the caller's
  std::atomic<std::size_t> helpers{0}; ///< at work, besides the caller
  job *other = nullptr;                ///< that is open too

  bool has_room() const { return seats < parts.threads && next.load(std::memory_order_relaxed) < parts.parts; }
  bool take_part(std::size_t seat) {
    const std::size_t part = next.fetch_add(1, std::memory_order_relaxed), first = part * parts.items_each;
    if (part >= parts.parts)
      return false;
    work(context, first, std::min(parts.items, first + parts.items_each), seat);
    return true;
  }
};

/// How long a thread looks for work, or a caller for the last part, before it sleeps: waking up takes as long.
constexpr std::chrono::microseconds patience{100};

/// Whoever shares the core goes first: it may be the one that is waited for.
template <class Done> void look_out(Done done) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!done() && std::chrono::steady_clock::now() < end)
    std::this_thread::yield();
}

/// Whoever calls works too, and could do all of it: nothing is lost but time where no more threads are to be had, where
/// others keep them busy, or where a part deals out work of its own.
class pool {
public:
  void run(job &j) noexcept {
    open(j);
    while (j.take_part(0)) {
    }
    close(j);
    const auto alone = [&] { return j.helpers.load(std::memory_order_relaxed) == 0; };
    look_out(alone);
    std::unique_lock<std::mutex> lock(mutex_); // helpers touch the job for the last time while they hold it
    left_.wait(lock, alone);
  }

  /// Ends the threads.  Calls that come later are done by their callers.
  void stop() noexcept {
    std::vector<std::thread> workers;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stopping_ = true;
      posts_.fetch_add(1, std::memory_order_relaxed);
      workers.swap(workers_);
    }
    posted_.notify_all();
    for (std::thread &t : workers)
      t.join();
  }

private:
  void open(job &j) {
    std::size_t wake;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      hire(j.parts.threads - 1);
      j.other = open_;
      open_ = &j;
      posts_.fetch_add(1, std::memory_order_relaxed);
      wake = std::min(sleeping_, j.parts.threads - 1);
    }
    for (; wake; --wake)
      posted_.notify_one();
  }

  /// Nobody joins it any more.
  void close(job &j) {
    const std::lock_guard<std::mutex> lock(mutex_);
    job **at = &open_;
    while (*at != &j)
      at = &(*at)->other;
    *at = j.other;
  }

  /// Signals are the caller's: an interrupt must find the thread that waits for it.
  void hire(std::size_t wanted) {
    if (stopping_ || workers_.size() >= wanted)
      return;
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    try {
      while (workers_.size() < wanted)
        workers_.emplace_back(&pool::work, this);
    } catch (const std::exception &) { // no more threads or memory: so many, then
    }
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }

  void work() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (!stopping_) {
      job *j = open_;
      while (j && !j->has_room())
        j = j->other;
      if (!j) {
        wait(lock);
        continue;
      }
      const std::size_t seat = j->seats++;
      ++j->helpers;
      lock.unlock();
      while (!stopping_.load(std::memory_order_relaxed) && j->take_part(seat)) {
      }
      lock.lock();
      if (--j->helpers == 0)
        left_.notify_all();
    }
  }

  /// Until something is posted.
  void wait(std::unique_lock<std::mutex> &lock) {
    const unsigned seen = posts_.load(std::memory_order_relaxed);
    const auto news = [&] { return posts_.load(std::memory_order_relaxed) != seen; };
    lock.unlock();
    look_out(news);
    lock.lock();
    ++sleeping_;
    posted_.wait(lock, news);
    --sleeping_;
  }

  std::mutex mutex_;
  std::condition_variable posted_, left_;
  std::vector<std::thread> workers_;
  job *open_ = nullptr;
  std::atomic<unsigned> posts_{0};
  std::size_t sleeping_ = 0;
  std::atomic<bool> stopping_{false};
};

/// Is never destroyed: a thread may still call while the program ends.
alignas(pool) unsigned char memory[sizeof(pool)];
pool &threads_kept() { return *std::launder(reinterpret_cast<pool *>(memory)); }

/// The child of a fork has none of its parent's threads, and locks that nobody will ever open: it begins anew.
void begin() { new (memory) pool; }

/// From when the library is loaded to when it is unloaded, or the program ends: no thread may outlive its code.
const struct lifetime {
  lifetime() {
    begin();
    pthread_atfork(nullptr, nullptr, begin);
  }
  ~lifetime() { threads_kept().stop(); }
} of_the_library;

} // namespace

std::size_t all_cores() {
  static const std::size_t cores = std::thread::hardware_concurrency();
  return cores;
}

partition::partition(std::size_t n, std::size_t block, std::size_t least, int most, std::size_t parts_each) : items(n) {
  const std::size_t cores = most > 0 ? static_cast<std::size_t>(most) : all_cores(), useful = n / least;
  threads = std::max<std::size_t>(1, std::min(useful, cores));
  const std::size_t blocks = (n + block - 1) / block;
  const std::size_t wanted = threads == 1 ? 1 : threads * parts_each;
  items_each = (blocks + wanted - 1) / wanted * block;
  parts = items_each ? (n + items_each - 1) / items_each : 0;
}

void on_threads(const partition &parts, part_function work, void *context) noexcept {
  job j{parts, work, context};
  threads_kept().run(j);
}

} // namespace ksl
