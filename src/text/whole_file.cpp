#include "text/whole_file.hpp"

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <new>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace ksl::text {

namespace {

/// The file that takes the text's place when it is complete: at the end of links.  None for what is no regular file, for links that
/// lead nowhere, and in folders whose path is longer than the system can tell.  With the system's functions, since std::filesystem has
/// some that leak where memory runs out.
std::string replaced_file(const std::string &path) {
  struct stat found;
  if (lstat(path.c_str(), &found) != 0)
    return errno == ENOENT ? path : "";
  if (stat(path.c_str(), &found) != 0 || !S_ISREG(found.st_mode))
    return "";
  char place[PATH_MAX];
  return realpath(path.c_str(), place) ? place : "";
}

/// A number that differs between calls, threads and processes.  It need not be secret: a name that is taken isn't used.
std::uint64_t new_number() {
  static std::atomic<std::uint64_t> calls{0};
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  std::uint64_t x = static_cast<std::uint64_t>(now.tv_sec) * 1'000'000'000u + static_cast<std::uint64_t>(now.tv_nsec);
  x += static_cast<std::uint64_t>(getpid()) << 40;
  x += calls.fetch_add(1, std::memory_order_relaxed) * 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u; // the mixing of splitmix64
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Opens a new file beside `place`, and puts its path into `name`.  Negative, with errno, where that fails.
int open_beside(const std::string &place, std::string &name) {
  constexpr int tries = 100;
  const std::string folder = place.substr(0, place.find_last_of('/') + 1);
  name.reserve(folder.size() + 32);
  int file = -1;
  for (int i = 0; i < tries; ++i) {
    char own[32];
    std::snprintf(own, sizeof own, ".ksl-%016llx.part", static_cast<unsigned long long>(new_number()));
    name = folder;
    name += own;
    file = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (file >= 0 || errno != EEXIST)
      break;
  }
  return file;
}

bool write_all(int file, const std::string &text) {
  constexpr std::size_t most = 1 << 30; // some systems take no more at once
  for (std::size_t done = 0; done < text.size();) {
    const std::size_t rest = text.size() - done;
    const ssize_t written = write(file, text.data() + done, rest < most ? rest : most);
    if (written < 0 && errno == EINTR)
      continue;
    if (written <= 0)
      return false;
    done += static_cast<std::size_t>(written);
  }
  return true;
}

} // namespace

// Nothing is allocated once a file is open.
bool write_whole_file(const std::string &path, const std::string &text) {
  const std::string place = replaced_file(path);
  const bool is_staged = !place.empty();
  std::string beside;
  constexpr int directly = O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC;
  const int file = is_staged ? open_beside(place, beside) : open(path.c_str(), directly, 0666);
  if (file < 0 && errno == ENOMEM)
    throw std::bad_alloc();
  if (file < 0)
    return false;
  const bool is_written = write_all(file, text);
  const bool is_closed = close(file) == 0;
  const bool is_done = is_written && is_closed && (!is_staged || std::rename(beside.c_str(), place.c_str()) == 0);
  if (!is_done && is_staged)
    unlink(beside.c_str());
  return is_done;
}

} // namespace ksl::text
