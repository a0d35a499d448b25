// KSL: the mass matrix, by the composite-rigid-body algorithm.
//
// Featherstone, RBDA (2008), table 6.2.  The inertias of the subtrees are summed from the tips on, each in its joint's own
// axes.  Of a subtree's momentum at unit velocity of its joint, every ancestor's joint takes the component along its motion.
#pragma once

#include "ksl/engine/base_axes.hpp"
#include "ksl/engine/matrix_elements.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Where the axis of a joint lies: its direction, and the origin of the joint.
template <class T> struct joint_axis { vec3<T> z, origin; };

template <class T> struct mass_matrix_workspace {
  pose_workspace<T> pose;
  per_body<mat3x3, T> rotation;                ///< axes of each body in those of the base
  per_body<spatial_inertia, T> subtree_inertia; ///< of all that hangs on each body, without its own, in its frame
  array_of<joint_axis<T>> axis;                ///< of each body's joint, in the frame of the base

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    rotation.lay_out(memory, model.bodies);
    subtree_inertia.lay_out(memory, model.bodies);
    axis.lay_out(memory, model.bodies);
  }
};

/// Adds the inertia of the subtree of body i to what hangs on its parent; bodies come from the last to the first.
template <joint_kind K, class T>
KSL_LANES void add_to_parent(spatial_inertia<T> I, const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, int i) {
  using A = algebra<T>;
  const body<scalar_of<T>> &b = model.body[i];
  if (b.parent == 0)
    return;
  const auto D = joint<K>::kept_pose(b, w.pose);
  D.to_parent(I);
  A::spatial_inertia_translated(&I, &D.t, &I);
  if (b.v_end != model.body[b.parent].v_end) { // others on the same parent came before
    const spatial_inertia<T> others = w.subtree_inertia[b.parent];
    A::spatial_inertia_added(&I, &others, &I);
  }
  w.subtree_inertia.set(b.parent, I);
}

/// The moment of a momentum p at `origin` about another point.
template <class T> KSL_LANES coscrew<T> about_point(const vec3<T> &point, const vec3<T> &origin, const coscrew<T> &p) {
  using A = algebra<T>;
  vec3<T> arm;
  coscrew<T> at = p;
  A::subtract_vv(&origin, &point, &arm);
  A::cross_vv(&arm, &p.lin, &at.ang);
  A::xpy_vv(&p.ang, &at.ang);
  return at;
}

/// What joint j feels of a momentum p about its origin, in the axes of the base.
template <joint_kind K, class T>
KSL_LANES void put_ancestor(const body<scalar_of<T>> &b, const mass_matrix_workspace<T> &w, int j, const coscrew<T> &p, index nv,
                            index column, T *M) {
  T felt[joint<K>::nv];
  if (b.is_base)
    joint<K>::effort(b, p, felt);
  else
    for_each_coordinate<joint<K>::nv>([&](auto k) KSL_INLINED {
      felt[k] = joint<K>::template column<k>(b, w.rotation, j).effort(p);
    });
  for_each_coordinate<joint<K>::nv>([&](auto k) KSL_INLINED { put_element(felt[k], nv, b.v_index + k, column, M); });
}

/// What the joints that carry joint i feel of a momentum about its origin and in its axes: column `column` of M, and the row
/// left of the joint's own elements.
template <class T>
KSL_LANES void put_ancestors(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, int i, coscrew<T> momentum,
                             index column, T *M) {
  const index nv = model.nv;
  const mat3x3<T> R = w.rotation[i];
  algebra<T>::product_CoAdrc(&R, &momentum, &momentum);
  const vec3<T> origin = w.axis[i].origin;
  index written = model.body[i].v_index; // columns from here on are written
  for (index j = model.body[i].parent; j > 0;) {
    const body<scalar_of<T>> &b = model.body[j];
    clear_elements(nv, column, b.v_index + b.nv, written, M);
    if (only_turns(b.kind)) { // rows are neighbours down to the first of the chain
      for (index k = j, row = b.v_index; k >= b.chain_start; --k, --row) {
        const joint_axis<T> &axis = w.axis[static_cast<int>(k)];
        put_element(joint_column<true, false, T>{axis.z, T(0)}.effort(about_point(axis.origin, origin, momentum)), nv, row, column, M);
      }
    } else {
      by_slower_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
        const int ancestor = static_cast<int>(j);
        put_ancestor<K>(b, w, ancestor, about_point(w.axis[ancestor].origin, origin, momentum), nv, column, M);
      });
    }
    written = model.body[b.chain_start].v_index;
    j = model.body[b.chain_start].parent;
  }
  clear_elements(nv, column, 0, written, M);
}

/// Columns of joint i, and the inertia of its subtree to its parent.
template <joint_kind K, class T>
KSL_LANES void put_columns(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, int i, T *M) {
  constexpr int n = joint<K>::nv;
  const body<scalar_of<T>> &b = model.body[i];
  const index nv = model.nv, first = b.v_index;
  spatial_inertia<T> I = own_inertia<T>(model, i);
  if (b.has_children) {
    const spatial_inertia<T> children = w.subtree_inertia[i];
    algebra<T>::spatial_inertia_added(&I, &children, &I);
  }
  coscrew<T> momentum[n];
  for_each_coordinate<n>([&](auto c) KSL_INLINED {
    momentum[c] = joint<K>::template momentum<c>(b, I);
    T own[n];
    joint<K>::effort(b, momentum[c], own);
    for (int k = 0; k <= c; ++k)
      put_element(n > 1 ? own[k] + T(0) : own[k], nv, first + k, first + c, M); // no −0
  });
  add_to_parent<K>(I, model, w, i);
  for_each_coordinate<n>([&](auto c) KSL_INLINED {
    if (b.parent > 0)
      put_ancestors(model, w, i, momentum[c], first + c, M);
    else
      clear_elements(nv, first + c, 0, first, M);
    clear_elements(nv, first + c, b.v_end, nv, M);
  });
}

/// M (nv, nv), row-major, for q (nq).  Of scalars other than plain numbers: the upper triangle only, without the zeros that
/// follow from the shape of the tree.
template <class T>
void elements_of_mass_matrix(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  w.axis[0].origin = {T(0), T(0), T(0)};
  const auto locate = [&]<joint_kind K>(int i, const vec3<T> &offset) KSL_INLINED {
    w.axis[i].z = axis_of(w.rotation, i);
    algebra<T>::add_vv(&w.axis[model.body[i].parent].origin, &offset, &w.axis[i].origin);
  };
  express_in_base(model, w.pose, w.rotation, q, locate, [](auto) KSL_INLINED {});
  for (int i = model.bodies - 1; i > 0; --i)
    by_kind(model.body[i].kind, [&]<joint_kind K>() KSL_INLINED { put_columns<K>(model, w, i, M); });
}

/// M (nv, nv), row-major and symmetric, for q (nq): tau = M a + bias.  O(bodies²).
template <class T>
void mass_matrix(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  const int nv = model.nv;
  for (int k = 0; k < nv * nv && !is_number<T>; ++k)
    M[k] = T(0);
  elements_of_mass_matrix(model, w, q, M);
  for (int i = 0; i < nv && !is_number<T>; ++i)
    for (int k = 0; k < i; ++k)
      M[i * nv + k] = M[k * nv + i];
}

} // namespace KSL_ISA
} // namespace ksl
