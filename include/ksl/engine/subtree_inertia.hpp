// KSL: inertias of subtrees, each in the frame of its root body: the composite rigid bodies of Featherstone, RBDA (2008),
// table 6.2.  Bodies are taken from the last to the first.
#pragma once

#include "ksl/engine/joints.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// The subtree inertia of body i: its own inertia plus `children`, the sum over its children.
template <class T> KSL_LANES spatial_inertia<T> subtree_inertia(const model_view<scalar_of<T>> &model,
                                                                const per_body<spatial_inertia, T> &children, int i) {
  spatial_inertia<T> I = own_inertia<T>(model, i);
  if (model.body[i].has_children) {
    const spatial_inertia<T> sum = children[i];
    algebra<T>::spatial_inertia_added(&I, &sum, &I);
  }
  return I;
}

/// Adds the subtree inertia of body i to the sum over its parent's children.
template <joint_kind K, class T>
KSL_LANES void add_to_parent(spatial_inertia<T> I, const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                             const per_body<spatial_inertia, T> &children, int i) {
  using A = algebra<T>;
  const body<scalar_of<T>> &b = model.body[i];
  if (b.parent == 0)
    return;
  const auto D = joint<K>::kept_pose(b, pose);
  D.to_parent(I);
  A::spatial_inertia_translated(&I, &D.t, &I);
  if (b.v_end != model.body[b.parent].v_end) { // another child of the same parent has been added before
    const spatial_inertia<T> others = children[b.parent];
    A::spatial_inertia_added(&I, &others, &I);
  }
  children.set(b.parent, I);
}

} // namespace KSL_ISA
} // namespace ksl
