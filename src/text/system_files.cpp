// With the system's functions, since std::filesystem has some that leak where memory runs out.
#include "text/system_files.hpp"

#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <sys/stat.h>

#if defined(_WIN32)
#include <algorithm>
#include <io.h>
#define NOMINMAX // its macros have the names of our variables
#include <windows.h>
#undef near
#undef far
#else
#include <unistd.h>
#endif

namespace ksl::text::system_files {

namespace {

template <class Stat> status status_of(const Stat &found) {
  const auto type = found.st_mode & S_IFMT;
  kind what = kind::device;
  if (type == S_IFREG)
    what = kind::regular;
  else if (type == S_IFDIR)
    what = kind::folder;
#if defined(S_IFIFO)
  else if (type == S_IFIFO)
    what = kind::pipe;
#endif
#if defined(S_IFSOCK)
  else if (type == S_IFSOCK)
    what = kind::socket;
#endif
  return {what, static_cast<std::size_t>(found.st_size)};
}

} // namespace

#if defined(_WIN32)

namespace {

/// Empty, which is no path, for what is no UTF-8.  May throw std::bad_alloc, as the calls that use it.
std::wstring wide(const std::string &path) {
  const int bytes = static_cast<int>(std::min<std::size_t>(path.size(), INT_MAX));
  std::wstring text(
      static_cast<std::size_t>(MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path.data(), bytes, nullptr, 0)),
      L'\0');
  MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path.data(), bytes, text.data(), static_cast<int>(text.size()));
  return text;
}

int opened(const std::string &path, int flags) {
  return _wopen(wide(path).c_str(), flags | _O_BINARY | _O_NOINHERIT, _S_IREAD | _S_IWRITE);
}

unsigned at_most(std::size_t bytes) { return static_cast<unsigned>(std::min<std::size_t>(bytes, INT_MAX)); }

} // namespace

bool look_at(const std::string &path, status &found) {
  struct _stat64 told;
  if (_wstat64(wide(path).c_str(), &told) != 0)
    return false;
  found = status_of(told);
  return true;
}
bool look_at(int descriptor, status &found) {
  struct _stat64 told;
  if (_fstat64(descriptor, &told) != 0)
    return false;
  found = status_of(told);
  return true;
}
int open_to_read(const std::string &path) { return opened(path, _O_RDONLY); }
int open_to_write(const std::string &path) { return opened(path, _O_WRONLY | _O_CREAT | _O_TRUNC); }
int open_new(const std::string &path) { return opened(path, _O_WRONLY | _O_CREAT | _O_EXCL); }
std::ptrdiff_t read_some(int descriptor, void *bytes, std::size_t most) {
  return _read(descriptor, bytes, at_most(most));
}
std::ptrdiff_t write_some(int descriptor, const void *bytes, std::size_t most) {
  return _write(descriptor, bytes, at_most(most));
}
bool close_file(int descriptor) { return _close(descriptor) == 0; }
bool remove_file(const std::string &path) { return _wunlink(wide(path).c_str()) == 0; }
bool rename_over(const std::string &from, const std::string &to) {
  return MoveFileExW(wide(from).c_str(), wide(to).c_str(), MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) != 0;
}
/// Links are rare there, and a file at the end of one is replaced as well as the link would be.
std::string at_the_end_of_links(const std::string &path) {
  status found{};
  if (!look_at(path, found))
    return errno == ENOENT ? path : "";
  return found.what == kind::regular ? path : "";
}

#else

bool look_at(const std::string &path, status &found) {
  struct stat told;
  if (stat(path.c_str(), &told) != 0)
    return false;
  found = status_of(told);
  return true;
}
bool look_at(int descriptor, status &found) {
  struct stat told;
  if (fstat(descriptor, &told) != 0)
    return false;
  found = status_of(told);
  return true;
}
// O_NONBLOCK: a pipe without a writer opens, to be refused; O_NOCTTY: a terminal doesn't become that of the process
int open_to_read(const std::string &path) { return open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY); }
int open_to_write(const std::string &path) {
  return open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
}
int open_new(const std::string &path) {
  // O_EXCL, O_NOFOLLOW: not through what somebody else has laid there meanwhile
  return open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
}
std::ptrdiff_t read_some(int descriptor, void *bytes, std::size_t most) { return ::read(descriptor, bytes, most); }
std::ptrdiff_t write_some(int descriptor, const void *bytes, std::size_t most) {
  return ::write(descriptor, bytes, most);
}
bool close_file(int descriptor) { return close(descriptor) == 0; }
bool remove_file(const std::string &path) { return unlink(path.c_str()) == 0; }
bool rename_over(const std::string &from, const std::string &to) { return std::rename(from.c_str(), to.c_str()) == 0; }
std::string at_the_end_of_links(const std::string &path) {
  struct stat found;
  // lstat sees a link itself, stat where it leads
  if (lstat(path.c_str(), &found) != 0)
    return errno == ENOENT ? path : "";
  if (stat(path.c_str(), &found) != 0 || !S_ISREG(found.st_mode))
    return "";
  char place[PATH_MAX];
  return realpath(path.c_str(), place) ? place : "";
}

#endif

} // namespace ksl::text::system_files
