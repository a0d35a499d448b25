// KSL: the mass matrix, by the composite-rigid-body algorithm.
//
// Featherstone, RBDA (2008), table 6.2.  The inertias of the subtrees are summed from the leaves to the root, each in the axes of
// its own joint.  An element of M is the momentum of a subtree at unit velocity of its joint, projected on the motion of an
// ancestor's joint.
#pragma once

#include "ksl/engine/base_axes.hpp"
#include "ksl/engine/symmetric_matrix.hpp"
#include "ksl/engine/subtree_inertia.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// The axis of a joint: its direction, and the joint's origin.
template <class T> struct joint_axis { vec3<T> z, origin; };

template <class T> struct mass_matrix_workspace {
  pose_workspace<T> pose;
  per_body<mat3x3, T> rotation;                ///< axes of each body in those of the base
  per_body<spatial_inertia, T> children;       ///< sum of the subtree inertias of each body's children, in its frame
  array_of<joint_axis<T>> axis;                ///< of each body's joint, in the frame of the base

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, rotation, children, axis);
  }
};

/// Sets the elements of M for a momentum about `origin` and the ancestor's joint j, which is not a revolute joint.
template <class T>
KSL_LANES void set_ancestor(const body<scalar_of<T>> &b, const mass_matrix_workspace<T> &w, int j, const vec3<T> &origin,
                                    const coscrew<T> &momentum, index column, symmetric_matrix<T> M) {
  by_slower_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
    T felt[joint<K>::nv];
    effort_in_base<K>(b, w.rotation, j, about_point(w.axis[j].origin, origin, momentum), felt);
    for_each_coordinate<joint<K>::nv>([&](auto k) KSL_INLINED { M.set(b.v_index + k, column, felt[k]); });
  });
}

/// Sets the elements of column `column` of M above those of joint i itself, and their mirror images: the projections of a
/// momentum on the joints that carry joint i.  The momentum is about the origin of joint i and in its axes.
template <class T>
KSL_LANES void set_ancestors(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, int i, coscrew<T> momentum,
                             index column, symmetric_matrix<T> M) {
  const mat3x3<T> R = w.rotation[i];
  algebra<T>::product_CoAdrc(&R, &momentum, &momentum);
  const vec3<T> origin = w.axis[i].origin;
  index written = model.body[i].v_index; // columns from here on are written
  for (int j = model.body[i].parent; j > 0;) {
    const body<scalar_of<T>> &b = model.body[j];
    M.clear(column, b.v_index + b.nv, written);
    if (only_turns(b.kind)) // rows are consecutive along the chain
      for (index k = j, row = b.v_index; k >= b.chain_start; --k, --row) {
        const coscrew<T> p = about_point(w.axis[k].origin, origin, momentum);
        M.set(row, column, algebra<T>::dot_vv(&w.axis[k].z, &p.ang));
      }
    else
      set_ancestor(b, w, j, origin, momentum, column, M);
    written = model.body[b.chain_start].v_index;
    j = model.body[b.chain_start].parent;
  }
  M.clear(column, 0, written);
}

/// Sets the columns of joint i, and adds the inertia of its subtree to its parent.
template <joint_kind K, int n = joint<K>::nv, class T>
KSL_LANES void set_columns(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, int i, symmetric_matrix<T> M) {
  const body<scalar_of<T>> &b = model.body[i];
  const index first = b.v_index;
  const spatial_inertia<T> I = subtree_inertia(model, w.children, i);
  coscrew<T> momentum[n];
  for_each_coordinate<n>([&](auto c) KSL_INLINED {
    momentum[c] = joint<K>::template momentum<c>(b, I);
    T own[n];
    joint<K>::effort(b, momentum[c], own);
    if (model.physics)
      own[c] = own[c] + T(model.physics[first + c].armature);
    for (int k = 0; k <= c; ++k)
      M.set(first + k, first + c, n > 1 ? own[k] + T(0) : own[k]); // turns −0 into 0
  });
  add_to_parent<K>(I, model, w.pose, w.children, i);
  for (int c = 0; c < n; ++c) {
    if (b.parent == 0)
      M.clear(first + c, 0, first);
    else
      set_ancestors(model, w, i, momentum[c], first + c, M);
    M.clear(first + c, b.v_end, M.n);
  }
}

/// M (nv, nv), row-major, for q (nq).  For scalars other than plain numbers, only the upper triangle is written, without the
/// zeros that follow from the shape of the tree.
template <class T>
void elements_of_mass_matrix(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  w.axis[0].origin = {T(0), T(0), T(0)};
  const auto locate = [&]<joint_kind K>(int i, const vec3<T> &offset) KSL_INLINED {
    w.axis[i].z = axis_of(w.rotation, i);
    algebra<T>::add_vv(&w.axis[model.body[i].parent].origin, &offset, &w.axis[i].origin);
  };
  express_in_base(model, w.pose, w.rotation, q, locate, [](auto) KSL_INLINED {});
  for (int i = model.bodies - 1; i > 0; --i)
    by_kind(model.body[i].kind, [&]<joint_kind K>() KSL_INLINED { set_columns<K>(model, w, i, symmetric_matrix<T>{M, model.nv}); });
}

/// M (nv, nv), row-major and symmetric, for q (nq): tau = M a + bias.  O(bodies × depth), besides writing nv² numbers.
template <class T>
void mass_matrix(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  const symmetric_matrix<T> elements = {M, model.nv};
  elements.clear_all();
  elements_of_mass_matrix(model, w, q, M);
  elements.mirror();
}

} // namespace KSL_ISA
} // namespace ksl
