// KSL: the mass matrix, by the composite-rigid-body algorithm.
//
// Featherstone, RBDA (2008), table 6.2.  The inertias of the subtrees are summed from the leaves to the root, each in the axes of
// its own joint.  An element of M is the momentum of a subtree at unit velocity of its joint, projected on the motion of an
// ancestor's joint: the scalar product of two screws about the origin of the base.
#pragma once

#include "ksl/engine/steps/base_axes.hpp"
#include "ksl/engine/steps/subtree_inertia.hpp"
#include "ksl/engine/steps/tree_rows.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct mass_matrix_workspace {
  pose_workspace<T> pose;
  per_body<mat3x3, T> rotation;  ///< axes of each body in those of the base
  per_body<moments, T> children; ///< sum of the subtree inertias of each body's children, in its frame
  array_of<vec3<T>> origin;      ///< of each body, in the frame of the base
  array_of<screw<T>> column;     ///< of the motion subspaces, about the base's origin and in its axes

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, rotation, children, origin);
    column.lay_out(memory, model.nv);
  }
};

/// Axes, origins and joint columns of all bodies, in the frame of the base.
template <class T> KSL_LANES void locate_joints(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q) {
  w.origin[0] = {T(0), T(0), T(0)};
  const auto locate = [&]<joint_kind K>(int i, const vec3<T> &offset) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    const vec3<T> &p = w.origin[b.parent];
    const vec3<T> o = {p.x + offset.x, p.y + offset.y, p.z + offset.z};
    w.origin[i] = o;
    for_coordinates<K>(b, [&](auto c) KSL_INLINED {
      w.column[b.v_index + c] = joint<K>::column(c, b, w.rotation, i).about(o);
    });
  };
  express_in_base(model, w.pose, w.rotation, q, locate, [](auto) KSL_INLINED {});
}

/// Expresses a momentum of body i in the frame of the base.
template <joint_kind K, class T>
KSL_LANES coscrew<T> in_base(const mass_matrix_workspace<T> &w, int i, const coscrew<T> &momentum) {
  using A = algebra<T>;
  const mat3x3<T> R = w.rotation[i];
  coscrew<T> p;
  if constexpr (only_turns(K)) { // a body that turns about z has no linear momentum along z
    p.lin = {R.m00 * momentum.lin.x + R.m01 * momentum.lin.y, R.m10 * momentum.lin.x + R.m11 * momentum.lin.y,
             R.m20 * momentum.lin.x + R.m21 * momentum.lin.y};
    A::product_drv(&R, &momentum.ang, &p.ang);
  } else {
    A::product_CoAdrc(&R, &momentum, &p);
  }
  const vec3<T> o = w.origin[i];
  A::product_CoAdtc(&o, &p, &p);
  return p;
}

/// Sets the elements of column `column` of M above those of joint i itself: the projections of a momentum, about the base's
/// origin and in its axes, on the joints that carry joint i.
template <class T, class Matrix>
KSL_LANES void set_ancestors(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, int i, const coscrew<T> &p,
                             index column, Matrix M) {
  index written = model.body[i].v_index; // columns from here on are written
  for (int j = model.body[i].parent; j > 0;) {
    const body<scalar_of<T>> &b = model.body[j], &start = model.body[b.line_start];
    M.clear(column, b.v_index + b.nv, written);
    index place = b.ancestors + b.nv - 1, row = b.v_index + b.nv - 1;
    const index last = start.is_base ? start.v_index + start.nv : start.v_index;
    for (; row >= last; --row, --place) {
      const screw<T> &s = w.column[row];
      M.set(row, place, column, (s.lin.x * p.lin.x + s.lin.y * p.lin.y + s.lin.z * p.lin.z) +
                                    (s.ang.x * p.ang.x + s.ang.y * p.ang.y + s.ang.z * p.ang.z));
    }
    if (start.is_base) { // the columns of a floating base are unit twists
      const T felt[6] = {p.lin.x, p.lin.y, p.lin.z, p.ang.x, p.ang.y, p.ang.z};
      for_each_coordinate_backwards<6>([&](auto k) KSL_INLINED { M.set(start.v_index + k, k, column, felt[k]); });
    }
    written = start.v_index;
    j = start.parent;
  }
  M.clear(column, 0, written);
}

/// Sets the columns of joint i, and adds the inertia of its subtree to its parent.
template <joint_kind K, int n = joint<K>::nv, class T, class Matrix>
KSL_LANES void set_columns(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, int i, Matrix M) {
  const body<scalar_of<T>> &b = model.body[i];
  const index first = b.v_index;
  const spatial_inertia<T> I = subtree_inertia(model, w.children, i);
  coscrew<T> momentum[n];
  for_coordinates<K>(b, [&](auto c) KSL_INLINED {
    momentum[c] = joint<K>::momentum(c, b, I);
    T own[n];
    joint<K>::effort(b, momentum[c], own);
    if (model.physics)
      own[c] = own[c] + T(model.physics[first + c].armature);
    for (int k = 0; k <= c; ++k)
      M.set(first + k, b.ancestors + k, first + c, coordinates<K>(b) > 1 ? own[k] + T(0) : own[k]); // turns −0 into 0
  });
  add_to_parent<K>(I, model, w.pose, w.children, i);
  for (int c = 0; c < coordinates<K>(b); ++c) {
    if (b.parent == 0)
      M.clear(first + c, 0, first);
    else
      set_ancestors(model, w, i, in_base<K>(w, i, momentum[c]), first + c, M);
    M.clear(first + c, b.v_end, model.nv);
  }
}

/// Sets the elements of M for q (nq) in a matrix of one of several layouts.
template <class T, class Matrix>
KSL_LANES void set_mass_matrix(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, Matrix M) {
  locate_joints(model, w, q);
  for (int i = model.bodies - 1; i > 0; --i)
    by_kind(model.body[i].kind, [&]<joint_kind K>() KSL_INLINED { set_columns<K>(model, w, i, M); });
}

/// M (nv, nv), row-major, for q (nq).  For scalars other than plain numbers, only the upper triangle is written, without the
/// zeros that follow from the shape of the tree.
template <class T>
void elements_of_mass_matrix(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  set_mass_matrix(model, w, q, symmetric_matrix<T>{M, model.nv});
}

/// M (nv, nv), row-major and symmetric, for q (nq): tau = M a + bias.  O(bodies × depth), besides writing nv² numbers.
template <class T>
void mass_matrix(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  const symmetric_matrix<T> elements = {M, model.nv};
  elements.clear_all();
  elements_of_mass_matrix(model, w, q, M);
  elements.mirror();
}

/// The upper triangle of M (nv, nv), zeros included.  The elements below it are left as they are.
template <class T>
void mass_matrix_upper(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  const upper_triangle<T> elements = {M, model.nv};
  elements.clear_all();
  set_mass_matrix(model, w, q, elements);
}

/// The elements of M that aren't zero by the shape of the tree: the lower triangle in compressed sparse rows (tree_rows.hpp).
template <class T>
void mass_matrix_tree(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  set_mass_matrix(model, w, q, compressed_rows<T>(model, M));
}

} // namespace KSL_ISA
} // namespace ksl
