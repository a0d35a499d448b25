// How a robot file is read.
#pragma once

#include <string>

namespace ksl {

/// Given whole to each reader.  The names are those of ksl::load_options and model_options, and of Python's ReadOptions.
struct read_options {
  /// The root floats.  An SDF file says by itself what floats: a model that a joint connects with the world is refused.
  bool floating_base = false;
  /// A moving joint that mimics another has a coordinate of its own, instead of following that joint.
  bool mimic_independent = false;
  /// Inertias that no body can have are errors instead of warnings, and so are links without inertia in an SDF file.
  bool strict = false;
  /// The model of an SDF file to be read; empty: the only one that is not static.  Other files hold one robot, and refuse the name.
  std::string model = {};
  /// Joints that close loops are left out, and needn't be readable.
  bool cut_loops = false;
};

} // namespace ksl
