// KSL: forward dynamics, by the articulated-body algorithm (Featherstone, RBDA (2008), table 7.1).
//
// First the motion without joint accelerations is computed, as in inverse dynamics, and the wrenches p that it needs.  The remaining
// problem is linear and free of velocities: the accelerations a' of bodies that the joint accelerations q̈ cause.
//
// From the leaves to the root.  The articulated inertia A of a body begins as its own inertia, and its bias force as p.  For each
// coordinate of its joint, the last one first,
//
//     U = A S,   D = Sᵀ U + armature,   u = τ − Sᵀ p,                                                            (1)
//     A ← A − U D⁻¹ Uᵀ,   p ← p + U D⁻¹ u.                                                                       (2)
//
// Then A and p, about the parent's origin, are added to those of the parent.
//
// From the root to the leaves.  a' of a body begins as that of its parent.  For each coordinate, the first one first,
//
//     q̈ = D⁻¹ (u − Uᵀ a'),   a' ← a' + S q̈.                                                                      (3)
#pragma once

#include "ksl/engine/model/joint_physics.hpp"
#include "ksl/engine/steps/articulated_bodies.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> using forward_dynamics_workspace = articulated_workspace<T>;

/// Eliminates the coordinates of body i's joint, (1) and (2), and adds what remains of A and p to those of the parent.  tau are the
/// joint's efforts; `physics` is that of its coordinates, or null.
template <joint_kind K, class T>
KSL_LANES void pass_to_parent(const body<scalar_of<T>> &b, const forward_dynamics_workspace<T> &w, int i, const T *tau,
                              const coordinate_physics<scalar_of<T>> *physics) {
  using algebra = ksl::algebra<T>;
  in_place<articulated_inertia, T> A(w.A, i);
  coscrew<T> p = w.wrench[i];
  // a free joint transmits its effort alone: a' = A⁻¹ (τ − p), and the parent feels τ
  if constexpr (joint<K>::is_free) {
    const mat3x3<T> R = w.rotation[i];
    coscrew<T> effort = {{tau[0], tau[1], tau[2]}, {tau[3], tau[4], tau[5]}}, rest;
    algebra::product_CoAdrc(&R, &effort, &effort);
    algebra::subtract_cc(&effort, &p, &rest);
    w.acceleration[i] = solve(*A, rest);
    p = effort;
  } else {
    for_coordinates_backwards<K>(b, [&](auto k) KSL_INLINED {
      const auto S = joint<K>::column(k, b, w.rotation, i);
      const coscrew<T> U = S.momentum(*A); // (1)
      T D = S.effort(U);
      if (physics) // of the coordinate's rotor; no other coordinate feels it
        D = D + T(physics[k].armature);
      const T D_inverse = T(1) / D, u = tau[k] - S.effort(p);
      w.coordinate[b.v_index + k] = {U, D_inverse, u};
      if (k > 0) {
        algebra::articulated_inertia_downdated(&*A, &U, D_inverse, &*A); // (2)
      } else if (b.parent > 0) {                                         // (2), and the step to the parent
        in_place<articulated_inertia, T> sum(w.A, b.parent);
        add_beyond_joint(*A, U, D_inverse, w.offset[i], *sum);
        sum.put();
      }
      algebra::axpy_cc(D_inverse * u, &U, &p); // (2)
    });
  }
  if (b.parent == 0)
    return;
  algebra::product_CoAdtc(&w.offset[i], &p, &p);
  add_wrench(w.wrench, b.parent, p);
}

/// Sets a' of body i and the accelerations of its joint (3), from a' of the parent.
template <joint_kind K, class T>
KSL_LANES void accelerate(const body<scalar_of<T>> &b, const forward_dynamics_workspace<T> &w, int i, T *dv) {
  using A = algebra<T>;
  screw<T> a; // a' of the parent, at this body's origin
  A::product_Adtinvs(&w.offset[i], &w.acceleration[b.parent], &a);
  if constexpr (joint<K>::is_free) {
    const mat3x3<T> R = w.rotation[i];
    A::subtract_ss(&w.acceleration[i], &a, &a);
    A::product_Adrinvs(&R, &a, &a);
    dv[0] = a.lin.x, dv[1] = a.lin.y, dv[2] = a.lin.z;
    dv[3] = a.ang.x, dv[4] = a.ang.y, dv[5] = a.ang.z;
  } else {
    for_coordinates<K>(b, [&](auto k) KSL_INLINED {
      const coordinate_state<T> &s = w.coordinate[b.v_index + k];
      const T acceleration = s.D_inverse * (s.u - A::dot_cs(&s.U, &a)); // (3)
      joint<K>::column(k, b, w.rotation, i).add(acceleration, a);
      dv[k] = acceleration;
    });
    w.acceleration[i] = a;
  }
}

/// The pass from the leaves to the root, after start_articulated, for efforts tau (nv).
template <class T>
void eliminate_joints(const model_view<scalar_of<T>> &model, const forward_dynamics_workspace<T> &w, const T *tau) {
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    const coordinate_physics<scalar_of<T>> *physics = physics_of(model, b);
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED { pass_to_parent<K>(b, w, i, tau + b.v_index, physics); });
  }
  w.acceleration[0] = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
}

/// The pass from the root to the leaves, after eliminate_joints: accelerations dv (nv).
template <class T>
void accelerate_joints(const model_view<scalar_of<T>> &model, const forward_dynamics_workspace<T> &w, T *dv) {
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED { accelerate<K>(b, w, i, dv + b.v_index); });
  }
}

/// accelerate_joints for two states, or blocks of them, body by body: in this pass each operation waits for the one before it.
template <class T>
void accelerate_joints_of_two(const model_view<scalar_of<T>> &model, const forward_dynamics_workspace<T> &w1, T *dv1,
                              const forward_dynamics_workspace<T> &w2, T *dv2) {
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      accelerate<K>(b, w1, i, dv1 + b.v_index);
      accelerate<K>(b, w2, i, dv2 + b.v_index);
    });
  }
}

/// All of forward_dynamics but its last pass.
template <class T>
KSL_LANES void reduce_to_root(const model_view<scalar_of<T>> &model, const forward_dynamics_workspace<T> &w, const T *q,
                              const T *v, const T *tau, const external_wrenches<T> &external, T *dv) {
  start_articulated(model, w, q, v, external);
  // the transmitted efforts, but for armature; stored in dv, where accelerations replace them one by one
  if (model.physics) {
    for (int k = 0; k < model.nv; ++k)
      dv[k] = tau[k] - passive_effort(model.physics[k], q, v[k]);
    tau = dv;
  }
  eliminate_joints(model, w, tau);
}

/// Accelerations dv (nv) for positions q (nq), velocities v (nv) and motors' efforts tau (nv) under gravity and external
/// wrenches.  O(bodies), about 590 flops for each.
template <class T>
void forward_dynamics(const model_view<scalar_of<T>> &model, const forward_dynamics_workspace<T> &w, const T *q,
                      const T *v, const T *tau, const external_wrenches<T> &external, T *dv) {
  reduce_to_root(model, w, q, v, tau, external, dv);
  accelerate_joints(model, w, dv);
}

} // namespace KSL_ISA
} // namespace ksl
