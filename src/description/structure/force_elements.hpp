// Springs, dampers and cylinders between points of two links, in descriptions.
#pragma once

#include "ksl/engine/model/description.hpp"

namespace ksl {

/// Throws description_error for force elements with a name that is empty or another one's, with links that aren't there or are the same, and
/// with numbers that no element has.
void check_force_elements(const robot_description &robot);

} // namespace ksl
