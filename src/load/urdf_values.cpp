#include "load/urdf_values.hpp"

#include "load/words.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::load {

namespace {

constexpr mat3x3<double> identity = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/// Rz(yaw) Ry(pitch) Rx(roll): angles about fixed axes, x first.
mat3x3<double> rotation_from_rpy(const std::array<double, 3> &rpy) {
  const double cr = std::cos(rpy[0]), sr = std::sin(rpy[0]);
  const double cp = std::cos(rpy[1]), sp = std::sin(rpy[1]);
  const double cy = std::cos(rpy[2]), sy = std::sin(rpy[2]);
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

mat3x3<double> rotation_from_unit_quaternion(double x, double y, double z, double w) {
  return {1 - 2 * (y * y + z * z), 2 * (x * y + w * z),     2 * (x * z - w * y), //
          2 * (x * y - w * z),     1 - 2 * (x * x + z * z), 2 * (y * z + w * x), //
          2 * (x * z + w * y),     2 * (y * z - w * x),     1 - 2 * (x * x + y * y)};
}

mat3x3<double> rotation_from_quaternion(const element &origin, int minor) {
  if (minor < 1)
    origin.refuse("quat_xyzw came with URDF 1.1; write version=\"1.1\" in <robot>, or rpy instead");
  if (origin.has("rpy"))
    origin.refuse("<origin> gives both rpy and quat_xyzw; keep one of them");
  const auto [x, y, z, w] = origin.numbers<4>("quat_xyzw");
  const double norm = std::sqrt(x * x + y * y + z * z + w * w);
  if (!(std::fabs(norm - 1) <= 1e-3))
    origin.refuse("quat_xyzw has length " + shown(norm) + ", expected 1; divide its numbers by that, or mend them");
  return rotation_from_unit_quaternion(x / norm, y / norm, z / norm, w / norm);
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

mat3x3<double> inertia_matrix_in(const element &inertia) {
  inertia.expect({"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}, {});
  const auto of = [&](const char *name) {
    return inertia.required_number(name, "give all of ixx, ixy, ixz, iyy, iyz, izz");
  };
  const double xx = of("ixx"), xy = of("ixy"), xz = of("ixz"), yy = of("iyy"), yz = of("iyz"), zz = of("izz");
  return {xx, xy, xz, xy, yy, yz, xz, yz, zz};
}

} // namespace

SE3<double> origin_in(const element &parent, int minor) {
  SE3<double> D = {identity, {0, 0, 0}};
  const element origin = parent.child("origin");
  if (!origin)
    return D;
  origin.expect({"xyz", "rpy", "quat_xyzw"}, {});
  if (origin.has("xyz")) {
    const auto [x, y, z] = origin.numbers<3>("xyz");
    D.t = {x, y, z};
  }
  if (origin.has("quat_xyzw"))
    D.R = rotation_from_quaternion(origin, minor);
  else if (origin.has("rpy"))
    D.R = rotation_from_rpy(origin.numbers<3>("rpy"));
  return D;
}

spatial_inertia<double> inertia_in(const element &inertial, int minor) {
  inertial.expect({}, {"origin", "mass", "inertia"});
  const element mass = inertial.child("mass"), inertia = inertial.child("inertia");
  if (!mass)
    inertial.refuse("<inertial> has no <mass>; add <mass value=\"...\"/>, or remove <inertial>");
  if (!inertia)
    inertial.refuse("<inertial> has no <inertia>; add <inertia ixx=\"...\" .../>, or remove <inertial>");
  mass.expect({"value"}, {});
  const double m = mass.required_number("value", "write <mass value=\"1.5\"/> for example, in kg");
  const SE3<double> D = origin_in(inertial, minor);
  const mat3x3<double> I = turned(D.R, inertia_matrix_in(inertia)); // about the centroid, in link axes
  const vec3<double> c = D.t;
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

namespace {

/// The unit vector in the xyz of an <axis> or <axis2>.
vec3<double> direction_in(const element &axis) {
  const std::string tag = "<" + axis.tag(), example = tag + " xyz=\"0 0 1\"/> for example";
  axis.expect({"xyz"}, {});
  if (!axis.has("xyz"))
    axis.refuse(tag + "> has no xyz; write " + example);
  const auto [x, y, z] = axis.numbers<3>("xyz");
  // scaled first, so that squares neither overflow nor underflow
  const double largest = std::max({std::fabs(x), std::fabs(y), std::fabs(z)});
  if (largest == 0)
    axis.refuse("the axis is zero; give the direction of motion, " + example);
  const double ax = x / largest, ay = y / largest, az = z / largest;
  const double norm = std::sqrt(ax * ax + ay * ay + az * az);
  return {ax / norm, ay / norm, az / norm};
}

} // namespace

vec3<double> axis_in(const element &joint) {
  const element axis = joint.child("axis");
  return axis ? direction_in(axis) : vec3<double>{1, 0, 0};
}

vec3<double> axis2_in(const element &joint) {
  const element axis = joint.child("axis2");
  if (!axis)
    joint.refuse("a universal joint needs its second axis; write <axis2 xyz=\"0 1 0\"/> for example, which is fixed in the child link");
  return direction_in(axis);
}

double pitch_in(const element &joint, const char *tag) {
  const element pitch = joint.child(tag);
  const std::string mend = "write <" + std::string(tag) + " value=\"0.005\"/>, the advance along the axis in metres for each revolution";
  if (!pitch)
    joint.refuse("a helical joint needs its pitch; " + mend);
  pitch.expect({"value"}, {});
  constexpr double revolution = 6.283185307179586;
  return pitch.required_number("value", mend) / revolution;
}

} // namespace ksl::load
