// KSL: files that appear complete or not at all.
#pragma once

#include <string>

namespace ksl::text {

/// Writes text to a file: beside it first, and then in its place, so that a full disk or a crash leaves the old one.
/// The file beside it is a new one, `.ksl-` with 16 digits and `.part`, which is removed where anything fails.  No
/// other file is touched; of writers at the same time the last one's text remains.  Its mode is that of new files.  A
/// link stays, and the file to which it leads is replaced.  What is no regular file, as /dev/stdout, is written to
/// directly, and so is a file to which a link leads that isn't there yet.  Returns whether that succeeded; throws
/// std::bad_alloc before anything is written.
bool write_whole_file(const std::string &path, const std::string &text);

} // namespace ksl::text
