// Control groups are files (cgroups(7), sched-bwc and cgroup-v2 of the kernel's documentation):
//
//                 /proc/self/cgroup            quota of the group at that path
//     version 2   0::/path                     cpu.max:  "quota period" or "max period", µs
//     version 1   4:cpu,cpuacct:/path          cpu.cfs_quota_us (−1: none), cpu.cfs_period_us
//
// A group may use quota / period cores, and no more than the groups around it.
#include "batch/cores.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <sched.h>
#include <thread>
#include <unistd.h>

namespace ksl {
namespace {

/// Reads a number at the beginning of a text, and cuts it off.  Negative if there is none.
long long take_number(std::string_view &text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\n'))
    text.remove_prefix(1);
  long long number = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return error == std::errc() ? number : -1;
}

/// The number of cores that a quota in each period allows, rounded up; 0 if there is no limit.
std::size_t cores_of(long long quota, long long period) {
  if (quota <= 0 || period <= 0)
    return 0;
  return static_cast<std::size_t>(quota / period + (quota % period != 0));
}

/// Is a word in a list with commas?
bool lists(std::string_view words, std::string_view word) {
  while (!words.empty()) {
    const std::size_t comma = std::min(words.find(','), words.size());
    if (words.substr(0, comma) == word)
      return true;
    words.remove_prefix(std::min(comma + 1, words.size()));
  }
  return false;
}

#if defined(__linux__)

/// Sets `least` to the smaller one of two limits; 0 is no limit.
void lower(std::size_t &least, std::size_t limit) {
  if (limit && (!least || limit < least))
    least = limit;
}

/// The beginning of a file, or nothing if it can't be read.  Not by a stream of the C library, which would allocate.
template <std::size_t size> std::string_view contents(const char *path, char (&buffer)[size]) {
  const int file = open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0)
    return {};
  std::size_t n = 0;
  for (ssize_t some; n < size && (some = read(file, buffer + n, size - n)) > 0;)
    n += static_cast<std::size_t>(some);
  close(file);
  return {buffer, n};
}

/// The number of cores that the quota of one group allows; 0 if it has none.  `folder` is where the hierarchy of that version is mounted.
std::size_t cores_of_group(const char *folder, std::string_view path, bool version_2) {
  char name[4352], first[64], second[64];
  const auto file = [&](const char *last) {
    std::snprintf(name, sizeof name, "%s%.*s/%s", folder, static_cast<int>(path.size()), path.data(), last);
    return name;
  };
  if (version_2)
    return cores_of_cpu_max(contents(file("cpu.max"), first));
  const std::string_view quota = contents(file("cpu.cfs_quota_us"), first);
  return cores_of_quota(quota, contents(file("cpu.cfs_period_us"), second));
}

/// The least quota of a group and of the groups that it is in; 0 if there is none.  In a container the path may be that on the machine
/// outside, which doesn't exist inside.  The root of what is mounted, which is tried last, is then the container's own group.
std::size_t least_quota(const char *folder, std::string_view path, bool version_2) {
  std::size_t least = 0;
  while (true) {
    lower(least, cores_of_group(folder, path == "/" ? "" : path, version_2));
    if (path.empty() || path == "/")
      return least;
    path = path.substr(0, path.rfind('/'));
  }
}

std::size_t quota_of_process() {
  char buffer[4096];
  return quota_of_groups(contents("/proc/self/cgroup", buffer), "/sys/fs/cgroup");
}

/// The number of cores that the first thread of the process may run on, which other threads inherit; 0 if unknown.  The calling thread
/// isn't asked, since it may have been tied to a single core.
std::size_t cores_by_affinity() {
  unsigned long mask[1024] = {}; // 65536 cores
  if (sched_getaffinity(getpid(), sizeof mask, reinterpret_cast<cpu_set_t *>(mask)) != 0)
    return 0;
  std::size_t n = 0;
  for (const unsigned long bits : mask)
    n += static_cast<std::size_t>(__builtin_popcountl(bits));
  return n;
}

#else

std::size_t quota_of_process() { return 0; }
std::size_t cores_by_affinity() { return 0; }

#endif

} // namespace

std::size_t cores_of_cpu_max(std::string_view cpu_max) noexcept {
  const long long quota = take_number(cpu_max); // of the word max: none
  return cores_of(quota, take_number(cpu_max));
}

std::size_t cores_of_quota(std::string_view quota, std::string_view period) noexcept {
  return cores_of(take_number(quota), take_number(period));
}

std::size_t quota_of_groups([[maybe_unused]] std::string_view groups,
                            [[maybe_unused]] const char *mounted_at) noexcept {
  std::size_t least = 0;
#if defined(__linux__)
  const auto limit = [&](const char *hierarchy, const char *controller) {
    char folder[256];
    std::snprintf(folder, sizeof folder, "%s%s", mounted_at, hierarchy);
    const std::string_view path = path_of_group(groups, controller);
    if (!path.empty())
      lower(least, least_quota(folder, path, *controller == '\0'));
  };
  limit("", "");
  limit("/unified", ""); // beside version 1
  limit("/cpu", "cpu");
#endif
  return least;
}

std::string_view path_of_group(std::string_view groups, std::string_view controller) noexcept {
  while (!groups.empty()) { // lines such as 4:cpu,cpuacct:/path and 0::/path
    const std::size_t end = std::min(groups.find('\n'), groups.size());
    const std::string_view line = groups.substr(0, end);
    const std::size_t first = line.find(':'), second = first == line.npos ? first : line.find(':', first + 1);
    if (second != line.npos) {
      const std::string_view controllers = line.substr(first + 1, second - first - 1);
      if (controller.empty() ? controllers.empty() : lists(controllers, controller))
        return line.substr(second + 1);
    }
    groups.remove_prefix(std::min(end + 1, groups.size()));
  }
  return {};
}

std::size_t cores_of_process() noexcept {
  std::size_t cores = std::max<std::size_t>(1, std::thread::hardware_concurrency());
  for (const std::size_t limit : {cores_by_affinity(), quota_of_process()})
    if (limit)
      cores = std::min(cores, limit);
  return cores;
}

} // namespace ksl
