// Whether 4 × 4 matrices are poses.
#pragma once

#include <cmath>

namespace ksl {

/// How far the rotation of a given pose may be from orthonormal.
constexpr double pose_tolerance = 1e-4;

/// Is a row-major 4 × 4 matrix the pose of a frame: finite, with a right-handed rotation?
/// Columns are orthonormal, their triple product c₀ · (c₁ × c₂) is 1 and not −1, and the last row is 0 0 0 1.
template <class S> bool is_pose(const S *T) {
  const auto column = [T](int c, int r) { return static_cast<double>(T[4 * r + c]); };
  const auto dot = [&](int a, int b) {
    return column(a, 0) * column(b, 0) + column(a, 1) * column(b, 1) + column(a, 2) * column(b, 2);
  };
  for (int a = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b)
      if (!(std::fabs(dot(a, b) - (a == b)) <= pose_tolerance))
        return false;
  double determinant = 0;
  for (int r = 0; r < 3; ++r)
    determinant += column(0, r) *
                   (column(1, (r + 1) % 3) * column(2, (r + 2) % 3) - column(1, (r + 2) % 3) * column(2, (r + 1) % 3));
  return determinant > 0 && std::isfinite(T[3]) && std::isfinite(T[7]) && std::isfinite(T[11]) && T[12] == 0 &&
         T[13] == 0 && T[14] == 0 && T[15] == 1;
}

} // namespace ksl
