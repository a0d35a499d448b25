// The bytes of a file, if it is one.
#pragma once

#include <cstddef>
#include <string>

namespace ksl::text {

/// The bytes of a regular file.  Throws description_error if there is none or it can't be read, if it is too large
/// (limits.hpp), or if it is something else: a pipe would be waited for, and a device may have no end.
std::string bytes_of_file(const std::string &path);

/// Refuses a file of more bytes than files may have.
void check_size(std::size_t bytes, const std::string &file);

} // namespace ksl::text
