// KSL: mechanical energy, and the power of external wrenches.
#pragma once

#include "ksl/engine/algorithms/kinematics/forward_kinematics.hpp"
#include "ksl/engine/model/joint_physics.hpp"
#include "ksl/engine/steps/external_wrenches.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct energy_workspace {
  forward_kinematics_workspace<T> poses;
  array_of<screw<T>> twist; ///< of each body, in its frame

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    poses.lay_out(memory, model);
    twist.lay_out(memory, model.bodies);
  }
};
template <class T> using external_power_workspace = energy_workspace<T>;

/// Twist of each body in its own frame; after forward_kinematics.  Featherstone, RBDA (2008), eq. (5.14).
template <class T>
void body_twists(const model_view<scalar_of<T>> &model, const energy_workspace<T> &w, const T *v) {
  using A = algebra<T>;
  w.twist[0] = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      const auto D = joint<K>::kept_pose(b, w.poses.pose);
      const screw<T> own = joint<K>::twist(b, v + b.v_index);
      screw<T> twist = w.twist[b.parent];
      vec3<T> of_origin;
      A::cross_vv(&twist.ang, &D.t, &of_origin);
      A::xpy_vv(&of_origin, &twist.lin);
      D.to_body(twist.lin, twist.ang);
      A::xpy_ss(&own, &twist);
      w.twist[i] = twist;
    });
  }
}

/// Adds twice the kinetic energy of rotors, and subtracts the energy of springs from minus the potential energy.
template <class T>
void add_physics_energy(const model_view<scalar_of<T>> &model, const T *q, const T *v, T &twice_kinetic,
                        T &minus_potential) {
  for (int k = 0; k < model.nv; ++k) {
    const coordinate_physics<scalar_of<T>> &c = model.physics[k];
    twice_kinetic = twice_kinetic + T(c.armature) * (v[k] * v[k]);
    if (c.stiffness != scalar_of<T>(0))
      minus_potential = minus_potential - T(0.5) * spring_effort(c, q) * (q[c.q_index] - T(c.rest));
  }
}

/// Kinetic energy and potential energy of gravity (J); the latter is zero with every centroid at the world's origin.  The energies of
/// rotors and springs are included if the model has them.  Fills the workspace w.  q (nq), v (nv).
template <class T>
void energy(const model_view<scalar_of<T>> &model, const energy_workspace<T> &w, const T *q, const T *v, T *kinetic,
            T *potential) {
  using A = algebra<T>;
  forward_kinematics(model, w.poses, q);
  body_twists(model, w, v);
  const vec3<T> gravity = spread<T>(model.gravity);
  T twice_kinetic = T(0), minus_potential = T(0);
  for (int i = 0; i < model.bodies; ++i) {
    const spatial_inertia<T> I = own_inertia<T>(model, i);
    const SE3<T> &pose = w.poses.in_world[i];
    coscrew<T> momentum;
    vec3<T> h;
    A::product_Ms(&I, &w.twist[i], &momentum);
    twice_kinetic = twice_kinetic + A::dot_cs(&momentum, &w.twist[i]);
    A::product_drv(&pose.R, &I.h, &h); // mass × centroid, about the world's origin
    A::axpy_vv(I.m, &pose.t, &h);
    minus_potential = minus_potential + A::dot_vv(&gravity, &h);
  }
  if (model.physics)
    add_physics_energy(model, q, v, twice_kinetic, minus_potential);
  *kinetic = T(0.5) * twice_kinetic;
  *potential = -minus_potential;
}

/// Power of external wrenches (W): Σ f · v of each link.  q (nq), v (nv).
template <class T>
void external_power(const model_view<scalar_of<T>> &model, const external_power_workspace<T> &w, const T *q, const T *v,
                    const external_wrenches<T> &external, T *power) {
  forward_kinematics(model, w.poses, q);
  body_twists(model, w, v);
  T sum = T(0);
  for (int k = 0; k < external.n; ++k) {
    const coscrew<T> f = external_in_body(model, w.poses.pose, external, k);
    sum = sum + algebra<T>::dot_cs(&f, &w.twist[model.link[external.link[k]].body]);
  }
  *power = sum;
}

} // namespace KSL_ISA
} // namespace ksl
