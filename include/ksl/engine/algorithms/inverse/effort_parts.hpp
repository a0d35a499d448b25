// KSL: what the motors' efforts consist of.
#pragma once

#include "ksl/engine/algorithms/inverse/inverse_dynamics.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> using effort_parts_workspace = inverse_dynamics_workspace<T>;

/// The parts (5, nv) of the efforts of inverse_dynamics: transmitted, damping, friction, rotor and spring.  Their sum is the effort, up
/// to rounding.  joint_physics.hpp has their laws.  All but the first are zero unless the model's options name them.  If a rotor is a
/// body, what its joint transmits is the rotor's part.
template <class T>
void effort_parts(const model_view<scalar_of<T>> &model, const effort_parts_workspace<T> &w, const T *q, const T *v,
                  const T *dv, const external_wrenches<T> &external, T *parts) {
  model_view<scalar_of<T>> without = model;
  without.physics = nullptr;
  inverse_dynamics(without, w, q, v, dv, external, parts);
  const int nv = model.nv;
  for (int k = 0; k < nv; ++k) {
    const coordinate_physics<scalar_of<T>> c =
        model.physics ? model.physics[k] : coordinate_physics<scalar_of<T>>{0, 0, 0, 1, 0, 0, 0, false};
    parts[nv + k] = T(c.damping) * v[k];
    parts[2 * nv + k] = T(c.friction) * friction_at(v[k], c.friction_width);
    parts[3 * nv + k] = T(c.armature) * dv[k];
    if (c.is_rotor)
      parts[3 * nv + k] = parts[k], parts[k] = T(0);
    parts[4 * nv + k] = spring_effort(c, q);
  }
}

} // namespace KSL_ISA
} // namespace ksl
