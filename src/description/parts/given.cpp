#include "description/parts/given.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::given {

namespace {

// Rz(yaw) Ry(pitch) Rx(roll), about fixed axes, x first, as URDF and SDF have them; in columns
mat3x3<double> rotation_from_rpy(double roll, double pitch, double yaw) {
  const double cr = std::cos(roll), sr = std::sin(roll);
  const double cp = std::cos(pitch), sp = std::sin(pitch);
  const double cy = std::cos(yaw), sy = std::sin(yaw);
  return {cy * cp,
          sy * cp,
          -sp, //
          cy * sp * sr - sy * cr,
          sy * sp * sr + cy * cr,
          cp * sr, //
          cy * sp * cr + sy * sr,
          sy * sp * cr - cy * sr,
          cp * cr};
}

// 1 + 2 w ṽ + 2 ṽ², v = (x, y, z); a column in each line
mat3x3<double> rotation_from_unit_quaternion(double x, double y, double z, double w) {
  return {1 - 2 * (y * y + z * z), 2 * (x * y + w * z),     2 * (x * z - w * y), //
          2 * (x * y - w * z),     1 - 2 * (x * x + z * z), 2 * (y * z + w * x), //
          2 * (x * z + w * y),     2 * (y * z - w * x),     1 - 2 * (x * x + y * y)};
}

/// R A Rᵀ for a symmetric A.
mat3x3<double> turned(const mat3x3<double> &R, const mat3x3<double> &A) {
  const double r[3][3] = {{R.m00, R.m01, R.m02}, {R.m10, R.m11, R.m12}, {R.m20, R.m21, R.m22}};
  const double a[3][3] = {{A.m00, A.m01, A.m02}, {A.m10, A.m11, A.m12}, {A.m20, A.m21, A.m22}};
  double o[3][3] = {};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l)
          o[i][j] += r[i][k] * a[k][l] * r[j][l];
  return {o[0][0], o[1][0], o[2][0], o[0][1], o[1][1], o[2][1], o[0][2], o[1][2], o[2][2]};
}

} // namespace

mat3x3<double> rotation_of(const given_rotation &rotation) {
  const auto &[a, b, c, d] = rotation.numbers;
  if (rotation.by == given_rotation::rpy)
    return rotation_from_rpy(a, b, c);
  if (rotation.by == given_rotation::quaternion) {
    const double norm = std::sqrt(a * a + b * b + c * c + d * d);
    return rotation_from_unit_quaternion(a / norm, b / norm, c / norm, d / norm);
  }
  return {1, 0, 0, 0, 1, 0, 0, 0, 1};
}

/// Files have moments about the centroid, in axes of their own that `axes` leads to the link's: I_o = R I Rᵀ + m (c·c 1 − c cᵀ), h = m c.
spatial_inertia<double> inertia_of(const given_inertia &inertia) {
  const auto &[xx, yy, zz, xy, yz, zx] = inertia.moments;
  const mat3x3<double> I = turned(rotation_of(inertia.axes), {xx, xy, zx, xy, yy, yz, zx, yz, zz}); // in link axes
  const double m = inertia.mass;
  const vec3<double> &c = inertia.center_of_mass;
  spatial_inertia<double> about_origin{};
  about_origin.m = m;
  about_origin.h = {m * c.x, m * c.y, m * c.z};
  about_origin.Ixx = I.m00 + m * (c.y * c.y + c.z * c.z);
  about_origin.Iyy = I.m11 + m * (c.z * c.z + c.x * c.x);
  about_origin.Izz = I.m22 + m * (c.x * c.x + c.y * c.y);
  about_origin.Ixy = I.m10 - m * c.x * c.y;
  about_origin.Iyz = I.m21 - m * c.y * c.z;
  about_origin.Izx = I.m20 - m * c.z * c.x;
  return about_origin;
}

vec3<double> direction_of(const vec3<double> &axis) {
  // by the largest first: the squares of what is left neither overflow nor underflow together
  const double largest = std::max({std::fabs(axis.x), std::fabs(axis.y), std::fabs(axis.z)});
  const double x = axis.x / largest, y = axis.y / largest, z = axis.z / largest;
  const double norm = std::sqrt(x * x + y * y + z * z);
  return {x / norm, y / norm, z / norm};
}

double pitch_of(double metres_a_revolution) {
  constexpr double revolution = 6.283185307179586;
  return metres_a_revolution / revolution;
}

} // namespace ksl::given
