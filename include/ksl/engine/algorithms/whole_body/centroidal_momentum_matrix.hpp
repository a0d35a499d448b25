// KSL: the centroidal momentum matrix, which maps joint velocities to the momentum about the centre of mass.
//
// Orin, Goswami, Lee, Centroidal dynamics of a humanoid robot, Autonomous Robots 35 (2013), sections 3 and 4.  A column is I S, the
// momentum of a subtree at unit velocity of its joint, about the centre of mass.  The subtree inertias I are summed as for the mass
// matrix, each in the axes of its own joint.  There S is a unit vector, so that I S is a column of the inertia.
#pragma once

#include "ksl/engine/steps/frame_options.hpp"
#include "ksl/engine/steps/subtree_inertia.hpp"
#include "ksl/engine/steps/subtree_moment.hpp"
#include "ksl/engine/steps/world_axes.hpp"

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

/// The three linear and the three angular rows of a matrix (6, nv).
template <class T> struct momentum_rows {
  T *lin, *ang;
  std::ptrdiff_t nv;

  KSL_LANES void put_column(const coscrew<T> &p, std::ptrdiff_t c) const {
    lin[c] = p.lin.x, lin[nv + c] = p.lin.y, lin[2 * nv + c] = p.lin.z;
    ang[c] = p.ang.x, ang[nv + c] = p.ang.y, ang[2 * nv + c] = p.ang.z;
  }
};

/// Sets the columns of joint i, about the reference point, and adds the inertia of its subtree to its parent's.  If the ground carries
/// the joint, it adds mass and first moment of the subtree to `all`.
template <joint_kind K, class T>
KSL_LANES void set_momenta(const model_view<scalar_of<T>> &model, const centroidal_momentum_matrix_workspace<T> &w,
                           int i, const momentum_rows<T> &rows, mass_moment<T> &all) {
  using A = algebra<T>;
  const body<scalar_of<T>> &b = model.body[i];
  const spatial_inertia<T> I = subtree_inertia(model, w.children, i);
  const mat3x3<T> R = w.bodies.rotation[i];
  const vec3<T> origin = w.bodies.origin[i];
  for_coordinates<K>(b, [&](auto c) KSL_INLINED {
    coscrew<T> p = joint<K>::momentum(c, b, I);
    A::product_CoAdrc(&R, &p, &p);
    A::product_CoAdtc(&origin, &p, &p);
    rows.put_column(p, b.v_index + c);
  });
  add_to_parent<K>(I, model, w.bodies.pose, w.children, i);
  if (b.parent == 0) {
    mass_moment<T> subtree = {I.m, I.h};
    A::product_drv(&R, &subtree.h, &subtree.h);
    A::axpy_vv(I.m, &origin, &subtree.h);
    all = added(all, subtree);
  }
}

/// A (6, nv), row-major: A v is the momentum of the bodies that move, about their centre of mass and in the world's axes, for q (nq).
/// O(bodies).
template <class T>
void centroidal_momentum_matrix(const model_view<scalar_of<T>> &model, const centroidal_momentum_matrix_workspace<T> &w,
                                const T *q, component_order order, T *matrix) {
  const std::ptrdiff_t nv = model.nv;
  const bool angular_first = order == component_order::angular_first;
  const momentum_rows<T> rows = {matrix + (angular_first ? 3 * nv : 0), matrix + (angular_first ? 0 : 3 * nv), nv};
  mass_moment<T> all = {T(0), {T(0), T(0), T(0)}};
  express_in_world(model, w.bodies, q);
  for (int i = model.bodies - 1; i > 0; --i)
    by_kind(model.body[i].kind, [&]<joint_kind K>() KSL_INLINED { set_momenta<K>(model, w, i, rows, all); });

  const vec3<T> center = point_of_momentum(all);
  const T *const x = rows.lin, *const y = x + nv, *const z = y + nv;
  T *const about_x = rows.ang, *const about_y = about_x + nv, *const about_z = about_y + nv;
  for (std::ptrdiff_t c = 0; c < nv; ++c) { // τ − center × f
    about_x[c] = about_x[c] - (center.y * z[c] - center.z * y[c]);
    about_y[c] = about_y[c] - (center.z * x[c] - center.x * z[c]);
    about_z[c] = about_z[c] - (center.x * y[c] - center.y * x[c]);
  }
}

} // namespace KSL_ISA
} // namespace ksl
