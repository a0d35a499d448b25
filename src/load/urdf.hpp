// Reads URDF 1.0 to 1.2.
#pragma once

#include "load/read_options.hpp"
#include "text/xml.hpp"

#include "ksl/engine/model/description.hpp"

#include <string>

namespace ksl {

/// Reads the URDF file at `path`.  Throws description_error.
robot_description read_urdf(const std::string &path, const read_options &options = {});

/// Reads URDF from text; `name` stands for the file in messages.
robot_description read_urdf_text(const std::string &text, const std::string &name, const read_options &options = {});

/// Reads a file that has been parsed.
robot_description read_urdf(const text::xml_file &file, const read_options &options = {});

} // namespace ksl
