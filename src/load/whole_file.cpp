#include "load/whole_file.hpp"

#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <new>

#include <sys/stat.h>

namespace ksl::load {

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

} // namespace

bool write_whole_file(const std::string &path, const std::string &text) {
  const std::string place = replaced_file(path);
  const bool is_staged = !place.empty();
  const std::string written = is_staged ? place + ".part" : path;
  errno = 0;
  std::FILE *const file = std::fopen(written.c_str(), "wb");
  if (!file && errno == ENOMEM)
    throw std::bad_alloc();
  if (!file)
    return false;
  std::setvbuf(file, nullptr, _IONBF, 0); // so that nothing more is allocated once the file is open
  const bool is_written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
  const bool is_closed = std::fclose(file) == 0;
  const bool is_done = is_written && is_closed && (!is_staged || std::rename(written.c_str(), place.c_str()) == 0);
  if (!is_done && is_staged)
    std::remove(written.c_str());
  return is_done;
}

} // namespace ksl::load
