// KSL: the centre of mass of the bodies that move, and its Jacobian.  Links that are welded to the ground don't count.
//
// Orin, Goswami, Lee, Centroidal dynamics of a humanoid robot, Autonomous Robots 35 (2013), section 3.  The first moments h = m c of
// the subtrees are summed from the leaves to the root, each in the axes of its own body.
#pragma once

#include "ksl/engine/steps/subtree_moment.hpp"
#include "ksl/engine/steps/world_axes.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct center_of_mass_workspace {
  pose_workspace<T> pose;
  per_body<mass_moment, T> children; ///< sum over the subtrees of each body's children, in its frame

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, children);
  }
};

/// The centre of mass (3) in the world, m, for q (nq).  O(bodies), about 30 flops for each.
template <class T>
void center_of_mass(const model_view<scalar_of<T>> &model, const center_of_mass_workspace<T> &w, const T *q,
                    T *center) {
  sines_and_cosines(model, w.pose, q);
  w.children.set(0, {T(0), {T(0), T(0), T(0)}}); // remains if nothing moves
  for (int i = model.bodies - 1; i > 0; --i)
    by_kind(model.body[i].kind, [&]<joint_kind K>() KSL_INLINED {
      const auto D = joint<K>::computed_pose(model.body[i], w.pose, q);
      add_to_parent(in_parent(subtree_moment(model, w.children, i), D), model, w.children, i);
    });
  const vec3<T> c = centroid(w.children[0]);
  center[0] = c.x, center[1] = c.y, center[2] = c.z;
}

template <class T> struct center_of_mass_jacobian_workspace {
  pose_workspace<T> pose;
  per_body<mat3x3, T> rotation;      ///< axes of each body in those of the world
  per_body<mass_moment, T> children; ///< as above

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, rotation, children);
  }
};

/// J (3, nv), row-major, for q (nq): J v is the velocity of the centre of mass, in the world's axes.  A column is the linear
/// momentum of a subtree at unit velocity of its joint, divided by the mass of all.  O(bodies), about 85 flops for each.
template <class T>
void center_of_mass_jacobian(const model_view<scalar_of<T>> &model, const center_of_mass_jacobian_workspace<T> &w,
                             const T *q, T *J) {
  const std::ptrdiff_t nv = model.nv;
  rotate_to_world(
      model, w.pose, w.rotation, q, []<joint_kind>(int, const auto &, const auto &) KSL_INLINED {}, [](auto) KSL_INLINED {});
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    const T o = T(0);
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      const mass_moment<T> subtree = subtree_moment(model, w.children, i);
      const mat3x3<T> R = w.rotation[i];
      for_coordinates<K>(b, [&](auto c) KSL_INLINED {
        const spatial_inertia<T> I = {subtree.m, subtree.h, o, o,
                                      o,         o,         o, o}; // linear momentum needs no moments of inertia
        vec3<T> p = joint<K>::momentum(c, b, I).lin;
        algebra<T>::product_drv(&R, &p, &p);
        T *const column = J + b.v_index + c;
        column[0] = p.x, column[nv] = p.y, column[2 * nv] = p.z;
      });
      add_to_parent(in_parent(subtree, joint<K>::kept_pose(b, w.pose)), model, w.children, i);
    });
  }
  const T one_over_mass = model.bodies > 1 ? T(1) / w.children.number(0, 0) : T(0);
  for (std::ptrdiff_t k = 0; k < 3 * nv; ++k)
    J[k] = one_over_mass * J[k];
}

} // namespace KSL_ISA
} // namespace ksl
