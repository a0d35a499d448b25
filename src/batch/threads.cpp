// The pool of worker threads for batches.  They are created when first needed and sleep between calls.
//
//     caller                                          worker
//     open: the job is on the list; wake              sleeps on posted_, after it has polled for a while
//     take_part(0), take_part(0), …                   takes a seat:  ++helpers                    (under the mutex)
//                                                     take_part(seat), take_part(seat), …
//     close: it is off the list; no more seats        none is left:  --helpers, wakes the caller  (under the mutex)
//     waits until helpers is 0, and returns
//
// A job lies on the caller's stack.  Workers find it on the list alone, and touch it between ++helpers and --helpers only, so that it is theirs for no
// longer than the caller waits.  Parts are dealt out by one counter; its order is relaxed, since what parts write is published by the mutex at the end.
#include "batch/threads.hpp"

#include "batch/cores.hpp"
#include "text/rounding.hpp"

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

/// The work of one call; lives on the caller's stack.
struct job {
  const partition &parts;
  part_function work;
  void *context;
  std::atomic<std::size_t> next{0};    ///< number of the next part to be computed
  std::size_t seats = 1;               ///< seats taken so far; seat 0 is the caller's
  std::atomic<std::size_t> helpers{0}; ///< worker threads at work on it, the caller not counted
  job *other = nullptr;                ///< next job in the list of open ones

  bool has_room() const { return seats < parts.threads && next.load(std::memory_order_relaxed) < parts.parts; }
  bool take_part(std::size_t seat) {
    const std::size_t part = next.fetch_add(1, std::memory_order_relaxed), first = part * parts.items_each;
    if (part >= parts.parts)
      return false;
    work(context, first, std::min(parts.items, first + parts.items_each), seat);
    return true;
  }
};

/// How long a thread polls for work, or a caller for the last part, before it sleeps.  Waking up takes about as long.
constexpr std::chrono::microseconds patience{100};

/// Polls until done() or until patience is over.  Yields the core to other threads, since one of them may be the one that is
/// waited for.
template <class Done> void look_out(Done done) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!done() && std::chrono::steady_clock::now() < end)
    std::this_thread::yield();
}

/// Where the system refuses a thread, how many calls go on with the threads that there are before it is asked again.
constexpr std::size_t calls_after_refusal = 100;

/// While it lives, its thread blocks all signals, and threads that it makes inherit that.  Windows has none that threads receive.
class no_signals {
#if !defined(_WIN32)
public:
  no_signals() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~no_signals() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  no_signals(const no_signals &) = delete;
  no_signals &operator=(const no_signals &) = delete;

private:
  sigset_t before_{};
#endif
};

/// The calling thread works too and can compute all parts alone.  So a call also completes if no threads can be created, if
/// all of them are busy with other calls, or if a part makes a call of its own.
class pool {
public:
  void run(job &j) noexcept {
    open(j);
    while (j.take_part(0)) {
    }
    close(j);
    const auto alone = [&] { return j.helpers.load(std::memory_order_relaxed) == 0; };
    look_out(alone);
    std::unique_lock<std::mutex> lock(mutex_); // helpers access the job for the last time while they hold the mutex
    left_.wait(lock, alone);
  }

  /// Ends the threads.  Later calls are computed by their callers alone.
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
    const std::size_t others = j.parts.threads - 1;
    std::size_t wake;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      hire(others);
      j.other = open_;
      open_ = &j;
      posts_.fetch_add(1, std::memory_order_relaxed);
      wake = std::min(sleeping_, others);
    }
    for (; wake; --wake)
      posted_.notify_one();
  }

  /// Takes a job off the list: no further workers may take parts of it.
  void close(job &j) {
    const std::lock_guard<std::mutex> lock(mutex_);
    job **at = &open_;
    while (*at != &j)
      at = &(*at)->other;
    *at = j.other;
  }

  /// Creates threads up to the number wanted.  They block all signals, so that an interrupt is delivered to the thread of the
  /// program that waits for it.  Where the system refuses one, it is asked again after many calls only, since asking costs as much as
  /// a small batch.
  void hire(std::size_t wanted) {
    if (stopping_ || workers_.size() >= wanted)
      return;
    if (calls_until_next_try_ > 0) {
      --calls_until_next_try_;
      return;
    }
    [[maybe_unused]] const no_signals blocked;
    try {
      while (workers_.size() < wanted)
        workers_.emplace_back(&pool::work, this);
    } catch (const std::exception &) { // no more threads or memory: go on with those there are
      calls_until_next_try_ = calls_after_refusal;
    }
  }

  void work() {
    const nearest_rounding rounding; // a new thread has the mode of the one that created it
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

  /// Waits until a job is posted.
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
  std::size_t sleeping_ = 0, calls_until_next_try_ = 0;
  std::atomic<bool> stopping_{false};
};

/// The pool is never destroyed, since a thread may still make a call while the program ends.
alignas(pool) unsigned char memory[sizeof(pool)];
pool &threads_kept() { return *std::launder(reinterpret_cast<pool *>(memory)); }

/// Constructs the pool.  A forked child has none of its parent's threads, and a mutex that may stay locked for ever, so it
/// constructs a new pool in place.
void begin() { new (memory) pool; }

/// Exists from when the library is loaded to when it is unloaded or the program ends.  It ends the threads then, since no
/// thread may outlive its code.
const struct lifetime {
  lifetime() {
    begin();
    pthread_atfork(nullptr, nullptr, begin);
  }
  ~lifetime() { threads_kept().stop(); }
} of_the_library;

} // namespace

namespace {

std::atomic<std::size_t> assumed_cores{0};

/// While it lives, its thread isn't cancelled: helpers write to a job, which a thread that is cancelled while it waits for them would leave.
/// The thread ends at the next place after the call.
class uncancelled {
public:
  uncancelled() { pthread_setcancelstate(PTHREAD_CANCEL_DISABLE, &before_); }
  ~uncancelled() { pthread_setcancelstate(before_, nullptr); }
  uncancelled(const uncancelled &) = delete;
  uncancelled &operator=(const uncancelled &) = delete;

private:
  int before_ = PTHREAD_CANCEL_ENABLE;
};

constexpr std::size_t quotient_up(std::size_t n, std::size_t by) { return n / by + (n % by != 0); }

} // namespace

void assume_cores(std::size_t cores) noexcept { assumed_cores.store(cores, std::memory_order_relaxed); }

std::size_t all_cores() noexcept {
  static const std::size_t cores = [] {
    const uncancelled held; // files are read
    return cores_of_process();
  }();
  const std::size_t assumed = assumed_cores.load(std::memory_order_relaxed);
  return assumed ? assumed : cores;
}

partition::partition(std::size_t n, std::size_t block, std::size_t least, int most, std::size_t parts_each) : items(n) {
  // more threads than cores gain nothing, and would stay
  const std::size_t cores = all_cores(), useful = n / least;
  threads = std::max<std::size_t>(1, std::min({useful, cores, most > 0 ? static_cast<std::size_t>(most) : cores}));
  // of 100 states in blocks of 8, for two threads with four parts each: 13 blocks, two in a part, and so seven parts, the last of four states
  const std::size_t blocks = quotient_up(n, block);
  const std::size_t wanted = threads == 1 ? 1 : threads * parts_each;
  items_each = quotient_up(blocks, wanted) * block;
  parts = items_each ? quotient_up(n, items_each) : 0;
}

void on_threads(const partition &parts, part_function work, void *context) noexcept {
  const uncancelled held;
  const nearest_rounding rounding;
  job j{parts, work, context};
  threads_kept().run(j);
}

} // namespace ksl
