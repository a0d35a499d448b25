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

#include "ksl/engine/steps/newton_euler.hpp"
#include "ksl/engine/steps/external_wrenches.hpp"
#include "ksl/engine/model/joint_physics.hpp"
#include "ksl/engine/model/joints.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Is (1) computed in the backward pass?  There each body waits for the wrench of the next one, and (1) waits for nothing.
template <class T> inline constexpr bool laws_are_late = in_narrow_lanes<T>;

template <class T> struct inverse_dynamics_workspace {
  pose_workspace<T> pose;
  per_body<body_motion, T> motion; ///< of each body, in its frame
  per_body<coscrew, T> wrench; ///< through its joint, about its origin and in its axes; body 0: between ground and root
  per_body<coscrew, T> passed; ///< with late laws: the same at the parent, if that isn't the body before
  bool with_ground = !is_pack<T>; ///< is the wrench of body 0 wanted?  It costs as much as that of a moving body
  array_of<T> besides; ///< what motors supply besides the transmitted efforts; empty unless the model has joint physics

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, motion, wrench);
    memory.lay_out(laws_are_late<T> ? model.bodies : 0, passed);
    besides.lay_out(memory, model.physics ? model.nv : 0);
  }
};

/// Sets the motion of body i from that of its parent.  `last` is the motion of the body before, and then of this one.
template <class T>
KSL_LANES void set_motion(const model_view<scalar_of<T>> &model, const inverse_dynamics_workspace<T> &w, const T *q,
                          const T *v, const T *dv, int i, body_motion<T> &last) {
  const body<scalar_of<T>> &b = model.body[i];
  by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
    const auto D = joint<K>::computed_pose(b, w.pose, q);
    body_motion<T> m;
    // from registers for a state alone, which waits for its chain; in lanes other numbers need the registers more
    m = is_number<T> && b.parent == i - 1 ? last : w.motion[b.parent];
    m.acceleration = acceleration_at(m, D.t);
    D.to_body(m.angular_velocity, m.angular_acceleration, m.acceleration);
    joint<K>::add_motion(b, v + b.v_index, dv + b.v_index, m);
    w.motion.set(i, m);
    last = m;
  });
}

/// Subtracts external wrenches on body i from f, and adds what its children pass to it, but for the body after it.
template <class T>
KSL_NOT_INLINED void add_besides_chain(const model_view<scalar_of<T>> &model, const inverse_dynamics_workspace<T> &w,
                                       const external_wrenches<T> &external, int i, coscrew<T> &f) {
  for (int k = 0; k < external.n; ++k)
    if (model.link[external.link[k]].body == i) {
      const coscrew<T> e = external_in_body(model, w.pose, external, k);
      algebra<T>::nxpy_cc(&e, &f);
    }
  for (int child = model.body[i].last_branch; child > i + 1;) {
    const coscrew<T> passed = w.passed[child];
    algebra<T>::xpy_cc(&passed, &f);
    for (--child; model.body[child].parent != i;) // in depth-first order the child before carries the body before
      child = model.body[child].parent;
  }
}

/// The wrench through the joint of body i, but for what the body after it passes.
template <class T>
KSL_LANES coscrew<T> wrench_besides_chain(const model_view<scalar_of<T>> &model, const inverse_dynamics_workspace<T> &w,
                                          const external_wrenches<T> &external, int i) {
  if constexpr (laws_are_late<T>) {
    coscrew<T> f = newton_euler(own_inertia(model, body_at<T>(i)), w.motion[i]);
    if (external.n > 0 || model.body[i].last_branch > 0) [[unlikely]] {
      coscrew<T> all = f; // a copy, since only this needs an address
      add_besides_chain(model, w, external, i, all);
      f = all;
    }
    return f;
  } else {
    return w.wrench[i];
  }
}

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
  body_motion<T> last = ground_motion<T>(model);
  w.motion.set(0, last);
  const auto move = [&](int i) KSL_INLINED { set_motion(model, w, q, v, dv, i, last); };
  if constexpr (laws_are_late<T>) {
    for (int i = 1; i < model.bodies; ++i)
      move(i);
  } else {
    for_bodies<T>(model.bodies, move, [&](auto k) KSL_INLINED {
      if (is_number<T> || w.with_ground || k.i > 0)
        w.wrench.set(k, newton_euler(own_inertia(model, k), w.motion[k]));
    });
    subtract_external(model, w.pose, external, w.wrench, [](int, coscrew<T> &) KSL_INLINED {});
  }

  // The wrench that a body passes to the one before it stays in registers: from memory it would come later.
  coscrew<T> carried;
  bool has_carried = false;
  const auto complete = [&](int i) KSL_INLINED {
    coscrew<T> f = wrench_besides_chain(model, w, external, i);
    if (has_carried)
      algebra<T>::xpy_cc(&carried, &f);
    if (has_carried || laws_are_late<T>)
      w.wrench.set(i, f);
    return f;
  };
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      const auto D = joint<K>::kept_pose(b, w.pose);
      coscrew<T> f = complete(i);
      joint<K>::effort(b, f, tau + b.v_index);
      receive.template operator()<K>(i, f);
      D.to_parent(f.lin, f.ang);
      algebra<T>::product_CoAdtc(&D.t, &f, &f);
      has_carried = b.parent == i - 1;
      if (has_carried)
        carried = f;
      else if constexpr (laws_are_late<T>)
        w.passed.set(i, f);
      else
        add_wrench(w.wrench, b.parent, f);
    });
  }
  if (w.with_ground)
    complete(0);
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
