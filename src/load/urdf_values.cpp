//     origin      xyz="x y z" rpy="roll pitch yaw"       R = Rz(yaw) Ry(pitch) Rx(roll); or quat_xyzw="x y z w"
//     inertial    origin: the centroid, and axes there; mass value; inertia ixx … about the centroid, in these axes
//
// What is left out is zero, or the identity; axes are x where <axis> is missing, as URDF has it.
#include "load/urdf_values.hpp"

#include "description/parts/given.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::readers {

using namespace given;
using namespace text;

namespace {

given_rotation quaternion_in(const element &origin, int minor) {
  if (minor < 1)
    origin.refuse("quat_xyzw came with URDF 1.1; write version=\"1.1\" in <robot>, or rpy instead");
  if (origin.has("rpy"))
    origin.refuse("<" + origin.tag() + "> gives both rpy and quat_xyzw; keep one of them");
  const auto [x, y, z, w] = origin.numbers<4>("quat_xyzw");
  const double norm = std::sqrt(x * x + y * y + z * z + w * w);
  if (!(std::fabs(norm - 1) <= 1e-3))
    origin.refuse("quat_xyzw has length " + shown(norm) + ", expected 1; divide its numbers by that, or mend them");
  return {given_rotation::quaternion, {x, y, z, w}};
}

std::array<double, 6> moments_in(const element &inertia) {
  inertia.expect({"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}, {});
  const auto of = [&](const char *name) {
    return inertia.required_number(name, "give all of ixx, ixy, ixz, iyy, iyz, izz");
  };
  const double xx = of("ixx"), xy = of("ixy"), xz = of("ixz"), yy = of("iyy"), yz = of("iyz"), zz = of("izz");
  return {xx, yy, zz, xy, yz, xz};
}

} // namespace

SE3<double> pose_in(const element &origin, int minor, given_rotation &rotation) {
  rotation = {};
  SE3<double> D = {rotation_of(rotation), {0, 0, 0}};
  if (origin.has("xyz")) {
    const auto [x, y, z] = origin.numbers<3>("xyz");
    D.t = {x, y, z};
  }
  if (origin.has("quat_xyzw")) {
    rotation = quaternion_in(origin, minor);
  } else if (origin.has("rpy")) {
    const auto [roll, pitch, yaw] = origin.numbers<3>("rpy");
    rotation = {given_rotation::rpy, {roll, pitch, yaw}};
  }
  D.R = rotation_of(rotation);
  return D;
}

SE3<double> origin_in(const element &parent, int minor, given_rotation &rotation) {
  rotation = {};
  const element origin = parent.child("origin");
  if (!origin)
    return {rotation_of(rotation), {0, 0, 0}};
  origin.expect({"xyz", "rpy", "quat_xyzw"}, {});
  return pose_in(origin, minor, rotation);
}

given_inertia inertia_in(const element &inertial, int minor) {
  inertial.expect({}, {"origin", "mass", "inertia"});
  const element mass = inertial.child("mass"), inertia = inertial.child("inertia");
  if (!mass)
    inertial.refuse("<inertial> has no <mass>; add <mass value=\"...\"/>, or remove <inertial>");
  if (!inertia)
    inertial.refuse("<inertial> has no <inertia>; add <inertia ixx=\"...\" .../>, or remove <inertial>");
  mass.expect({"value"}, {});
  given_inertia given;
  given.mass = mass.required_number("value", "write <mass value=\"1.5\"/> for example, in kg");
  given.center_of_mass = origin_in(inertial, minor, given.axes).t;
  given.moments = moments_in(inertia);
  return given;
}

vec3<double> direction_in(const element &axis) {
  const std::string tag = "<" + axis.tag(), example = tag + " xyz=\"0 0 1\"/> for example";
  axis.expect({"xyz"}, {});
  if (!axis.has("xyz"))
    axis.refuse(tag + "> has no xyz; write " + example);
  const auto [x, y, z] = axis.numbers<3>("xyz");
  if (x == 0 && y == 0 && z == 0)
    axis.refuse("the axis is zero; give the direction of motion, " + example);
  return {x, y, z};
}

vec3<double> axis_in(const element &joint) {
  const element axis = joint.child("axis");
  return axis ? direction_in(axis) : vec3<double>{1, 0, 0};
}

vec3<double> axis2_in(const element &joint) {
  const element axis = joint.child("axis2");
  if (!axis)
    joint.refuse(
        "a universal joint needs its second axis; write <axis2 xyz=\"0 1 0\"/> for example, which is fixed in the child link");
  return direction_in(axis);
}

double pitch_in(const element &joint, const char *tag) {
  const element pitch = joint.child(tag);
  const std::string mend =
      "write <" + std::string(tag) + " value=\"0.005\"/>, the advance along the axis in metres for each revolution";
  if (!pitch)
    joint.refuse("a helical joint needs its pitch; " + mend);
  pitch.expect({"value"}, {});
  return pitch.required_number("value", mend);
}

} // namespace ksl::readers
