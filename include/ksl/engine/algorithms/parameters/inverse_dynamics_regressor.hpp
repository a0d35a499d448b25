// KSL: the regressor of inverse dynamics: joint efforts as a linear function of the links' inertial parameters.
#pragma once

#include "ksl/engine/algorithms/parameters/link_regressor.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct inverse_dynamics_regressor_workspace {
  forward_kinematics_workspace<T> poses;
  per_body<body_motion, T> motion; ///< of each body, in its frame

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    poses.lay_out(memory, model);
    memory.lay_out(model.bodies, motion);
  }
};

/// Y (nv, n, 10), row-major, for q (nq), v (nv), dv (nv): the efforts that the inertias of n links need are Σ Y φ, with the ten
/// parameters φ of each of them (link_regressor.hpp).  Of all links, it is inverse dynamics under gravity without external wrenches.
/// Only joints that carry a link enter: O(links × depth), besides writing 10 n nv numbers.
template <class T>
void inverse_dynamics_regressor(const model_view<scalar_of<T>> &model, const inverse_dynamics_regressor_workspace<T> &w,
                                const T *q, const T *v, const T *dv, int n, const int *links, T *Y) {
  const std::ptrdiff_t row = std::ptrdiff_t(parameters_of_link) * n;
  for (std::ptrdiff_t k = 0; k < row * model.nv; ++k)
    Y[k] = T(0);
  body_motions(model, w.poses.pose, w.motion, ground_motion<T>(model), q, v, dv, [](auto) KSL_INLINED {});
  compose_poses(model, w.poses.pose, w.poses.in_world);
  for (int k = 0; k < n; ++k) {
    const link<scalar_of<T>> &l = model.link[links[k]];
    const SE3<T> pose = link_pose(model, w.poses.in_world, links[k]);
    const body_motion<T> motion = motion_of_link(l, w.motion[l.body]);
    for (int j = l.body; j > 0; j = model.body[j].parent)
      columns_at_link(model, w.poses.in_world, j, pose, [&](int c, const screw<T> &s) KSL_INLINED {
        wrench_form(s, motion, Y + c * row + parameters_of_link * k);
      });
  }
}

} // namespace KSL_ISA
} // namespace ksl
