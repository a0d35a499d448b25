// KSL: inverse dynamics.  The wrench through every joint is kept in the workspace.
//
// The recursive Newton–Euler algorithm (Luh, Walker, Paul 1980; Featherstone, RBDA (2008), table 5.1), in the three-vectors of
// newton_euler.hpp.  From the ground to the leaves, the motion of a body is that of its parent plus that of its joint, and
//
//     f_i = wrench of its motion (newton_euler.hpp (1)) − external wrenches.                                       (1)
//
// From the leaves to the ground, the wrench f_i through a joint is complete when its children have added theirs:
//
//     τ_i = Sᵀ f_i,   f_λ(i) ← f_λ(i) + f_i, moved to the parent's frame.                                          (2)
#pragma once

#include "ksl/engine/model/joint_physics.hpp"
#include "ksl/engine/steps/recursion.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct inverse_dynamics_workspace {
  pose_workspace<T> pose;
  per_body<body_motion, T> motion; ///< of each body, in its frame
  joint_wrenches<T> wrench;
  array_of<T> besides; ///< what motors supply besides the transmitted efforts; empty unless the model has joint physics

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, motion, wrench);
    besides.lay_out(memory, model.physics ? model.nv : 0);
  }
};

/// Efforts tau (nv) that motors supply for positions q (nq), velocities v (nv) and accelerations dv (nv) under gravity and external
/// wrenches.  Fills the workspace w.  O(bodies), about 270 flops for each.  receive<K>(body, wrench) is called with the wrench
/// through each joint during the backward pass, from the last body to the first.
template <class T, class Receive>
KSL_LANES void inverse_dynamics_by_joint(const model_view<scalar_of<T>> &model, const inverse_dynamics_workspace<T> &w,
                                         const T *q, const T *v, const T *dv, const external_wrenches<T> &external,
                                         T *tau, Receive receive) {
  if (model.physics) // first, since tau may be one of the inputs
    efforts_besides(model, q, v, dv, &w.besides[0]);
  sines_and_cosines(model, w.pose, q);

  // from the ground to the leaves: motions, and the wrenches (1) that they need
  motions_outward<T> motions(model, w.motion);
  const auto move = [&]<joint_kind K>(int i, const body<scalar_of<T>> &b) KSL_INLINED {
    const auto D = joint<K>::computed_pose(b, w.pose, q);
    body_motion<T> m = motions.of_parent(i, b);
    m.acceleration = acceleration_at(m, D.t);
    D.to_body(m.angular_velocity, m.angular_acceleration, m.acceleration);
    joint<K>::add_motion(b, v + b.v_index, dv + b.v_index, m);
    motions.set(i, m);
  };
  wrenches_of_motions<T>(model, w, external, [&](int i) KSL_INLINED { for_joint(model, i, move); });

  // from the leaves to the ground: efforts, and wrenches to the parents (2)
  wrenches_inward<T, inverse_dynamics_workspace<T>> wrenches(model, w, external);
  const auto complete = [&]<joint_kind K>(int i, const body<scalar_of<T>> &b) KSL_INLINED {
    const auto D = joint<K>::kept_pose(b, w.pose);
    coscrew<T> f = wrenches.receive_from_children(i);
    joint<K>::effort(b, f, tau + b.v_index);
    receive.template operator()<K>(i, f);
    D.to_parent(f.lin, f.ang);
    algebra<T>::product_CoAdtc(&D.t, &f, &f);
    wrenches.pass_to_parent(i, b, f);
  };
  for (int i = model.bodies - 1; i > 0; --i)
    for_joint(model, i, complete);
  wrenches.finish_ground();

  for (int k = 0; model.physics && k < model.nv; ++k)
    tau[k] = tau[k] + w.besides[k];
}

template <class T>
void inverse_dynamics(const model_view<scalar_of<T>> &model, const inverse_dynamics_workspace<T> &w, const T *q,
                      const T *v, const T *dv, const external_wrenches<T> &external, T *tau) {
  inverse_dynamics_by_joint(model, w, q, v, dv, external, tau, []<joint_kind>(int, const coscrew<T> &) KSL_INLINED {});
}

} // namespace KSL_ISA
} // namespace ksl
