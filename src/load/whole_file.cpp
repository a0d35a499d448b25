#include "load/whole_file.hpp"

#include <cerrno>
#include <cstdio>
#include <new>

#include <sys/stat.h>

namespace ksl::load {

namespace {

/// By lstat, since std::filesystem has functions that leak where memory runs out.
bool is_regular_or_new(const std::string &path) {
  struct stat found;
  return lstat(path.c_str(), &found) == 0 ? S_ISREG(found.st_mode) : errno == ENOENT;
}

} // namespace

bool write_whole_file(const std::string &path, const std::string &text) {
  const bool is_staged = is_regular_or_new(path);
  const std::string written = is_staged ? path + ".part" : path;
  errno = 0;
  std::FILE *const file = std::fopen(written.c_str(), "wb");
  if (!file && errno == ENOMEM)
    throw std::bad_alloc();
  if (!file)
    return false;
  std::setvbuf(file, nullptr, _IONBF, 0); // so that nothing more is allocated once the file is open
  const bool is_written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
  const bool is_closed = std::fclose(file) == 0;
  const bool is_done = is_written && is_closed && (!is_staged || std::rename(written.c_str(), path.c_str()) == 0);
  if (!is_done && is_staged)
    std::remove(written.c_str());
  return is_done;
}

} // namespace ksl::load
