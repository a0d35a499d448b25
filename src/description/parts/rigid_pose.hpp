// Poses that a program gives.
#pragma once

#include "ksl/algebra.hpp"

#include <string>

namespace ksl {

/// The pose as it is; where its rotation is one to six digits only, the nearest rotation matrix instead.  Throws
/// description_error, beginning with `what`, for any other matrix and for numbers that are not finite.
SE3<double> rigid_pose(const std::string &what, const SE3<double> &pose);

} // namespace ksl
