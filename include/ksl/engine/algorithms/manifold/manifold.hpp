// KSL: the configuration manifold: positions move along joint velocities (⊕), and two positions differ by one (⊖).
//
// q ⊕ dv is the position after unit time at the constant joint velocity dv; q1 ⊖ q0 is the smallest joint velocity that leads
// from q0 to q1 in unit time.  Spherical, planar and floating joints move along the exponential of their group.  Solà, Deray,
// Atchuthan, A micro Lie theory for state estimation in robotics (2018), sections II-E, and III for the Jacobians.
#pragma once

#include "ksl/engine/lanes/workspace.hpp"
#include "ksl/engine/model/joints.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Joints are independent of each other: nothing is stored.
template <class T> struct manifold_workspace {
  KSL_LANES void lay_out(arena &, const model_view<scalar_of<T>> &) {}
};

/// Calls step.operator()<K>(body) for the joint of each body, with its kind as the description gives it: the difference of two
/// angles depends on whether the joint is continuous.
template <class S, class Step> KSL_LANES void for_joints(const model_view<S> &model, Step step) {
  for (int i = 1; i < model.bodies; ++i) {
    const body<S> &b = model.body[i];
    by_every_kind(b.described, [&]<joint_kind K>() KSL_INLINED { step.template operator()<K>(b); });
  }
}

/// out (nq) = q ⊕ dv.  q (nq), dv (nv).  Quaternions of the result have unit length.  O(joints).
template <class T>
void integrate(const model_view<scalar_of<T>> &model, const manifold_workspace<T> &, const T *q, const T *dv, T *out) {
  for_joints(model, [&]<joint_kind K>(const auto &b) KSL_INLINED {
    joint<K>::integrate(q + b.q_index, dv + b.v_index, out + b.q_index);
  });
}

/// dv (nv) = q1 ⊖ q0.  Angles of continuous joints, and of rotations without one axis, are between −π and π.  O(joints).
template <class T>
void difference(const model_view<scalar_of<T>> &model, const manifold_workspace<T> &, const T *q0, const T *q1, T *dv) {
  for_joints(model, [&]<joint_kind K>(const auto &b) KSL_INLINED {
    joint<K>::difference(q0 + b.q_index, q1 + b.q_index, dv + b.v_index);
  });
}

/// out (nq) = q0 ⊕ fraction (q1 ⊖ q0): q0 at 0 and q1 at 1, along the shortest path and at constant joint velocity.  Beyond 0
/// and 1 the motion continues.  O(joints).
template <class T>
void interpolate(const model_view<scalar_of<T>> &model, const manifold_workspace<T> &, const T *q0, const T *q1,
                 const T *fraction, T *out) {
  const T f = *fraction;
  for_joints(model, [&]<joint_kind K>(const auto &b) KSL_INLINED {
    T dv[joint<K>::nv];
    joint<K>::difference(q0 + b.q_index, q1 + b.q_index, dv);
    for (int k = 0; k < joint<K>::nv; ++k)
      dv[k] = f * dv[k];
    joint<K>::integrate(q0 + b.q_index, dv, out + b.q_index);
  });
}

/// Sets both (nv, nv) matrices to zero and calls step.operator()<K>(body, block of one, block of the other) for each joint.
template <class T, class Step>
KSL_LANES void for_blocks(const model_view<scalar_of<T>> &model, T *one, T *other, Step step) {
  for (int i = 0; i < model.nv * model.nv; ++i)
    one[i] = other[i] = T(0);
  for_joints(model, [&]<joint_kind K>(const auto &b) KSL_INLINED {
    const int block = b.v_index * (model.nv + 1);
    step.template operator()<K>(b, one + block, other + block);
  });
}

/// Derivatives of q ⊕ dv by q and by dv, (nv, nv) each, row-major: (q ⊕ δ) ⊕ (dv + ε) = (q ⊕ dv) ⊕ (by_q δ + by_dv ε) to first
/// order.  They don't depend on q.  O(joints), besides writing 2 nv² numbers.
template <class T>
void integrate_jacobians(const model_view<scalar_of<T>> &model, const manifold_workspace<T> &, const T *, const T *dv,
                         T *by_q, T *by_dv) {
  for_blocks(model, by_q, by_dv, [&]<joint_kind K>(const auto &b, T *q_block, T *dv_block) KSL_INLINED {
    joint<K>::integrate_jacobians(dv + b.v_index, q_block, dv_block, model.nv);
  });
}

/// Derivatives of q1 ⊖ q0 by q0 and by q1, (nv, nv) each, row-major: (q1 ⊕ ε) ⊖ (q0 ⊕ δ) = (q1 ⊖ q0) + by_q0 δ + by_q1 ε to
/// first order.  Where a rotation between q0 and q1 is half a turn, they are those of the difference that is returned.
/// O(joints), besides writing 2 nv² numbers.
template <class T>
void difference_jacobians(const model_view<scalar_of<T>> &model, const manifold_workspace<T> &, const T *q0,
                          const T *q1, T *by_q0, T *by_q1) {
  for_blocks(model, by_q0, by_q1, [&]<joint_kind K>(const auto &b, T *q0_block, T *q1_block) KSL_INLINED {
    T dv[joint<K>::nv];
    joint<K>::difference(q0 + b.q_index, q1 + b.q_index, dv);
    joint<K>::difference_jacobians(dv, q0_block, q1_block, model.nv);
  });
}

} // namespace KSL_ISA
} // namespace ksl
