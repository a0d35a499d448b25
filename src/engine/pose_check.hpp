// Poses that a program gives.
#pragma once

#include "ksl/algebra.hpp"

#include <string>

namespace ksl {

/// The pose, its rotation rounded to the nearest rotation matrix where it is one to six digits.  Throws description_error, beginning
/// with `what`, for any other matrix and for numbers that are not finite.
SE3<double> rigid_pose(const std::string &what, const SE3<double> &pose);

} // namespace ksl
