// Reads SDF 1.4 to 1.10.
#pragma once

#include "load/read_options.hpp"
#include "text/xml.hpp"

#include "ksl/engine/model/description.hpp"

namespace ksl {

/// Reads one model.  The root of the description is a link `world`, on which links that no joint carries float.
/// Throws description_error.
robot_description read_sdf(const text::xml_file &file, const read_options &options = {});

} // namespace ksl
