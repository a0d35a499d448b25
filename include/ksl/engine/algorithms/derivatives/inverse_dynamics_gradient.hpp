// KSL: the gradients of a weighted sum of efforts, without their derivatives.
//
// Weights w of the efforts are a virtual velocity: with the twists W_i that it gives the bodies, Σ w τ = Σ W_i · B_i, where
// B_i = I A_i + V_i ×* I V_i is the wrench that gives body i its motion (Featherstone, RBDA (2008), table 5.1; A minus gravity).  Reverse
// accumulation through the recursions of V, A and W needs three sums over the bodies beyond each joint, moved to its frame:
//
//     F = Σ B,   P = Σ I W,   Q = Σ (I (W × V) − W ×* I V + S q̇ ×* P),                                          (1)
//
// the wrench through the joint, the momentum that w gives its subtree, and what a change of its twist does.  With V′, A′ and W′, those
// of the body that carries the joint,
//
//     ∂/∂q_k = −S · (W′ ×* F + A′ ×* P + V′ ×* Q),   ∂/∂v_k = S · (Q − V ×* P),   ∂/∂a_k = S · P.                  (2)
//
// (1) is reverse-mode differentiation (Griewank, Walther, Evaluating Derivatives (2008), chapter 3), by hand: no S depends on q in its
// own frame.  So the gradients cost about three times the efforts, whatever nv is.
#pragma once

#include "ksl/engine/model/joint_physics.hpp"
#include "ksl/engine/model/joints.hpp"
#include "ksl/engine/steps/external_wrenches.hpp"
#include "ksl/engine/steps/newton_euler.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct inverse_dynamics_gradient_workspace {
  pose_workspace<T> pose;
  /// V, A and W of each body, in its frame; A is the spatial one, minus gravity
  per_body<screw, T> twist, acceleration, virtual_twist;
  per_body<coscrew, T> wrench, momentum, change; ///< F, P and Q

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, twist, acceleration, virtual_twist, wrench, momentum, change);
  }
};

/// Moves a twist from the frame of the body that carries a joint to that of the joint's body.
template <class T, class Pose> KSL_LANES void to_child(const Pose &D, screw<T> &s) {
  using A = algebra<T>;
  vec3<T> of_origin;
  A::cross_vv(&s.ang, &D.t, &of_origin);
  A::xpy_vv(&of_origin, &s.lin);
  D.to_body(s.lin, s.ang);
}
/// Adds a wrench on a body to the sum of the body that carries its joint.
template <class T, class Pose>
KSL_LANES void add_to_carrier(const Pose &D, coscrew<T> f, const per_body<coscrew, T> &sum, int parent) {
  D.to_parent(f.lin, f.ang);
  algebra<T>::product_CoAdtc(&D.t, &f, &f);
  add_wrench(sum, parent, f);
}

/// What a body adds to (1) itself, but for the term of its joint.
template <class T>
KSL_LANES void own_terms(const spatial_inertia<T> &I, const screw<T> &V, const screw<T> &acceleration,
                         const screw<T> &W, coscrew<T> &F, coscrew<T> &P, coscrew<T> &Q) {
  using A = algebra<T>;
  coscrew<T> h, turned;
  screw<T> difference;
  A::product_Ms(&I, &V, &h);
  A::product_Ms(&I, &acceleration, &F);
  A::cross_sc(&V, &h, &turned);
  A::xpy_cc(&turned, &F);
  A::product_Ms(&I, &W, &P);
  A::cross_ss(&W, &V, &difference);
  A::product_Ms(&I, &difference, &Q);
  A::cross_sc(&W, &h, &turned);
  A::nxpy_cc(&turned, &Q);
}

/// What physics of a joint adds to the gradients by its coordinates.
template <class T> struct gradients_besides { T by_q[6], by_v[6], by_a[6]; };
template <class T>
gradients_besides<T> physics_gradients(const model_view<scalar_of<T>> &model, const body<scalar_of<T>> &b, const T *v,
                                       const T *weights) {
  gradients_besides<T> all;
  for (int k = 0; k < b.nv; ++k) {
    const coordinate_physics<scalar_of<T>> &c = model.physics[b.v_index + k];
    const T &rate = v[b.v_index + k], &weight = weights[b.v_index + k];
    all.by_q[k] = T(c.stiffness) * weight;
    all.by_v[k] = (T(c.damping) + T(c.friction) * friction_slope(rate, c.friction_width)) * weight;
    all.by_a[k] = T(c.armature) * weight;
  }
  return all;
}

/// Writes (2) for one joint.
template <joint_kind K, class T>
KSL_LANES void write_gradients(const model_view<scalar_of<T>> &model, const body<scalar_of<T>> &b, const coscrew<T> &q,
                               const coscrew<T> &of_v, const coscrew<T> &P, const T *v, const T *weights, T *by_q,
                               T *by_v, T *by_a) {
  gradients_besides<T> more;
  if (model.physics) // first, since a gradient may be one of the inputs
    more = physics_gradients(model, b, v, weights);
  joint<K>::effort(b, q, by_q + b.v_index);
  joint<K>::effort(b, of_v, by_v + b.v_index);
  joint<K>::effort(b, P, by_a + b.v_index);
  for (int k = 0; model.physics && k < b.nv; ++k) {
    by_q[b.v_index + k] = by_q[b.v_index + k] + more.by_q[k];
    by_v[b.v_index + k] = by_v[b.v_index + k] + more.by_v[k];
    by_a[b.v_index + k] = by_a[b.v_index + k] + more.by_a[k];
  }
}

