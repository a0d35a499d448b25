// KSL: how far a quaternion that a user gives may be from unit length.
#pragma once

#include <cmath>

namespace ksl {

/// Calls take the quaternions of floating joints whose length differs by no more from 1, and treat them as unit ones.
inline constexpr double quaternion_tolerance = 1e-3;

/// The length of [x y z w].
template <class S> double quaternion_length(const S *x) {
  const double a = x[0], b = x[1], c = x[2], d = x[3];
  return std::sqrt(a * a + b * b + c * c + d * d);
}

template <class S> bool is_unit_quaternion(const S *x) { return std::fabs(quaternion_length(x) - 1) <= quaternion_tolerance; }

} // namespace ksl
