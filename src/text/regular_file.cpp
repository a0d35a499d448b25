// Looked at, opened, looked at again, and read to its end, in blocks: sizes that the system tells are a hint, and what is read counts.
#include "text/regular_file.hpp"

#include "text/limits.hpp"
#include "text/system_files.hpp"
#include "text/words.hpp"

#include <cerrno>
#include <system_error>

namespace ksl::text {

namespace {

[[noreturn]] void refuse_unreadable(const std::string &path, int error) {
  if (error == ENOENT || error == ENOTDIR)
    refuse(path, 0,
           "there is no such file; check the path, which starts at the current folder unless it begins with /");
  refuse(path, 0,
         "the file can't be read (" + std::error_code(error, std::generic_category()).message() +
             "); check its path and its permissions");
}

void check_regular(const system_files::status &status, const std::string &path) {
  using system_files::kind;
  if (status.what == kind::regular)
    return check_size(status.bytes, path);
  if (status.what == kind::folder)
    refuse(path, 0, "this is a folder, not a file; give the path of a URDF file in it");
  const char *const what = status.what == kind::pipe ? "pipe" : status.what == kind::socket ? "socket" : "device";
  refuse(path, 0,
         std::string("this is a ") + what +
             ", not a regular file; save what it gives as a file, or give it to ksl.load_string");
}

/// A file that is open for reading.
class open_file {
public:
  /// What the path names may be exchanged between a look at it and its opening.  Therefore opening doesn't wait for a
  /// pipe's writer, and what has been opened is looked at.  The first look is for devices, some of which act when they
  /// are opened.
  explicit open_file(const std::string &path) : path_(path) {
    system_files::status status{};
    if (!system_files::look_at(path, status))
      refuse_unreadable(path, errno);
    check_regular(status, path);
    descriptor_ = system_files::open_to_read(path);
    if (descriptor_ < 0)
      refuse_unreadable(path, errno);
  }
  ~open_file() { system_files::close_file(descriptor_); }
  open_file(const open_file &) = delete;
  open_file &operator=(const open_file &) = delete;

  std::string bytes() const {
    system_files::status status{};
    if (!system_files::look_at(descriptor_, status))
      refuse_unreadable(path_, errno);
    check_regular(status, path_);
    std::string all;
    all.reserve(status.bytes);
    char block[1 << 16];
    while (const std::size_t n = read_block(block, sizeof block)) {
      all.append(block, n);
      check_size(all.size(), path_); // it may grow while it is read, and files of the kernel say that they have no size
    }
    return all;
  }

private:
  /// Signals that a handler takes interrupt a read, which is then asked for again.
  std::size_t read_block(char *block, std::size_t size) const {
    std::ptrdiff_t n = 0;
    do
      n = system_files::read_some(descriptor_, block, size);
    while (n < 0 && errno == EINTR);
    if (n < 0)
      refuse_unreadable(path_, errno);
    return static_cast<std::size_t>(n);
  }

  const std::string &path_;
  int descriptor_ = -1;
};

} // namespace

void check_size(std::size_t bytes, const std::string &file) {
  static_assert(limits::file_bytes == std::size_t{64} << 20);
  if (bytes > limits::file_bytes)
    refuse(file, 0,
           "the file has " + std::to_string(bytes) +
               " bytes, more than 64 MiB; a robot file holds no meshes or recordings");
}

std::string bytes_of_file(const std::string &path) {
  if (path.empty())
    refuse("", 0, "the path of the file is empty; give the path of a URDF file");
  if (path.find('\0') != path.npos) // the system would read the path up to it
    refuse(path, 0, "the path holds a zero byte; correct it");
  return open_file(path).bytes();
}

} // namespace ksl::text
