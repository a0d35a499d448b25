// KSL: masses and first moments of subtrees, each in the frame of its root body: subtree_inertia.hpp without moments of inertia.
// Bodies are taken from the last to the first.
#pragma once

#include "ksl/engine/model/joints.hpp"

namespace ksl {

/// A mass and its first moment, mass × centroid.
template <class T> struct mass_moment {
  T m;
  vec3<T> h;
};

inline namespace KSL_ISA {

template <class T> KSL_LANES mass_moment<T> added(const mass_moment<T> &a, const mass_moment<T> &b) {
  mass_moment<T> sum = {a.m + b.m, a.h};
  algebra<T>::xpy_vv(&b.h, &sum.h);
  return sum;
}

/// Moves a first moment from a body's frame to its parent's.
template <class T, class Pose> KSL_LANES mass_moment<T> in_parent(mass_moment<T> of, const Pose &D) {
  D.to_parent(of.h);
  algebra<T>::axpy_vv(of.m, &D.t, &of.h);
  return of;
}

/// The mass and first moment of the subtree of body i: its own plus `children`, the sum over its children.
template <class T> KSL_LANES mass_moment<T> subtree_moment(const model_view<scalar_of<T>> &model,
                                                           const per_body<mass_moment, T> &children, int i) {
  const spatial_inertia<T> I = own_inertia<T>(model, i);
  const mass_moment<T> own = {I.m, I.h};
  return model.body[i].has_children ? added(own, children[i]) : own;
}

/// Adds mass and first moment of the subtree of body i, already in the frame of its parent, to the sum over the parent's children.
template <class T>
KSL_LANES void add_to_parent(const mass_moment<T> &subtree, const model_view<scalar_of<T>> &model,
                             const per_body<mass_moment, T> &children, int i) {
  const body<scalar_of<T>> &b = model.body[i];
  const bool first = b.v_end == model.body[b.parent].v_end; // of the parent's children
  children.set(b.parent, first ? subtree : added(subtree, children[b.parent]));
}

/// The centroid; NaN without mass.
template <class T> KSL_LANES vec3<T> centroid(const mass_moment<T> &of) {
  return {of.h.x / of.m, of.h.y / of.m, of.h.z / of.m};
}

/// The mass, by which momenta are divided; 1 where it is zero, since all momenta are zero then.
template <class T> KSL_LANES T mass_divisor(const mass_moment<T> &of) {
  return math<T>::select(of.m > T(0), of.m, T(1));
}

/// The point about which momenta are taken: the centroid, or the origin without mass.
template <class T> KSL_LANES vec3<T> point_of_momentum(const mass_moment<T> &of) {
  const T divisor = mass_divisor(of);
  return {of.h.x / divisor, of.h.y / divisor, of.h.z / divisor};
}

} // namespace KSL_ISA
} // namespace ksl