/// (2) for one joint of kind K, and its sums added to those of the body that carries it.
template <joint_kind K, class T>
KSL_LANES void gradient_of_joint(const model_view<scalar_of<T>> &model, const inverse_dynamics_gradient_workspace<T> &w,
                                 int i, const T *v, const T *a, const T *weights, T *by_q, T *by_v, T *by_a) {
  using A = algebra<T>;
  const body<scalar_of<T>> &b = model.body[i];
  const screw<T> own = joint<K>::twist(b, v + b.v_index), own_a = joint<K>::twist(b, a + b.v_index),
                 own_w = joint<K>::twist(b, weights + b.v_index), V = w.twist[i];
  const coscrew<T> F = w.wrench[i], P = w.momentum[i];
  coscrew<T> Q = w.change[i], turned, q;
  A::cross_sc(&own, &P, &turned);
  A::xpy_cc(&turned, &Q);
  coscrew<T> of_v = Q;
  A::cross_sc(&V, &P, &turned);
  A::nxpy_cc(&turned, &of_v);

  screw<T> V_carrier = V, A_carrier = w.acceleration[i], W_carrier = w.virtual_twist[i], bent;
  A::nxpy_ss(&own, &V_carrier);
  A::cross_ss(&V, &own, &bent);
  A::nxpy_ss(&bent, &A_carrier);
  A::nxpy_ss(&own_a, &A_carrier);
  A::nxpy_ss(&own_w, &W_carrier);
  A::cross_sc(&W_carrier, &F, &q);
  A::cross_sc(&A_carrier, &P, &turned);
  A::xpy_cc(&turned, &q);
  A::cross_sc(&V_carrier, &Q, &turned);
  A::xpy_cc(&turned, &q);
  A::coscrew_invert(&q);
  write_gradients<K>(model, b, q, of_v, P, v, weights, by_q, by_v, by_a);
  if (b.parent > 0) {
    const auto D = joint<K>::kept_pose(b, w.pose);
    add_to_carrier(D, F, w.wrench, b.parent);
    add_to_carrier(D, P, w.momentum, b.parent);
    add_to_carrier(D, Q, w.change, b.parent);
  }
}

/// V, A and W of body i from those of the body that carries it.
template <joint_kind K, class T>
KSL_LANES void move_body(const model_view<scalar_of<T>> &model, const inverse_dynamics_gradient_workspace<T> &w, int i,
                         const T *q, const T *v, const T *a, const T *weights) {
  using A = algebra<T>;
  const body<scalar_of<T>> &b = model.body[i];
  const auto D = joint<K>::computed_pose(b, w.pose, q);
  const screw<T> own = joint<K>::twist(b, v + b.v_index), own_a = joint<K>::twist(b, a + b.v_index),
                 own_w = joint<K>::twist(b, weights + b.v_index);
  screw<T> V = w.twist[b.parent], acceleration = w.acceleration[b.parent], W = w.virtual_twist[b.parent], bent;
  to_child(D, V);
  to_child(D, acceleration);
  to_child(D, W);
  A::xpy_ss(&own, &V);
  A::cross_ss(&V, &own, &bent);
  A::xpy_ss(&bent, &acceleration);
  A::xpy_ss(&own_a, &acceleration);
  A::xpy_ss(&own_w, &W);
  w.twist.set(i, V);
  w.acceleration.set(i, acceleration);
  w.virtual_twist.set(i, W);
}

/// The gradients by_q, by_v and by_a (nv) of Σ weights · efforts of inverse dynamics at q (nq), v (nv) and a (nv), under gravity; by_q along
/// q ⊕ s e_k with v and a held componentwise.  weights (nv).  O(bodies).
template <class T>
void inverse_dynamics_gradient(const model_view<scalar_of<T>> &model, const inverse_dynamics_gradient_workspace<T> &w,
                               const T *q, const T *v, const T *a, const T *weights, T *by_q, T *by_v, T *by_a) {
  const vec3<T> zero = {T(0), T(0), T(0)}, gravity = spread<T>(model.gravity);
  sines_and_cosines(model, w.pose, q);
  w.twist.set(0, {zero, zero});
  w.acceleration.set(0, {{-gravity.x, -gravity.y, -gravity.z}, zero});
  w.virtual_twist.set(0, {zero, zero});
  const auto move = [&](int i) KSL_INLINED {
    by_kind(model.body[i].kind, [&]<joint_kind K>() KSL_INLINED { move_body<K>(model, w, i, q, v, a, weights); });
  };
  for_bodies<T>(model.bodies, move, [&]<class P>(bodies_at<P, T> k) KSL_INLINED {
    coscrew<P> F, momentum, change;
    own_terms<P>(own_inertia(model, k), w.twist[k], w.acceleration[k], w.virtual_twist[k], F, momentum, change);
    w.wrench.set(k, F);
    w.momentum.set(k, momentum);
    w.change.set(k, change);
  });
  for (int i = model.bodies - 1; i > 0; --i)
    by_kind(model.body[i].kind,
            [&]<joint_kind K>() KSL_INLINED { gradient_of_joint<K>(model, w, i, v, a, weights, by_q, by_v, by_a); });
}

} // namespace KSL_ISA
} // namespace ksl
