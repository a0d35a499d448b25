// KSL: the mass matrix, by the composite-rigid-body algorithm.
//
// Featherstone, RBDA (2008), section 6.2, in one frame instead of each body's own: then inertias of subtrees are plain
// sums, nothing on the way from the leaves to the root waits for a transform, and an element of the matrix is one dot
// product.  The frame is the base's, not the world's, so that no digit is lost far from the world's origin.
#pragma once

#include "ksl/engine/forward_kinematics.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// The unit twists of a joint whose frame is at D: columns of [Ad](D).
template <class T> KSL_LANES void unit_twists(joint_kind kind, const SE3<T> &D, screw<T> *columns) {
  using A = algebra<T>;
  switch (kind) {
  case joint_kind::revolute:
  case joint_kind::continuous:
    A::hsrz(&D, columns);
    break;
  case joint_kind::prismatic:
    A::hstz(&D, columns);
    break;
  case joint_kind::floating:
    A::hstx(&D, columns);
    A::hsty(&D, columns + 1);
    A::hstz(&D, columns + 2);
    A::hsrx(&D, columns + 3);
    A::hsry(&D, columns + 4);
    A::hsrz(&D, columns + 5);
    break;
  case joint_kind::fixed:
    break;
  }
}

/// Poses, unit twists and inertias of all bodies in the frame of the base.
template <class T>
void express_in_base(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q) {
  using A = algebra<T>;
  const T zero = T(0), one = T(1);
  const SE3<T> identity = {{one, zero, zero, zero, one, zero, zero, zero, one}, {zero, zero, zero}};
  sines_and_cosines(model.nq, q, data.sine, data.cosine);
  data.in_base[0] = identity;
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    SE3<T> &D = data.in_base[i];
    if (b.parent == 0 && b.kind == joint_kind::floating) { // this body is the base
      D = identity;
    } else {
      const SE3<T> in_parent = pose_in_parent(b, data, q);
      A::product_dd(&data.in_base[b.parent], &in_parent, &D);
    }
    const spatial_inertia<T> I = spread<T>(b.inertia);
    A::spatial_inertia_transformed(&I, &D, &data.composite[i]);
    unit_twists(b.kind, D, data.unit_twist + b.v_index);
  }
}

/// M (nv, nv), row-major and symmetric, for q (nq): tau = M a + bias.  Both triangles are written.  O(bodies × depth).
template <class T> void mass_matrix(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, T *M) {
  using A = algebra<T>;
  const int nv = model.nv;
  express_in_base(model, data, q);
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    for (int column = b.v_index; column < b.v_index + row_of(b.kind).nv; ++column) {
      coscrew<T> momentum; // of all that hangs on joint i, at unit velocity
      A::product_Ms(&data.composite[i], &data.unit_twist[column], &momentum);
      for (int j = i; j > 0; j = model.body[j].parent) { // M_ij = Sⱼᵀ I Sᵢ for i and its ancestors
        const body<scalar_of<T>> &ancestor = model.body[j];
        for (int row = ancestor.v_index; row < ancestor.v_index + row_of(ancestor.kind).nv; ++row)
          M[row * nv + column] = M[column * nv + row] = A::dot_cs(&momentum, &data.unit_twist[row]);
      }
      for (int other = b.v_end; other < nv; ++other) // on another branch
        M[column * nv + other] = M[other * nv + column] = T(0);
    }
    if (b.parent > 0)
      A::spatial_inertia_added(&data.composite[b.parent], &data.composite[i], &data.composite[b.parent]);
  }
}

} // namespace KSL_ISA
} // namespace ksl
