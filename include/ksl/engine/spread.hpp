// KSL: converts constants of a model to another scalar.  A model holds plain numbers.  For packs the conversion is a broadcast
// to all lanes; for plain numbers of the same precision it costs nothing.
#pragma once

#include "ksl/engine/model.hpp"
#include "ksl/pack.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T, class S> KSL_LANES vec3<T> spread(const vec3<S> &v) { return {T(v.x), T(v.y), T(v.z)}; }

template <class T, class S> KSL_LANES mat3x3<T> spread(const mat3x3<S> &R) {
  return {T(R.m00), T(R.m10), T(R.m20), T(R.m01), T(R.m11), T(R.m21), T(R.m02), T(R.m12), T(R.m22)};
}

template <class T, class S> KSL_LANES SE3<T> spread(const SE3<S> &D) { return {spread<T>(D.R), spread<T>(D.t)}; }

template <class T, class S> KSL_LANES spatial_inertia<T> spread(const spatial_inertia<S> &I) {
  return {T(I.m), spread<T>(I.h), T(I.Ixx), T(I.Iyy), T(I.Izz), T(I.Ixy), T(I.Iyz), T(I.Izx)};
}

template <class T, class S> KSL_LANES plane_rotation<T> spread(const plane_rotation<S> &a) { return {T(a.sine), T(a.cosine)}; }

template <class T, class S> KSL_LANES tensor_rotation<T> spread(const tensor_rotation<S> &a) {
  return {T(a.cosine_sine), T(a.sine_sine), T(a.twice_sine), T(a.twice_cosine)};
}

template <class T, class S> coordinate_physics<T> spread(const coordinate_physics<S> &c) {
  return {T(c.armature), T(c.damping), T(c.friction), T(c.friction_width), T(c.stiffness), T(c.rest), c.q_index, c.is_rotor};
}

template <class T, class S> body<T> spread(const body<S> &b) {
  return {b.kind, b.described, b.parent, b.q_index, b.v_index, b.nv, b.v_end, b.angle_index, b.chain_start, b.line_start, b.ancestors,
          b.pose_index, b.link, b.follows, b.has_children, b.ends_universal, b.is_base, b.no_offset, spread<T>(b.placement),
          spread<T>(b.offset), spread<T>(b.alpha), spread<T>(b.theta0), spread<T>(b.alpha_of_tensor), T(b.pitch)};
}

template <class T, class S> link<T> spread(const link<S> &l) {
  const auto &p = l.permutation;
  return {l.body, l.parent, l.carried_by_moving_joint, l.axis_aligned,
          {spread<T>(p.about_z), T(p.sign), {p.slot[0], p.slot[1], p.slot[2]}}, spread<T>(l.pose), spread<T>(l.inertia)};
}

} // namespace KSL_ISA
} // namespace ksl
