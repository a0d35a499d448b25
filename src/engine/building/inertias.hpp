// Inertias in the forms that a model keeps, in any scalar: those of its building, and of recordings whose inertias are inputs.
#pragma once

#include "ksl/engine/model/joints.hpp"

namespace ksl {

/// The inertia about a frame's origin from the ten numbers of regressors: m, m c, Ixx Ixy Iyy Ixz Iyz Izz.
template <class T> spatial_inertia<T> inertia_of_parameters(const T *x) {
  // spatial_inertia has m, h, Ixx, Iyy, Izz, Ixy, Iyz, Izx
  return {x[0], {x[1], x[2], x[3]}, x[4], x[6], x[9], x[5], x[8], x[7]};
}

/// Adds the mass m, which body b carries or is, to the augmented inertia of its parent (subtree_inertia.hpp).
template <class T> void add_mass_beyond(const body<T> &b, const T &m, spatial_inertia<T> &parent) {
  with_joint(b.kind, [&]<class J>(J) {
    if constexpr (J::shifts_origin) {
      parent.m = parent.m + m;
    } else {
      // the joint leaves the body's origin where it is in the parent: what it carries acts there as a point mass (Wittenburg's augmented bodies)
      const T zero(0);
      const spatial_inertia<T> point = {m, {zero, zero, zero}, zero, zero, zero, zero, zero, zero};
      spatial_inertia<T> there;
      algebra<T>::spatial_inertia_translated(&point, &b.placement.t, &there);
      algebra<T>::spatial_inertia_added(&parent, &there, &parent);
    }
  });
}

} // namespace ksl
