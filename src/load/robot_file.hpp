// Reads a robot file in any format that KSL has a reader for.
#pragma once

#include "load/read_options.hpp"

#include "ksl/engine/model/description.hpp"

#include <cstddef>
#include <string>

namespace ksl {

/// The bytes of a file.  Throws description_error.
std::string bytes_of_robot_file(const std::string &path);

/// A copy of a text in memory, unless it is larger than a file may be.  `name` stands for the file in messages.  Throws description_error.
std::string bytes_of_robot_text(const char *text, std::size_t length, const std::string &name);

/// Reads the contents of a file as what its root element says: <robot> is URDF, <sdf> is SDF.  `name` stands for the file in messages.
/// Throws description_error.
robot_description read_robot_text(const std::string &text, const std::string &name, const read_options &options = {});

} // namespace ksl
