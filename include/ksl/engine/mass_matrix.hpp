// KSL: the mass matrix, by the composite-rigid-body algorithm.
//
// Featherstone, RBDA (2008), table 6.2.  The inertias of the subtrees are summed from the leaves to the root, each in the axes of
// its own joint.  An element of M is the momentum of a subtree at unit velocity of its joint, projected on the motion of an
// ancestor's joint: the scalar product of two screws about the origin of the base.
#pragma once

#include "ksl/engine/base_axes.hpp"
#include "ksl/engine/subtree_inertia.hpp"
#include "ksl/engine/tree_rows.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// The unit twists of the joints that carry one body, from the ground on, so that a momentum is projected on several at once.
template <class T> class joint_path {
public:
  template <class S> KSL_LANES void lay_out(arena &memory, const model_view<S> &model) {
    pitch_ = is_number<T> ? padded(model.longest_path) : model.longest_path;
    first_ = memory.take<T>(6 * static_cast<int>(pitch_));
  }
  KSL_LANES void set(index place, const screw<T> &s) const {
    T *const at = first_ + place;
    at[0] = s.lin.x, at[pitch_] = s.lin.y, at[2 * pitch_] = s.lin.z;
    at[3 * pitch_] = s.ang.x, at[4 * pitch_] = s.ang.y, at[5 * pitch_] = s.ang.z;
  }
  /// out[k] = the power of f at unit rate of the joint coordinate at place k, for k in [from, end); with plain numbers other
  /// elements of the row may be written.
  KSL_LANES void project(const coscrew<T> &f, index from, index end, T *out) const {
    if constexpr (is_number<T>) {
      using P = native_pack<T>;
      for (index k = 0; k < end; k += native_lanes<T>) {
        const P power = at<P>(k, f);
        __builtin_memcpy(out + k, &power, sizeof power);
      }
    } else {
      for (index k = from; k < end; ++k)
        out[k] = at<T>(k, f);
    }
  }

private:
  template <class P> KSL_LANES P at(index k, const coscrew<T> &f) const {
    P s[6];
    for (int c = 0; c < 6; ++c)
      __builtin_memcpy(static_cast<void *>(s + c), first_ + c * pitch_ + k, sizeof(P));
    return (P(f.lin.x) * s[0] + P(f.lin.y) * s[1] + P(f.lin.z) * s[2]) +
           (P(f.ang.x) * s[3] + P(f.ang.y) * s[4] + P(f.ang.z) * s[5]);
  }

  T *first_;
  index pitch_;
};

template <class T> struct mass_matrix_workspace {
  pose_workspace<T> pose;
  per_body<mat3x3, T> rotation;  ///< axes of each body in those of the base
  per_body<moments, T> children; ///< sum of the subtree inertias of each body's children, in its frame
  array_of<vec3<T>> origin;      ///< of each body, in the frame of the base
  array_of<screw<T>> column;     ///< of the motion subspaces, about the base's origin and in its axes
  joint_path<T> path;            ///< to the body that is computed
  tree_rows<T> rows;             ///< of the mass matrix

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, rotation, children, origin);
    column.lay_out(memory, model.nv);
    path.lay_out(memory, model);
    rows.lay_out(memory, model);
  }
};

/// Axes, origins and joint columns of all bodies, in the frame of the base.
template <class T>
KSL_LANES void locate_joints(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose, const per_body<mat3x3, T> &rotation,
                             const array_of<vec3<T>> &origin, const array_of<screw<T>> &column, const T *q) {
  origin[0] = {T(0), T(0), T(0)};
  const auto locate = [&]<joint_kind K>(int i, const vec3<T> &offset) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    vec3<T> o = origin[b.parent];
    algebra<T>::xpy_vv(&offset, &o);
    origin[i] = o;
    for_each_coordinate<joint<K>::nv>([&](auto c) KSL_INLINED {
      column[b.v_index + c] = joint<K>::template column<c>(b, rotation, i).about(o);
    });
  };
  express_in_base(model, pose, rotation, q, locate, [](auto) KSL_INLINED {});
}

/// Sets the path to body i, of which that to body i + 1 is known; bodies are taken from the last to the first.  Returns where
/// the part of the path begins that has to be projected on: the coordinates of a floating base are unit twists.
template <class T>
KSL_LANES void turn_to(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, int i, index &projected) {
  if (i + 1 < model.bodies && model.body[i + 1].parent == i)
    return;
  const int beyond = i + 1 < model.bodies ? model.body[i + 1].v_index : model.nv; // what ends before it doesn't carry body i + 1
  for (int j = model.body[i].parent; j > 0 && model.body[j].v_end <= beyond; j = model.body[j].parent) {
    const body<scalar_of<T>> &b = model.body[j];
    if (b.parent == 0)
      projected = b.is_base ? b.nv : 0;
    if (!b.is_base)
      for (int c = 0; c < b.nv; ++c)
        w.path.set(b.ancestors + c, w.column[b.v_index + c]);
  }
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

/// Sets the rows of joint i, and adds the inertia of its subtree to its parent.
template <joint_kind K, int n = joint<K>::nv, class T>
KSL_LANES void set_rows(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, int i, index projected) {
  const body<scalar_of<T>> &b = model.body[i];
  const spatial_inertia<T> I = subtree_inertia(model, w.children, i);
  for_each_coordinate<n>([&](auto c) KSL_INLINED {
    T *const row = w.rows[b.v_index + c];
    const coscrew<T> momentum = joint<K>::template momentum<c>(b, I);
    T own[n];
    joint<K>::effort(b, momentum, own);
    if (b.parent > 0) {
      const coscrew<T> p = in_base<K>(w, i, momentum);
      w.path.project(p, projected, b.ancestors, row);
      if (projected > 0)
        row[0] = p.lin.x, row[1] = p.lin.y, row[2] = p.lin.z, row[3] = p.ang.x, row[4] = p.ang.y, row[5] = p.ang.z;
    }
    for (int k = 0; k <= c; ++k)
      row[b.ancestors + k] = n > 1 ? own[k] + T(0) : own[k]; // turns −0 into 0
  });
  add_to_parent<K>(I, model, w.pose, w.children, i);
}

/// Sets w.rows, the elements of M.
template <class T>
void rows_of_mass_matrix(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q) {
  locate_joints(model, w.pose, w.rotation, w.origin, w.column, q);
  index projected = 0;
  for (int i = model.bodies - 1; i > 0; --i) {
    turn_to(model, w, i, projected);
    by_kind(model.body[i].kind, [&]<joint_kind K>() KSL_INLINED { set_rows<K>(model, w, i, projected); });
  }
}

/// M (nv, nv), row-major and symmetric, for q (nq): tau = M a + bias.  O(bodies × depth), besides writing nv² numbers.
template <class T>
void mass_matrix(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  rows_of_mass_matrix(model, w, q);
  store_symmetric_rows(model, w.rows, M);
}

/// The upper triangle of M (nv, nv), zeros included.  The elements below it are left as they are.
template <class T>
void mass_matrix_upper(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  rows_of_mass_matrix(model, w, q);
  store_upper_rows(model, w.rows, M);
}

/// The elements of M that aren't zero by the shape of the tree: the lower triangle in compressed sparse rows (tree_rows.hpp).
template <class T>
void mass_matrix_tree(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  rows_of_mass_matrix(model, w, q);
  store_tree_rows(model, w.rows, M);
}

} // namespace KSL_ISA
} // namespace ksl
