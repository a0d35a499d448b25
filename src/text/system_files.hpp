// The calls of the system on files.  On Windows paths are UTF-8, as Python gives them, and contents are bytes.
#pragma once

#include <cstddef>
#include <string>

namespace ksl::text::system_files {

enum class kind { regular, folder, pipe, socket, device };

struct status {
  kind what;
  std::size_t bytes;
};

// Calls of the system, which return what those of POSIX do that they are named after: negative, or false, with errno, where they fail.
bool look_at(const std::string &path, status &found);
bool look_at(int descriptor, status &found);
/// For reading; doesn't wait for a pipe's writer.
int open_to_read(const std::string &path);
/// A file that the text replaces in place, or a new one, which must not exist.
int open_to_write(const std::string &path);
int open_new(const std::string &path);
std::ptrdiff_t read_some(int descriptor, void *bytes, std::size_t most);
std::ptrdiff_t write_some(int descriptor, const void *bytes, std::size_t most);
bool close_file(int descriptor);
bool remove_file(const std::string &path);
/// Replaces the file at `to`, in one step.
bool rename_over(const std::string &from, const std::string &to);

/// The file that a complete text should replace: at the end of links; the path itself if there is none.  None for what is no regular file,
/// for links that lead nowhere, and in folders whose path is longer than the system can tell.
std::string at_the_end_of_links(const std::string &path);

} // namespace ksl::text::system_files
