// KSL: the centroidal momentum matrix, which maps joint velocities to the momentum about the centre of mass.
//
// Orin, Goswami, Lee, Centroidal dynamics of a humanoid robot, Autonomous Robots 35 (2013), sections 3 and 4: a column is the
// momentum of a subtree at unit velocity of its joint.  Subtree inertias are summed as for the mass matrix, each in the axes of its
// own joint, in which the momentum of a column is an element of the inertia.
#pragma once

#include "ksl/engine/subtree_inertia.hpp"
#include "ksl/engine/subtree_moment.hpp"
#include "ksl/engine/world_axes.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct centroidal_momentum_matrix_workspace {
  world_axes<T> bodies;
  per_body<moments, T> children; ///< sum of the subtree inertias of each body's children, in its frame

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    bodies.lay_out(memory, model);
    memory.lay_out(model.bodies, children);
  }
};

/// Stores column c of a matrix (6, nv), linear first.
template <class T> KSL_LANES void put_column(const coscrew<T> &p, T *matrix, std::ptrdiff_t nv, std::ptrdiff_t c) {
  matrix[c] = p.lin.x, matrix[nv + c] = p.lin.y, matrix[2 * nv + c] = p.lin.z;
  matrix[3 * nv + c] = p.ang.x, matrix[4 * nv + c] = p.ang.y, matrix[5 * nv + c] = p.ang.z;
}

/// Sets the columns of joint i, about the reference point, adds the inertia of its subtree to its parent, and the first moment of a
/// subtree that the ground carries to `all`.
template <joint_kind K, class T>
KSL_LANES void set_momenta(const model_view<scalar_of<T>> &model, const centroidal_momentum_matrix_workspace<T> &w, int i,
                           T *matrix, mass_moment<T> &all) {
  using A = algebra<T>;
  const body<scalar_of<T>> &b = model.body[i];
  const spatial_inertia<T> I = subtree_inertia(model, w.children, i);
  const mat3x3<T> R = w.bodies.rotation[i];
  const vec3<T> origin = w.bodies.origin[i];
  for_each_coordinate<joint<K>::nv>([&](auto c) KSL_INLINED {
    coscrew<T> p = joint<K>::template momentum<c>(b, I);
    A::product_CoAdrc(&R, &p, &p);
    A::product_CoAdtc(&origin, &p, &p);
    put_column(p, matrix, model.nv, b.v_index + c);
  });
  add_to_parent<K>(I, model, w.bodies.pose, w.children, i);
  if (b.parent == 0) {
    mass_moment<T> subtree = {I.m, I.h};
    A::product_drv(&R, &subtree.h, &subtree.h);
    A::axpy_vv(I.m, &origin, &subtree.h);
    all = added(all, subtree);
  }
}

/// A (6, nv), row-major: A v is the momentum of the bodies that move, about their centre of mass and in the world's axes, linear
/// first, for q (nq).  O(bodies).
template <class T>
void centroidal_momentum_matrix(const model_view<scalar_of<T>> &model, const centroidal_momentum_matrix_workspace<T> &w, const T *q,
                                T *matrix) {
  mass_moment<T> all = {T(0), {T(0), T(0), T(0)}};
  express_in_world(model, w.bodies, q);
  for (int i = model.bodies - 1; i > 0; --i)
    by_kind(model.body[i].kind, [&]<joint_kind K>() KSL_INLINED { set_momenta<K>(model, w, i, matrix, all); });

  const vec3<T> center = point_of_momentum(all);
  const std::ptrdiff_t nv = model.nv;
  const T *const x = matrix, *const y = x + nv, *const z = y + nv;
  T *const about_x = matrix + 3 * nv, *const about_y = about_x + nv, *const about_z = about_y + nv;
  for (std::ptrdiff_t c = 0; c < nv; ++c) { // τ − center × f
    about_x[c] = about_x[c] - (center.y * z[c] - center.z * y[c]);
    about_y[c] = about_y[c] - (center.z * x[c] - center.x * z[c]);
    about_z[c] = about_z[c] - (center.x * y[c] - center.y * x[c]);
  }
}

} // namespace KSL_ISA
} // namespace ksl
