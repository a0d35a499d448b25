// The pool of threads where things go wrong or end: the system gives no thread, calls end in another order than they began, and a
// call while the program ends.  A program of its own, since it takes the place of pthread_create.
#include "ksl/batch.hpp"
#include "robots.hpp"
#include "sanitizer.hpp"

#include "batch/threads.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <dlfcn.h>
#include <pthread.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace {

/// How often each of n items is computed, one in a part.
std::vector<int> counts(std::size_t n, int threads) {
  std::vector<std::atomic<int>> times(n);
  ksl::partition parts(n, 1, 1, threads, 1);
  parts.threads = static_cast<std::size_t>(threads), parts.items_each = 1,
  parts.parts = n; // whatever number of cores there is
  ksl::on_threads(parts, [&](std::size_t first, std::size_t end, std::size_t seat) {
    for (std::size_t k = first; k < end; ++k)
      times[k] += seat < parts.threads ? 1 : 1000;
  });
  return {times.begin(), times.end()};
}

} // namespace

namespace {
std::atomic<int> taken{0}; ///< threads that the system gave; none are counted under the sanitizer
} // namespace

#ifndef KSL_TEST_THREAD_SANITIZER
namespace {
std::atomic<bool> no_threads{false};
std::atomic<int> refused{0}; ///< threads that it didn't give
} // namespace

extern "C" int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*start)(void *),
                              void *argument) {
  if (no_threads) {
    ++refused;
    return EAGAIN;
  }
  using create = int (*)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
  static const create of_the_system = reinterpret_cast<create>(dlsym(RTLD_NEXT, "pthread_create"));
  ++taken;
  return of_the_system(thread, attributes, start, argument);
}

TEST_CASE("where the system gives no thread, the caller computes all, with the same bits") {
  const ksl::model m = ksl::load(every_kind_file);
  const std::size_t n = 3000, nq = static_cast<std::size_t>(m.nq()), nv = static_cast<std::size_t>(m.nv());
  std::vector<double> q(n * nq), v(n * nv, 0.3), alone(n * nv), many(n * nv);
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t i = 0; i < nq; ++i)
      q[k * nq + i] = 0.1 + std::sin(static_cast<double>(k + 7 * i));
    robots::normalize_quaternions(m, &q[k * nq]);
  }
  ksl::batch_view<double> batch;
  batch.n = n, batch.q = {q.data(), m.nq()}, batch.v = batch.a = {v.data(), m.nv()};
  batch.result[0] = {alone.data(), m.nv()};
  ksl::inverse_dynamics_batch(m, batch, 1);
  no_threads = true;
  batch.result[0] = {many.data(), m.nv()};
  ksl::inverse_dynamics_batch(m, batch, 2);
  CHECK(many == alone);
  CHECK(counts(100, 41) == std::vector<int>(100, 1)); // more than other tests have taken
  CHECK(refused > 0);
  no_threads = false;
  const int before = taken;
  for (int call = 0; call < 200 && taken == before; ++call) // the system is asked again, but not at each call
    CHECK(counts(100, 41) == std::vector<int>(100, 1));
  CHECK(taken > before);
}
#endif

TEST_CASE("as many threads as are wanted work at the same time") {
  for (int k = 0; k < 200; ++k) // where a thread was refused, the system isn't asked again for some calls
    counts(2, 2);
  alarm(60); // for ever, if a thread is missing
  for (const std::size_t threads : {2u, 3u, 12u, 12u}) {
    ksl::partition parts(threads, 1, 1, 1, 1);
    parts.threads = parts.parts = threads, parts.items_each = 1;
    std::atomic<std::size_t> inside{0};
    ksl::on_threads(parts, [&](std::size_t, std::size_t, std::size_t) { // no part ends before all have begun
      ++inside;
      while (inside < threads)
        std::this_thread::yield();
    });
    CHECK(inside == threads);
  }
  alarm(0);
}

TEST_CASE("parts are whole blocks, some for each thread, none without work") {
  ksl::assume_cores(4);
  const auto check = [](const ksl::partition &p, std::size_t threads, std::size_t each, std::size_t parts) {
    CHECK((p.threads == threads && p.items_each == each && p.parts == parts));
  };
  check({1000, 8, 10, 0}, 4, 64, 16); // 125 blocks, 16 parts of 8
  check({1000, 8, 10, 3}, 3, 88, 12);
  check({1000, 8, 10, 1}, 1, 1000, 1);
  check({1000, 8, 10, 9, 1}, 4, 256, 4);
  check({30, 8, 10, 0}, 3, 8, 4); // 10 states for each thread
  check({5, 8, 10, 0}, 1, 8, 1);
  check({0, 8, 10, 0}, 1, 0, 0);
  ksl::assume_cores(0);
}

TEST_CASE("idle threads take no more seats than a call has") {
  constexpr std::size_t many = 12, parts_n = 400;
  const auto of = [](std::size_t threads, std::size_t n) {
    ksl::partition p(n, 1, 1, 1, 1);
    p.threads = threads, p.parts = n, p.items_each = 1;
    return p;
  };
  const ksl::partition outer = of(many, many), inner = of(2, parts_n);
  std::atomic<std::size_t> inside{0}, ended{0}, most_seat{0};
  alarm(60);
  ksl::on_threads(outer, [&](std::size_t first, std::size_t, std::size_t) {
    ++inside;
    while (inside < many) // all threads are at work
      std::this_thread::yield();
    if (first == 0)
      ksl::on_threads(inner, [&](std::size_t, std::size_t, std::size_t seat) {
        while (ended < many - 1) // and then look for other work
          std::this_thread::yield();
        for (std::size_t most = most_seat; most < seat && !most_seat.compare_exchange_weak(most, seat);) {
        }
        std::this_thread::yield();
      });
    else
      ++ended;
  });
  alarm(0);
  CHECK(most_seat <= 1);
}

TEST_CASE("calls may end in another order than they began") {
  std::atomic<bool> first_ended{false}, second_runs{false};
  std::atomic<int> parts_of_second{0};
  std::thread other;
  ksl::partition parts(2, 1, 1, 2, 1);
  ksl::on_threads(parts, [&](std::size_t first, std::size_t, std::size_t) {
    if (first == 0)
      other = std::thread([&] {
        ksl::on_threads(parts, [&](std::size_t begin, std::size_t end, std::size_t) {
          parts_of_second += static_cast<int>(end - begin);
          second_runs = true;
          while (!first_ended)
            std::this_thread::yield();
        });
      });
    while (!second_runs) // both parts end while the second call is open
      std::this_thread::yield();
  });
  first_ended = true;
  other.join();
  CHECK(parts_of_second == 2);
}

/// After the library has ended its threads: the caller computes all.
__attribute__((destructor)) static void call_at_the_end() {
  const int before = taken;
  if (counts(50, 60) != std::vector<int>(50, 1) || taken != before) {
    std::fputs("a call while the program ends lost parts, or began a thread\n", stderr);
    _exit(1);
  }
}
