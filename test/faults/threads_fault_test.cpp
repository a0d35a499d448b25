// Threads that can't be created, the cores that a process may use, and programs that end while threads compute.
#include "../engine/allocation.hpp"
#include "../engine/robots.hpp"
#include "../engine/sanitizer.hpp"
#include "batch/cores.hpp"
#include "batch/threads.hpp"

#include "ksl/batch.hpp"
#include "ksl/dynamics.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <dirent.h>
#include <dlfcn.h>
#include <filesystem>
#include <fstream>
#include <new>
#include <pthread.h>
#include <sched.h>
#include <string>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace {

[[maybe_unused]] std::atomic<int> threads_allowed{INT_MAX}, threads_asked{0};

std::atomic<bool> affinity_is_known{true};
[[maybe_unused]] std::atomic<bool> keys_have_room{true};
std::atomic<bool> waits_for_late_batch{false}, key_is_deleted{false}, late_batch_is_done{false};

} // namespace

#ifdef KSL_TEST_THREAD_SANITIZER
/// A thread that has ended, and that nobody has joined yet when the program exits, is no leak here.
extern "C" const char *__tsan_default_options() { return "report_thread_leaks=0"; }
#endif

#ifndef KSL_TEST_THREAD_SANITIZER
/// As many threads as allowed; then the system has no more.
extern "C" int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*begin)(void *),
                              void *argument) {
  using function = int (*)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
  static const function create = reinterpret_cast<function>(dlsym(RTLD_NEXT, "pthread_create"));
  ++threads_asked;
  return threads_allowed-- > 0 ? create(thread, attributes, begin, argument) : EAGAIN;
}
#endif

/// A kernel for more cores than a caller has bits for refuses the question.
extern "C" int sched_getaffinity(pid_t process, std::size_t size, cpu_set_t *set) noexcept {
  static const auto real =
      reinterpret_cast<int (*)(pid_t, std::size_t, cpu_set_t *)>(dlsym(RTLD_NEXT, "sched_getaffinity"));
  if (affinity_is_known)
    return real(process, size, set);
  errno = EINVAL;
  return -1;
}

#ifndef KSL_TEST_SANITIZER // sanitizers call it before this program is ready
/// The C library allocates for the value of a key in a thread, if the program has many keys.
extern "C" int pthread_setspecific(pthread_key_t key, const void *value) noexcept {
  static const auto real =
      reinterpret_cast<int (*)(pthread_key_t, const void *)>(dlsym(RTLD_NEXT, "pthread_setspecific"));
  return keys_have_room ? real(key, value) : ENOMEM;
}
#endif

