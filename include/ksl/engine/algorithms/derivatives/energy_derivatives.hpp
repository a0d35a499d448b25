// KSL: the first derivatives of the energies.
//
// With q_k, the velocity of the bodies beyond the joint changes, as they see it, by Ψ̇ = v_λ × S (Singh, Russell, Wensing, RA-L 7(2),
// 2022), λ being the body that carries the joint; with v_k it changes by S.  With p, the momentum of the joint's subtree, the kinetic
// energy T and the potential energy V of gravity change by
//
//     ∂T/∂q_k = p · Ψ̇ = −(v_λ ×* p) · S,   ∂T/∂v_k = p · S,   ∂V/∂q_k = (−m g, h × −g) · S,                       (1)
//
// m and h being mass and first moment of the subtree.  So each is the effort of a wrench through the joint.
#pragma once

#include "ksl/engine/model/joint_physics.hpp"
#include "ksl/engine/steps/body_motions.hpp"
#include "ksl/engine/steps/external_wrenches.hpp"
#include "ksl/engine/steps/subtree_moment.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct energy_derivatives_workspace {
  pose_workspace<T> pose;
  per_body<screw, T> twist;          ///< of each body, in its frame
  per_body<vec3, T> gravity;         ///< gravity in the axes of each body
  per_body<coscrew, T> sum;          ///< momentum of each subtree, in the frame of its body
  per_body<mass_moment, T> children; ///< sum over the subtrees of each body's children, in its frame

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, twist, gravity, sum, children);
  }
};

/// Adds the contributions of rotors and springs.
template <class T> void add_physics_energy_derivatives(const model_view<scalar_of<T>> &model, const T *q, const T *v,
                                                       T *kinetic_by_v, T *potential_by_q) {
  for (int k = 0; k < model.nv; ++k) {
    const coordinate_physics<scalar_of<T>> &c = model.physics[k];
    kinetic_by_v[k] = kinetic_by_v[k] + T(c.armature) * v[k];
    potential_by_q[k] = potential_by_q[k] + spring_effort(c, q);
  }
}

/// The derivatives of the kinetic energy by q, along q ⊕ s e_k with v held componentwise, and by v, which is M v, and of the potential
/// energy by q, which is the effort that holds the mechanism at rest; each (nv).  q (nq), v (nv).  O(bodies).
template <class T>
void energy_derivatives(const model_view<scalar_of<T>> &model, const energy_derivatives_workspace<T> &w, const T *q,
                        const T *v, T *kinetic_by_q, T *kinetic_by_v, T *potential_by_q) {
  using A = algebra<T>;
  body_twists(model, w.pose, w.twist, q, v, [&]<class P>(bodies_at<P, T> k) KSL_INLINED {
    const spatial_inertia<P> I = own_inertia(model, k);
    const screw<P> s = w.twist[k];
    coscrew<P> p;
    algebra<P>::product_Ms(&I, &s, &p);
    w.sum.set(k, p);
  });
  w.gravity.set(0, spread<T>(model.gravity));
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      vec3<T> g = w.gravity[b.parent];
      joint<K>::kept_pose(b, w.pose).to_body(g);
      w.gravity.set(i, g);
    });
  }
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      const mass_moment<T> subtree = subtree_moment(model, w.children, i);
      const vec3<T> g = w.gravity[i];
      const screw<T> own = joint<K>::twist(b, v + b.v_index);
      screw<T> carrier = w.twist[i];
      coscrew<T> p = w.sum[i], lift, turned;
      A::nxpy_ss(&own, &carrier);
      A::screw_invert(&carrier);
      A::cross_sc(&carrier, &p, &turned);
      lift.lin = {-(subtree.m * g.x), -(subtree.m * g.y), -(subtree.m * g.z)};
      A::cross_vv(&g, &subtree.h, &lift.ang);
      joint<K>::effort(b, turned, kinetic_by_q + b.v_index);
      joint<K>::effort(b, p, kinetic_by_v + b.v_index);
      joint<K>::effort(b, lift, potential_by_q + b.v_index);
      const auto D = joint<K>::kept_pose(b, w.pose);
      if (b.parent > 0) {
        add_to_parent(in_parent(subtree, D), model, w.children, i);
        D.to_parent(p.lin, p.ang);
        A::product_CoAdtc(&D.t, &p, &p);
        add_wrench(w.sum, b.parent, p);
      }
    });
  }
  if (model.physics)
    add_physics_energy_derivatives(model, q, v, kinetic_by_v, potential_by_q);
}

} // namespace KSL_ISA
} // namespace ksl
