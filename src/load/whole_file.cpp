#include "load/whole_file.hpp"

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <new>

namespace ksl::load {

bool write_whole_file(const std::string &path, const std::string &text) {
  std::error_code none;
  const std::filesystem::file_type kind = std::filesystem::status(path, none).type();
  const bool is_there = kind == std::filesystem::file_type::regular;
  const bool is_staged = is_there || kind == std::filesystem::file_type::not_found;
  const std::string target = is_there ? std::filesystem::canonical(path, none).string() : path; // a link stays one
  const std::string written = is_staged ? target + ".part" : path;
  errno = 0;
  std::FILE *const file = std::fopen(written.c_str(), "wb");
  if (!file && errno == ENOMEM)
    throw std::bad_alloc();
  if (!file)
    return false;
  std::setvbuf(file, nullptr, _IONBF, 0); // so that nothing more is allocated once the file is open
  const bool is_written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
  const bool is_closed = std::fclose(file) == 0;
  const bool is_done = is_written && is_closed && (!is_staged || std::rename(written.c_str(), target.c_str()) == 0);
  if (!is_done && is_staged)
    std::remove(written.c_str());
  return is_done;
}

} // namespace ksl::load
