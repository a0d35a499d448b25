// KSL: twists of all bodies, and their motions as the laws of motion need them, each in the frame of its body.
#pragma once

#include "ksl/engine/model/joints.hpp"
#include "ksl/engine/steps/newton_euler.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Twists of all bodies for q (nq) and v (nv), and their poses in their parents: v_i = Ad⁻¹ v_λ + S q̇ (Featherstone, RBDA (2008),
/// eq. (5.14)).  Calls lanes(k) in the order of for_bodies.
template <class T, class Lanes>
KSL_LANES void body_twists(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                           const per_body<screw, T> &twist, const T *q, const T *v, Lanes lanes) {
  using A = algebra<T>;
  sines_and_cosines(model, pose, q);
  twist.set(0, {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}});
  const auto move = [&](int i) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      const auto D = joint<K>::computed_pose(b, pose, q);
      const screw<T> own = joint<K>::twist(b, v + b.v_index);
      screw<T> s = twist[b.parent];
      vec3<T> of_origin;
      A::cross_vv(&s.ang, &D.t, &of_origin);
      A::xpy_vv(&of_origin, &s.lin);
      D.to_body(s.lin, s.ang);
      A::xpy_ss(&own, &s);
      twist.set(i, s);
    });
  };
  for_bodies<T>(model.bodies, move, lanes);
}

/// Motions of all bodies for q (nq), v (nv) and dv (nv), from that of the ground, and their poses in their parents.  The motion of a
/// body is that of the point of its parent at its origin, plus that of its joint.  Featherstone, RBDA (2008), eqs. (5.7), (5.8).
template <class T, class Lanes>
KSL_LANES void body_motions(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                            const per_body<body_motion, T> &motion, const body_motion<T> &ground, const T *q,
                            const T *v, const T *dv, Lanes lanes) {
  sines_and_cosines(model, pose, q);
  motion.set(0, ground);
  const auto move = [&](int i) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      const auto D = joint<K>::computed_pose(b, pose, q);
      body_motion<T> m = motion[b.parent];
      m.acceleration = acceleration_at(m, D.t);
      D.to_body(m.angular_velocity, m.angular_acceleration, m.acceleration);
      joint<K>::add_motion(b, v + b.v_index, dv + b.v_index, m);
      motion.set(i, m);
    });
  };
  for_bodies<T>(model.bodies, move, lanes);
}

/// The motion of a ground without gravity.
template <class T> KSL_LANES body_motion<T> ground_at_rest() {
  const vec3<T> zero = {T(0), T(0), T(0)};
  return {zero, zero, zero};
}

} // namespace KSL_ISA
} // namespace ksl
