// KSL: energies and momentum as linear functions of the links' inertial parameters.
#pragma once

#include "ksl/engine/algorithms/parameters/link_regressor.hpp"
#include "ksl/engine/steps/frame_options.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct energy_regressor_workspace {
  forward_kinematics_workspace<T> poses;
  per_body<screw, T> twist; ///< of each body, in its frame

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    poses.lay_out(memory, model);
    memory.lay_out(model.bodies, twist);
  }
};
template <class T> using momentum_regressor_workspace = energy_regressor_workspace<T>;

/// Regressors of the kinetic and the potential energy of n links, each (n, 10), for q (nq) and v (nv): the energy (J) is the sum of
/// their products with the parameters of the links (link_regressor.hpp).  The potential energy is that of gravity, zero with every
/// centroid at the world's origin.  O(bodies + links).
template <class T>
void energy_regressor(const model_view<scalar_of<T>> &model, const energy_regressor_workspace<T> &w, const T *q,
                      const T *v, int n, const int *links, T *kinetic, T *potential) {
  using A = algebra<T>;
  body_twists(model, w.poses.pose, w.twist, q, v, [](auto) KSL_INLINED {});
  compose_poses(model, w.poses.pose, w.poses.in_world);
  const vec3<T> gravity = spread<T>(model.gravity);
  for (int k = 0; k < n; ++k, kinetic += parameters_of_link, potential += parameters_of_link) {
    const link<scalar_of<T>> &l = model.link[links[k]];
    const SE3<T> pose = link_pose(model, w.poses.in_world, links[k]);
    const screw<T> s = twist_of_link(l, w.twist[l.body]);
    screw<T> half = s;
    A::product_as(T(0.5), &s, &half);
    momentum_form(half, s, kinetic);
    vec3<T> h; // −g · R h = −Rᵀ g · h
    A::product_drinvv(&pose.R, &gravity, &h);
    potential[0] = -A::dot_vv(&gravity, &pose.t);
    potential[1] = -h.x, potential[2] = -h.y, potential[3] = -h.z;
    for (int c = 4; c < parameters_of_link; ++c)
      potential[c] = T(0);
  }
}

/// Regressor of the momentum of n links about the world's origin, in the world's axes: P (6, n, 10), row-major, for q (nq) and v (nv).
/// O(bodies + links).
template <class T>
void momentum_regressor(const model_view<scalar_of<T>> &model, const momentum_regressor_workspace<T> &w, const T *q,
                        const T *v, int n, const int *links, component_order order, T *P) {
  const T o = T(0), one = T(1);
  body_twists(model, w.poses.pose, w.twist, q, v, [](auto) KSL_INLINED {});
  compose_poses(model, w.poses.pose, w.poses.in_world);
  for (int k = 0; k < n; ++k) {
    const link<scalar_of<T>> &l = model.link[links[k]];
    const SE3<T> pose = link_pose(model, w.poses.in_world, links[k]);
    const screw<T> twist = twist_of_link(l, w.twist[l.body]);
    for (int c = 0; c < 6; ++c) { // component c of the momentum is its product with a unit twist of the world's frame
      T unit[6] = {o, o, o, o, o, o};
      unit[order == component_order::angular_first ? (c + 3) % 6 : c] = one;
      screw<T> s = {{unit[0], unit[1], unit[2]}, {unit[3], unit[4], unit[5]}};
      algebra<T>::product_Adinvs(&pose, &s, &s);
      momentum_form(s, twist, P + parameters_of_link * (c * n + k));
    }
  }
}

} // namespace KSL_ISA
} // namespace ksl
