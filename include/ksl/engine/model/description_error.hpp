// KSL: what is thrown where a file or a program describes no robot.
#pragma once

#include "ksl/config.h"

#include <stdexcept>

namespace ksl {

/// Thrown if a description can't be read or is not a mechanism.  The message names file, line, link or joint, what is wrong and
/// how to mend it.
struct KSL_EXPORT description_error : std::runtime_error { using std::runtime_error::runtime_error; };

} // namespace ksl
