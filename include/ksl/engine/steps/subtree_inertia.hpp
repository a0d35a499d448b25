// KSL: inertias of subtrees, each in the frame of its root body: the composite rigid bodies of Featherstone, RBDA (2008),
// table 6.2.  Bodies are taken from the last to the first.
//
// The mass of a subtree is a constant.  Where a joint does not move its body's origin in the parent, the mass beyond it acts on
// the parent as a point mass at that origin, a constant too: it is part of the parent's *augmented* inertia (Wittenburg, Dynamics
// of Systems of Rigid Bodies (1977), section 5.2.2).  What remains to be transformed has no mass, and costs half as much to
// translate.
#pragma once

#include "ksl/engine/model/joints.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// The first and second moments of mass: a spatial inertia but for its mass.
template <class T> struct moments {
  vec3<T> h;
  T Ixx, Iyy, Izz, Ixy, Iyz, Izx;
};

template <class T> KSL_LANES void add_moments(const moments<T> &a, spatial_inertia<T> &I) {
  algebra<T>::xpy_vv(&a.h, &I.h);
  I.Ixx = I.Ixx + a.Ixx, I.Iyy = I.Iyy + a.Iyy, I.Izz = I.Izz + a.Izz;
  I.Ixy = I.Ixy + a.Ixy, I.Iyz = I.Iyz + a.Iyz, I.Izx = I.Izx + a.Izx;
}

/// The inertia about another point, of which this one is at t; without what the mass contributes.  24 flops.
template <class T> KSL_LANES void translate_without_mass(const vec3<T> &t, spatial_inertia<T> &I) {
  const vec3<T> &h = I.h;
  const vec3<T> s = {t.x + t.x, t.y + t.y, t.z + t.z};
  const T xx = s.x * h.x, yy = s.y * h.y, zz = s.z * h.z;
  I.Ixx = I.Ixx + (yy + zz), I.Iyy = I.Iyy + (zz + xx), I.Izz = I.Izz + (xx + yy);
  I.Ixy = I.Ixy - (h.x * t.y + t.x * h.y);
  I.Iyz = I.Iyz - (h.y * t.z + t.y * h.z);
  I.Izx = I.Izx - (h.z * t.x + t.z * h.x);
}

/// The augmented inertia of body i.  Its mass is that of the subtree.
template <class T> KSL_LANES spatial_inertia<T> augmented_inertia(const model_view<scalar_of<T>> &model, int i) {
  return spread<T>(model.augmented[i]);
}

/// The subtree inertia of body i: its augmented inertia plus `children`, the sum over its children.
template <class T> KSL_LANES spatial_inertia<T> subtree_inertia(const model_view<scalar_of<T>> &model,
                                                                const per_body<moments, T> &children, int i) {
  spatial_inertia<T> I = augmented_inertia<T>(model, i);
  if (model.body[i].has_children)
    add_moments(children[i], I);
  return I;
}

/// Adds the subtree inertia of body i to the sum over its parent's children.
template <joint_kind K, class T>
KSL_LANES void add_to_parent(spatial_inertia<T> I, const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                             const per_body<moments, T> &children, int i) {
  const body<scalar_of<T>> &b = model.body[i];
  if (b.parent == 0)
    return;
  const auto D = joint<K>::kept_pose(b, pose);
  D.to_parent(I);
  if (shifts_origin<K>(b))
    algebra<T>::spatial_inertia_translated(&I, &D.t, &I);
  else
    translate_without_mass(D.t, I);
  if (b.v_end != model.body[b.parent].v_end) // another child of the same parent has been added before
    add_moments(children[b.parent], I);
  children.set(b.parent, {I.h, I.Ixx, I.Iyy, I.Izz, I.Ixy, I.Iyz, I.Izx});
}

} // namespace KSL_ISA
} // namespace ksl
