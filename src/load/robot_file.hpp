// Reads a robot file in any format that KSL has a reader for.
#pragma once

#include "ksl/engine/description.hpp"

#include <string>

namespace ksl {

struct file_options {
  bool mimic_independent = false; ///< urdf_options, sdf_options
  bool strict = false;
  bool floating_base = false;     ///< the root floats; in an SDF file it does unless a joint connects it with the world
  std::string model;              ///< of an SDF file with several: the one to read
};

/// Reads a file as what its root element says: <robot> is URDF, <sdf> is SDF.  Throws description_error.
robot_description read_robot(const std::string &path, const file_options &options = {});

/// The same from text; `name` stands for the file in messages.
robot_description read_robot_text(const std::string &text, const std::string &name, const file_options &options = {});

} // namespace ksl
