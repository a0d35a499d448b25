// KSL: the mass matrix, by the composite-rigid-body algorithm (Featherstone, RBDA (2008), table 6.2).
//
// I_i begins as the inertia of body i, and becomes that of its subtree.  λ(i) is the parent of i.
//
//     for i from the last body to the first
//       F = I_i S_i                    momentum of the subtree at unit velocity of joint i                         (1)
//       M_ii = S_iᵀ F                                                                                              (2)
//       I_λ(i) += I_i                                                                                              (3)
//       for each joint j that carries joint i
//         M_ji = M_ij = S_jᵀ F                                                                                     (4)
//
// Inertias are in the frames of their own bodies (subtree_inertia.hpp).  For (4), F and all S_j are expressed in the frame of the
// base, so that nothing has to be transformed on the way from joint i to the ground.
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
  array_of<screw<T>> column;     ///< S of each coordinate, about the base's origin and in its axes

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, rotation, children, origin);
    column.lay_out(memory, model.nv);
  }
};

/// (4) for one coordinate of joint i, `column` of M: sets its elements S_jᵀ F in the rows of all coordinates that carry the joint, and
/// zeros in the rows between.  F is in the frame of the base.  It goes from joint i to the ground, line by line (model.hpp), and in a
/// line from the last row to the first.
template <class T, class Matrix>
KSL_LANES void set_ancestors(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, int i,
                             const coscrew<T> &F, index column, Matrix M) {
  index written = model.body[i].v_index; // rows from here on are written
  for (int j = model.body[i].parent; j > 0;) {
    const body<scalar_of<T>> &b = model.body[j], &start = model.body[b.line_start];
    M.clear(column, b.v_index + b.nv, written);
    index place = b.ancestors + b.nv - 1, row = b.v_index + b.nv - 1;
    const index last = start.is_base ? start.v_index + start.nv : start.v_index;
    for (; row >= last; --row, --place) {
      const screw<T> &S = w.column[row];
      M.set(row, place, column,
            (S.lin.x * F.lin.x + S.lin.y * F.lin.y + S.lin.z * F.lin.z) +
                (S.ang.x * F.ang.x + S.ang.y * F.ang.y + S.ang.z * F.ang.z));
    }
    // S of a floating base are the unit twists, in the frame of the base: the products are the numbers of F
    if (start.is_base) {
      const T numbers[6] = {F.lin.x, F.lin.y, F.lin.z, F.ang.x, F.ang.y, F.ang.z};
      for_each_coordinate_backwards<6>([&](auto k) KSL_INLINED { M.set(start.v_index + k, k, column, numbers[k]); });
    }
    written = start.v_index;
    j = start.parent;
  }
  M.clear(column, 0, written);
}

/// Steps (1) to (4) for joint i.  M is a copy of its own, whose members stay in registers.
template <joint_kind K, class T, class Matrix>
KSL_LANES void set_columns(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, int i, Matrix M) {
  const body<scalar_of<T>> &b = model.body[i];
  const index first = b.v_index;
  const spatial_inertia<T> I = subtree_inertia(model, w.children, i);
  constexpr int n = most_coordinates<K>;
  coscrew<T> F[n];
  for_coordinates<K>(b, [&](auto c) KSL_INLINED {
    F[c] = joint<K>::momentum(c, b, I); // (1)
    T own[n];
    joint<K>::effort(b, F[c], own); // (2)
    if (model.physics)
      own[c] = own[c] + T(model.physics[first + c].armature);
    for (int k = 0; k <= c; ++k) // turns −0 into 0 where there are several
      M.set(first + k, b.ancestors + k, first + c, coordinates<K>(b) > 1 ? own[k] + T(0) : own[k]);
  });
  add_to_parent<K>(I, model, w.pose, w.children, i); // (3)
  for (int c = 0; c < coordinates<K>(b); ++c) {
    if (b.parent == 0)
      M.clear(first + c, 0, first);
    else
      set_ancestors(model, w, i, in_base<K>(w.rotation, w.origin, i, F[c]), first + c, M); // (4)
    M.clear(first + c, b.v_end, model.nv);
  }
}

/// Sets the elements of M for q (nq) in a matrix of one of several layouts (symmetric_matrix.hpp, tree_rows.hpp).
/// M.set(row, place, column, x) sets an element with row ≤ column, and M.clear(k, from, end) sets zeros, elements k with [from, end).
template <class T, class Matrix>
KSL_LANES void set_mass_matrix(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q,
                               Matrix M) {
  locate_joints(model, w.pose, w.rotation, w.origin, w.column, q);
  for (int i = model.bodies - 1; i > 0; --i)
    by_kind(model.body[i].kind, [&]<joint_kind K>() KSL_INLINED { set_columns<K>(model, w, i, M); });
}

/// M (nv, nv), row-major and symmetric, for q (nq): tau = M a + bias.  O(bodies × depth), besides writing nv² numbers.
template <class T>
void mass_matrix(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  const symmetric_matrix<T> elements = {M, model.nv};
  elements.clear_all();
  set_mass_matrix(model, w, q, elements);
}

/// The upper triangle of M (nv, nv), zeros included.  The elements below it are left as they are.
template <class T>
void mass_matrix_upper(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  const upper_triangle<T> elements = {M, model.nv};
  elements.clear_all();
  set_mass_matrix(model, w, q, elements);
}

/// The elements of M that the shape of the tree lets differ from zero: the lower triangle in compressed sparse rows (tree_rows.hpp).
template <class T>
void mass_matrix_tree(const model_view<scalar_of<T>> &model, const mass_matrix_workspace<T> &w, const T *q, T *M) {
  set_mass_matrix(model, w, q, compressed_rows<T>(model, M));
}

} // namespace KSL_ISA
} // namespace ksl
