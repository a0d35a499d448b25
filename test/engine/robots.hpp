// Robots described in the program, with results that can be written down.
#pragma once

#include "ksl/dynamics.hpp"

#include <cmath>

namespace robots {

/// The inertia of a body with its centroid at c and the given moments about it.
inline ksl::spatial_inertia<double> solid(double mass, ksl::vec3<double> c, double Ixx = 0, double Iyy = 0,
                                          double Izz = 0) {
  ksl::spatial_inertia<double> I;
  ksl::algebra<double>::spatial_inertia_fromMassCentroid(mass, &c, Ixx, Iyy, Izz, 0, 0, 0, &I);
  return I;
}

inline ksl::link_description link(const char *name, const ksl::spatial_inertia<double> &I = {}) {
  ksl::link_description l;
  l.name = name;
  l.inertia = I;
  l.has_inertial = I.m > 0;
  return l;
}

inline ksl::joint_description joint(const char *name, ksl::joint_kind kind, int parent, int child, ksl::vec3<double> at,
                                    ksl::vec3<double> axis) {
  ksl::joint_description j;
  j.name = name;
  j.kind = kind;
  j.parent = parent;
  j.child = child;
  j.placement = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, at};
  j.axis = axis;
  return j;
}

/// Two point masses on massless rods that hang down −z and turn about y.
inline ksl::robot_description double_pendulum(double m1, double l1, double m2, double l2) {
  ksl::robot_description r;
  r.name = "double pendulum";
  r.links = {link("ceiling"), link("first", solid(m1, {0, 0, -l1})), link("second", solid(m2, {0, 0, -l2}))};
  r.joints = {joint("shoulder", ksl::joint_kind::continuous, 0, 1, {0, 0, 0}, {0, 1, 0}),
              joint("elbow", ksl::joint_kind::revolute, 1, 2, {0, 0, -l1}, {0, 1, 0})};
  return r;
}

inline ksl::robot_description pendulum(double m, double l) {
  ksl::robot_description r = double_pendulum(m, l, 0, 0);
  r.links.pop_back();
  r.joints.pop_back();
  return r;
}

/// Makes the quaternions of q (nq) unit ones.
template <class S> void normalize_quaternions(const ksl::model &m, S *q) {
  for (const ksl::model::quaternion_in_q &quaternion : m.quaternions()) {
    S *const p = q + quaternion.q_index, length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
    for (int k = 0; k < 4; ++k)
      p[k] /= length;
  }
}

} // namespace robots
