// KSL: what a joint's motor supplies besides the transmitted effort: for damping, dry friction, the inertia of its rotor, a spring.
//
// motor effort = transmitted effort + armature q̈ + damping q̇ + friction + stiffness (q − rest)
//
// The transmitted effort is Sᵀ f, the part of the joint's wrench along its motion.  Armature is what the rotor adds to the
// coordinate: its inertia times the gear ratio squared.  Dry friction follows the smooth law F v / √(v² + w²), w being its width:
// 0.71 F at the speed w, F within 1 % from 7 w on.  The model has no arrays of physics unless its options name some
// (docs/conventions.md).
#pragma once

#include "ksl/engine/model/model.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

/// The physics of the coordinates of a body's joint, (b.nv); null if the model has none.
template <class S> KSL_LANES const coordinate_physics<S> *physics_of(const model_view<S> &model, const body<S> &b) {
  return model.physics ? model.physics + b.v_index : nullptr;
}

/// Dry friction at the speed v, for F = 1; zero at rest.
template <class T, class S> KSL_LANES T friction_at(const T &v, const S &width) {
  return v / math<T>::sqrt(v * v + T(width * width));
}

/// The derivative of the law of friction by v: w² / (v² + w²)^(3/2).
template <class T, class S> KSL_LANES T friction_slope(const T &v, const S &width) {
  const T square = v * v + T(width * width);
  return T(width * width) / (square * math<T>::sqrt(square));
}

/// The second derivative of the law of friction by v: −3 w² v / (v² + w²)^(5/2).
template <class T, class S> KSL_LANES T friction_curvature(const T &v, const S &width) {
  const T square = v * v + T(width * width);
  return T(S(-3) * width * width) / square * (v / square) / math<T>::sqrt(square); // in this order nothing underflows
}

/// Effort of a coordinate's spring.
template <class T, class S> KSL_LANES T spring_effort(const coordinate_physics<S> &c, const T *q) {
  return c.stiffness == S(0) ? T(0) : T(c.stiffness) * (q[c.q_index] - T(c.rest));
}

/// What the motor supplies at a coordinate besides the transmitted effort and the effort that accelerates the rotor.
template <class T, class S> KSL_LANES T passive_effort(const coordinate_physics<S> &c, const T *q, const T &v) {
  return T(c.damping) * v + T(c.friction) * friction_at(v, c.friction_width) + spring_effort(c, q);
}

/// Sets `besides` (nv) to what motors supply besides the transmitted efforts.
template <class T>
void efforts_besides(const model_view<scalar_of<T>> &model, const T *q, const T *v, const T *dv, T *besides) {
  for (int k = 0; k < model.nv; ++k) {
    const coordinate_physics<scalar_of<T>> &c = model.physics[k];
    besides[k] = T(c.armature) * dv[k] + passive_effort(c, q, v[k]);
  }
}

/// Adds what joint physics contributes to the derivatives of efforts, matrices (nv, nv): numbers on the diagonals.  dtau_da may be null.
template <class T>
void add_physics_derivatives(const model_view<scalar_of<T>> &model, const T *v, T *dtau_dq, T *dtau_dv, T *dtau_da) {
  for (int k = 0; k < model.nv; ++k) {
    const coordinate_physics<scalar_of<T>> &c = model.physics[k];
    const std::ptrdiff_t at = std::ptrdiff_t(k) * model.nv + k;
    dtau_dq[at] = dtau_dq[at] + T(c.stiffness);
    dtau_dv[at] = dtau_dv[at] + (T(c.damping) + T(c.friction) * friction_slope(v[k], c.friction_width));
    if (dtau_da)
      dtau_da[at] = dtau_da[at] + T(c.armature);
  }
}

/// Adds what dry friction contributes to the second derivatives of efforts by v, (nv, nv, nv).  The other laws are linear.
template <class T> void add_physics_second_derivatives(const model_view<scalar_of<T>> &model, const T *v,
                                                       T *d2tau_dvdv) {
  const std::ptrdiff_t n = model.nv;
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    const coordinate_physics<scalar_of<T>> &c = model.physics[k];
    T &x = d2tau_dvdv[(k * n + k) * n + k];
    x = x + T(c.friction) * friction_curvature(v[k], c.friction_width);
  }
}

} // namespace KSL_ISA
} // namespace ksl
