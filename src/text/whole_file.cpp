#include "text/whole_file.hpp"

#include "text/system_files.hpp"

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <new>

#if defined(_WIN32)
#include <process.h>
#else
#include <unistd.h>
#endif

namespace ksl::text {

namespace {

/// A number that differs between calls, threads and processes.  It need not be secret: a name that is taken isn't used.
std::uint64_t new_number() {
  static std::atomic<std::uint64_t> calls{0};
  std::timespec now{};
  std::timespec_get(&now, TIME_UTC);
  std::uint64_t x = static_cast<std::uint64_t>(now.tv_sec) * 1'000'000'000u + static_cast<std::uint64_t>(now.tv_nsec);
  x += static_cast<std::uint64_t>(getpid()) << 40;
  x += calls.fetch_add(1, std::memory_order_relaxed) * 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u; // the mixing of splitmix64
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

#if defined(_WIN32)
constexpr const char *separators = "/\\";
#else
constexpr const char *separators = "/";
#endif

/// Opens a new file beside `place`, and puts its path into `name`.  Negative, with errno, where that fails.
int open_beside(const std::string &place, std::string &name) {
  constexpr int tries = 100;
  const std::string folder = place.substr(0, place.find_last_of(separators) + 1);
  name.reserve(folder.size() + 32);
  int file = -1;
  for (int i = 0; i < tries; ++i) {
    char own[32];
    std::snprintf(own, sizeof own, ".ksl-%016llx.part", static_cast<unsigned long long>(new_number()));
    name = folder;
    name += own;
    file = system_files::open_new(name);
    if (file >= 0 || errno != EEXIST)
      break;
  }
  return file;
}

bool write_all(int file, const std::string &text) {
  constexpr std::size_t most = 1 << 30; // some systems take no more at once
  for (std::size_t done = 0; done < text.size();) {
    const std::size_t rest = text.size() - done;
    const std::ptrdiff_t written = system_files::write_some(file, text.data() + done, rest < most ? rest : most);
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
  const std::string place = system_files::at_the_end_of_links(path);
  const bool is_staged = !place.empty();
  std::string beside;
  const int file = is_staged ? open_beside(place, beside) : system_files::open_to_write(path);
  if (file < 0 && errno == ENOMEM)
    throw std::bad_alloc();
  if (file < 0)
    return false;
  //     .ksl-….part      written, closed ──rename, in one step──→ path
  //
  // The old file is there until the new one is complete; a full disk may show only when it is closed.
  const bool is_written = write_all(file, text);
  const bool is_closed = system_files::close_file(file);
  const bool is_done = is_written && is_closed && (!is_staged || system_files::rename_over(beside, place));
  if (!is_done && is_staged)
    system_files::remove_file(beside);
  return is_done;
}

} // namespace ksl::text
