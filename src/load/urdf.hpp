// Reads URDF 1.0 to 1.2.
#pragma once

#include "text/xml.hpp"

#include "ksl/engine/model/description.hpp"

#include <string>

namespace ksl {

struct urdf_options {
  /// A moving joint that mimics another has a coordinate of its own, instead of following that joint.
  bool mimic_independent = false;
  /// Inertias that no body can have are errors instead of warnings.
  bool strict = false;
  /// What closes loops is left out, and needn't be readable.
  bool cut_loops = false;
};

/// Reads the URDF file at `path`.  Throws description_error.
robot_description read_urdf(const std::string &path, const urdf_options &options = {});

/// The same from text; `name` stands for the file in messages.
robot_description read_urdf_text(const std::string &text, const std::string &name, const urdf_options &options = {});

/// The same from a file that has been parsed.
robot_description read_urdf(const text::xml_file &file, const urdf_options &options = {});

} // namespace ksl