/// The library deletes its key while the program ends.  In one test it then waits for a thread's first batch, which
/// needs memory.
extern "C" int pthread_key_delete(pthread_key_t key) {
  static const auto real = reinterpret_cast<int (*)(pthread_key_t)>(dlsym(RTLD_NEXT, "pthread_key_delete"));
  const int status = real(key);
  if (waits_for_late_batch.exchange(false)) {
    key_is_deleted = true;
    for (int tenths = 0; tenths < 300 && !late_batch_is_done; ++tenths)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return status;
}

namespace {

[[maybe_unused]] int threads_of_process() {
  int n = 0;
  if (DIR *const folder = opendir("/proc/self/task")) {
    while (const dirent *const entry = readdir(folder))
      n += entry->d_name[0] != '.';
    closedir(folder);
  }
  return n;
}

/// Runs it in a forked child, which has no threads besides its own and what it makes.  What it returns, or −1.
template <class Work> int in_child(Work work) {
  const pid_t child = fork();
  if (child == 0)
    _exit(work());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

struct batch_of_states {
  ksl::model m = ksl::load(every_kind_file);
  std::size_t n;
  std::vector<double> q, v, expected;

  explicit batch_of_states(std::size_t count)
      : n(count), q(n * static_cast<std::size_t>(m.nq())), v(n * static_cast<std::size_t>(m.nv())) {
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = static_cast<double>(i % 13) - 6.1;
    for (std::size_t i = 0; i < v.size(); ++i)
      v[i] = static_cast<double>(i % 7) - 3.1;
    for (std::size_t k = 0; k < n; ++k)
      robots::normalize_quaternions(m, &q[k * static_cast<std::size_t>(m.nq())]);
    expected = found(1);
  }
  std::vector<double> found(int threads) {
    std::vector<double> tau(v.size());
    ksl::batch_view<double> b;
    b.n = n, b.q = {q.data(), m.nq()}, b.v = b.a = {v.data(), m.nv()}, b.result[0] = {tau.data(), m.nv()};
    ksl::inverse_dynamics_batch(m, b, threads);
    return tau;
  }
};

batch_of_states &states() {
  static batch_of_states s(20'000);
  return s;
}

/// Others, which live on while the program ends and destroys its objects.
batch_of_states &lasting_states() {
  static batch_of_states &s = *new batch_of_states(2'000);
  return s;
}

/// Runs it in a forked child that it ends by std::exit.  The child's status; −1 where it was killed, also after a
/// minute.
template <class Work> int exit_status(Work work) {
  std::fflush(nullptr); // or the child would write what is left in buffers once more
  return in_child([&] {
    alarm(60);
    work();
    return 255; // it did not exit
  });
}

} // namespace

#ifndef KSL_TEST_THREAD_SANITIZER
TEST_CASE("a system that has no more threads: fewer compute the same") {
  states();
  for (const int allowed : {0, 1, 3, 7}) {
    CAPTURE(allowed);
    const int found = in_child([&] {
      ksl::assume_cores(8);
      threads_allowed = allowed;
      const int before = threads_of_process();
      bool same = true;
      for (int call = 0; call < 10; ++call)
        same &= states().found(8) == states().expected;
      return same ? threads_of_process() - before : 99;
    });
    CHECK(found == allowed);
  }
}

TEST_CASE("it is not asked at each call") {
  states();
  const int asked = in_child([] {
    ksl::assume_cores(8);
    threads_allowed = 0, threads_asked = 0;
    for (int call = 0; call < 10; ++call)
      states().found(8);
    return threads_asked.load();
  });
  CHECK(asked == 1);
}
#endif

TEST_CASE("exit while a thread runs batches on several threads: the program ends at once, with its status") {
  lasting_states();
  for (int round = 0; round < 40; ++round) {
    CAPTURE(round);
    const int found = exit_status([&] {
      ksl::assume_cores(4);
      static std::atomic<int> batches{0};
      static std::atomic<bool> same{true};
      std::thread([] {
        for (;; ++batches)
          if (lasting_states().found(4) != lasting_states().expected)
            same = false;
      }).detach();
      while (batches < 2)
        std::this_thread::yield();
      std::this_thread::sleep_for(std::chrono::microseconds(97 * round)); // at another moment of a batch each time
      std::exit(same ? 30 + round : 0);
    });
    CHECK(found == 30 + round);
  }
}

#ifndef KSL_TEST_THREAD_SANITIZER // under it a program was seen not to end that exits while threads begin
TEST_CASE("exit while new threads make their first batches: none of them lacks memory") {
  lasting_states();
  for (int round = 0; round < 10; ++round) {
    CAPTURE(round);
    const int found = exit_status([&] {
      ksl::assume_cores(3);
      static std::atomic<int> threads{0};
      for (int starter = 0; starter < 2; ++starter)
        std::thread([] {
          for (;; ++threads)
            std::thread([] { lasting_states().found(3); }).join();
        }).detach();
      while (threads < 4)
        std::this_thread::yield();
      std::this_thread::sleep_for(std::chrono::microseconds(203 * round));
      std::exit(50 + round);
    });
    CHECK(found == 50 + round);
  }
}
#endif

#ifndef KSL_TEST_SANITIZER
TEST_CASE("a thread whose memory could not be freed at its end gets none, and the error says so") {
  lasting_states();
  std::thread([] {
    keys_have_room = false;
    CHECK_THROWS_AS(lasting_states().found(1), std::bad_alloc);
    keys_have_room = true;
    CHECK(lasting_states().found(1) == lasting_states().expected);
  }).join();
}
#endif

TEST_CASE("a thread's first batch after the library has deleted the key of its memory") {
  lasting_states();
  const int found = exit_status([] {
    static std::atomic<bool> refused{false};
    std::thread([] {
      while (!key_is_deleted)
        std::this_thread::yield();
      const memory_that_is_lost block; // that of the thread, which no key frees any more
      try {
        refused = lasting_states().found(1) != lasting_states().expected;
      } catch (const std::bad_alloc &) {
        refused = true;
      }
      if (refused)
        _exit(1);
      late_batch_is_done = true;
    }).detach();
    waits_for_late_batch = true;
    std::exit(7);
  });
  CHECK(found == 7);
}

TEST_CASE("no more threads than the process may use cores, whatever is asked for") {
  states();
  cpu_set_t allowed;
  REQUIRE(sched_getaffinity(0, sizeof allowed, &allowed) == 0);
  CHECK(ksl::cores_of_process() >= 1);
  CHECK(ksl::cores_of_process() <= static_cast<std::size_t>(CPU_COUNT(&allowed)));
  ksl::assume_cores(0);
  const std::size_t cores = ksl::all_cores();
  for (const int threads : {0, 100'000, INT_MAX}) {
    CAPTURE(threads);
    CHECK(ksl::partition(1'000'000'000, 8, 100, threads).threads == cores);
#ifndef KSL_TEST_THREAD_SANITIZER // which makes a thread of its own
    const int more = in_child([&] {
      const int before = threads_of_process();
      states().found(threads);
      return threads_of_process() - before;
    });
    CHECK(more == static_cast<int>(cores) - 1);
#endif
  }
}

TEST_CASE("affinity counts: of the process, and not of the thread that calls") {
  cpu_set_t allowed;
  REQUIRE(sched_getaffinity(0, sizeof allowed, &allowed) == 0);
  int first = 0;
  while (!CPU_ISSET(first, &allowed))
    ++first;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(first, &one);
  CHECK(in_child([&] {
          sched_setaffinity(0, sizeof one, &one);
          return static_cast<int>(ksl::cores_of_process());
        }) == 1);
  std::size_t on_bound_thread = 0;
  std::thread([&] {
    sched_setaffinity(0, sizeof one, &one);
    on_bound_thread = ksl::cores_of_process();
  }).join();
  CHECK(on_bound_thread == ksl::cores_of_process());
}

TEST_CASE("where the affinity is not known, all cores of the machine are taken") {
  affinity_is_known = false;
  CHECK(ksl::cores_of_process() >= 1);
  CHECK(ksl::cores_of_process() <= std::thread::hardware_concurrency());
  affinity_is_known = true;
}

TEST_CASE("the least quota of a control group and of those that it is in") {
  namespace fs = std::filesystem;
  char folder[] = "/tmp/ksl_groups_XXXXXX";
  REQUIRE(mkdtemp(folder));
  const auto write = [&](const std::string &file, const char *text) {
    const fs::path path = folder + file;
    fs::create_directories(path.parent_path());
    std::ofstream(path) << text;
  };
  CHECK(ksl::quota_of_groups("0::/a/b\n", folder) == 0);
  write("/a/b/cpu.max", "max 100000\n");
  CHECK(ksl::quota_of_groups("0::/a/b\n", folder) == 0);
  write("/a/cpu.max", "350000 100000\n");
  CHECK(ksl::quota_of_groups("0::/a/b\n", folder) == 4);
  CHECK(ksl::quota_of_groups("0::/a\n", folder) == 4);
  CHECK(ksl::quota_of_groups("0::/\n", folder) == 0);
  CHECK(in_child([&] {
          close(0); // as programs in the background do: then the next file is number 0
          return static_cast<int>(ksl::quota_of_groups("0::/a\n", folder));
        }) == 4);
  write("/cpu.max", "200000 100000\n"); // as in a container, where the group's path is one of the machine outside
  CHECK(ksl::quota_of_groups("0::/outside/of/here\n", folder) == 2);
  CHECK(ksl::quota_of_groups("0::/a/b\n", folder) == 2);
  write("/a/b/cpu.max", "50000 100000\n");
  CHECK(ksl::quota_of_groups("0::/a/b\n", folder) == 1);
  write("/cpu/d/cpu.cfs_quota_us", "-1\n");
  write("/cpu/d/cpu.cfs_period_us", "100000\n");
  CHECK(ksl::quota_of_groups("5:cpu,cpuacct:/d\n", folder) == 0);
  write("/cpu/d/cpu.cfs_quota_us", "300000\n");
  CHECK(ksl::quota_of_groups("5:cpu,cpuacct:/d\n", folder) == 3);
  CHECK(ksl::quota_of_groups("5:cpu,cpuacct:/d\n0::/a\n", folder) == 2);
  write("/unified/e/cpu.max", "100000 100000\n");
  CHECK(ksl::quota_of_groups("5:cpu,cpuacct:/d\n0::/e\n", folder) == 1);
  fs::remove_all(folder);
}

TEST_CASE("quotas of control groups, as files give them") {
  using ksl::cores_of_cpu_max, ksl::cores_of_quota, ksl::path_of_group;
  CHECK(cores_of_cpu_max("max 100000\n") == 0);
  CHECK(cores_of_cpu_max("100000 100000\n") == 1);
  CHECK(cores_of_cpu_max("150000 100000\n") == 2); // a core and a half
  CHECK(cores_of_cpu_max("1000 100000\n") == 1);
  CHECK(cores_of_cpu_max("1600000 100000\n") == 16);
  for (const char *no_quota :
       {"", "\n", "max", "max\n", "100000", "x y", "0 100000", "100000 0", "-1 100000", "99999999999999999999 100000"})
    CHECK(cores_of_cpu_max(no_quota) == 0);
  CHECK(cores_of_quota("-1\n", "100000\n") == 0);
  CHECK(cores_of_quota("250000\n", "100000\n") == 3);
  CHECK(cores_of_quota("", "") == 0);

  const char *const version_2 = "0::/user.slice/session.scope\n";
  const char *const version_1 = "12:devices:/d\n5:cpu,cpuacct:/docker/abc\n4:cpuset:/s\n1:name=systemd:/x\n";
  CHECK(path_of_group(version_2, "") == "/user.slice/session.scope");
  CHECK(path_of_group(version_2, "cpu").empty());
  CHECK(path_of_group(version_1, "cpu") == "/docker/abc");
  CHECK(path_of_group(version_1, "").empty());
  CHECK(path_of_group("4:cpuacct,cpu:/x", "cpu") == "/x");
  CHECK(path_of_group("4:cpuacct,cpuset:/x", "cpu").empty());
  CHECK(path_of_group("4:cpuset:/s\n0::/", "cpu").empty());
  CHECK(path_of_group("4:cpuset:/s\n0::/", "") == "/");
  CHECK(path_of_group("", "cpu").empty());
  CHECK(path_of_group("no colons here\n0::/a:b", "") == "/a:b");
}
