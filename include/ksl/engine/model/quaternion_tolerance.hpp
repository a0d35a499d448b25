// KSL: how far a quaternion that a user gives may be from unit length.
#pragma once

#include <cmath>

namespace ksl {

/// Algorithms divide by the length of a quaternion wherever it enters, so that all give the results of the unit quaternion.  Calls
/// refuse quaternions whose length differs from 1 by more than quaternion_tolerance, since that is a mistake.  If it differs by more
/// than quaternion_rounding, calls from Python and C warn.
inline constexpr double quaternion_tolerance = 1e-2, quaternion_rounding = 1e-6;

/// The length of [x y z w].
template <class S> double quaternion_length(const S *x) {
  const double a = double(x[0]), b = double(x[1]), c = double(x[2]), d = double(x[3]);
  return std::sqrt(a * a + b * b + c * c + d * d);
}

template <class S> bool is_unit_quaternion(const S *x, double tolerance = quaternion_tolerance) {
  return std::fabs(quaternion_length(x) - 1) <= tolerance;
}

} // namespace ksl
