// KSL: mechanical energy, and the power of external wrenches.
#pragma once

#include "ksl/engine/inverse_dynamics.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Twist of each body in its own frame; after forward_kinematics.  Featherstone, RBDA (2008), eq. (5.14).
template <class T> void body_twists(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *v) {
  using A = algebra<T>;
  data.twist[0] = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      const auto D = pose_in_parent<K, T>::kept(b, data, i);
      const screw<T> joint = joint_twist<K>(v + b.v_index);
      screw<T> twist = data.twist[b.parent];
      vec3<T> turning; // of the body's origin
      A::cross_vv(&twist.ang, &D.t, &turning);
      A::xpy_vv(&turning, &twist.lin);
      D.to_body(twist.lin, twist.ang);
      A::xpy_ss(&joint, &twist);
      data.twist[i] = twist;
    });
  }
}

/// Kinetic energy and potential energy of gravity (J), the latter zero with every centroid at the world's origin.
/// Leaves poses and twists in `data`.
template <class T>
void energy(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, const T *v, T *kinetic, T *potential) {
  using A = algebra<T>;
  forward_kinematics(model, data, q);
  body_twists(model, data, v);
  const vec3<T> gravity = spread<T>(model.gravity);
  T twice_kinetic = T(0), minus_potential = T(0);
  for (int i = 0; i < model.bodies; ++i) {
    const spatial_inertia<T> I = spread<T>(model.body[i].inertia);
    coscrew<T> momentum;
    vec3<T> h;
    A::product_Ms(&I, &data.twist[i], &momentum);
    twice_kinetic = twice_kinetic + A::dot_cs(&momentum, &data.twist[i]);
    A::product_drv(&data.in_world[i].R, &I.h, &h); // mass × centroid, seen from the world's origin
    A::axpy_vv(I.m, &data.in_world[i].t, &h);
    minus_potential = minus_potential + A::dot_vv(&gravity, &h);
  }
  *kinetic = T(0.5) * twice_kinetic;
  *potential = -minus_potential;
}

/// Power of external wrenches: Σ f · v of each link.  q (nq), v (nv).
template <class T>
void external_power(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, const T *v,
                    const external_wrenches<T> &external, T *power) {
  using A = algebra<T>;
  forward_kinematics(model, data, q);
  body_twists(model, data, v);
  *power = T(0);
  for (int k = 0; k < external.n; ++k) {
    const coscrew<T> f = external_in_body(model, external, k);
    *power = *power + A::dot_cs(&f, &data.twist[model.link[external.link[k]].body]);
  }
}

} // namespace KSL_ISA
} // namespace ksl
