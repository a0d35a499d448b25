// Reads SDF 1.4 to 1.10.
#pragma once

#include "text/xml.hpp"

#include "ksl/engine/model/description.hpp"

namespace ksl {

struct sdf_options {
  /// The model to be read; empty: the only one that is not static.
  std::string model;
  /// Joints that mimic others get coordinates of their own, instead of following them.
  bool mimic_independent = false;
  /// Inertias that no body can have are errors instead of warnings, and so are links without inertia.
  bool strict = false;
  /// Refuse a model that is not free, because a joint connects it with the world.
  bool floating_base = false;
  /// Joints that close loops are left out.
  bool cut_loops = false;
};

/// Reads one model.  The root of the description is a link `world`, on which links that no joint carries float.
/// Throws description_error.
robot_description read_sdf(const text::xml_file &file, const sdf_options &options = {});

} // namespace ksl
