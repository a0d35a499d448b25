// KSL: the constants of bodies, links and joints in the scalar of an algorithm, and inertias of several bodies in lanes.
#pragma once

#include "ksl/engine/lanes/body_lanes.hpp"
#include "ksl/engine/lanes/spread.hpp"
#include "ksl/engine/model/model.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T, class S> KSL_LANES plane_rotation<T> spread(const plane_rotation<S> &a) {
  return {T(a.sine), T(a.cosine)};
}

template <class T, class S> KSL_LANES tensor_rotation<T> spread(const tensor_rotation<S> &a) {
  return {T(a.cosine_sine), T(a.sine_sine), T(a.twice_sine), T(a.twice_cosine)};
}

template <class T, class S> coordinate_physics<T> spread(const coordinate_physics<S> &c) {
  return {T(c.armature),  T(c.damping), T(c.friction), T(c.friction_width),
          T(c.stiffness), T(c.rest),    c.q_index,     c.is_rotor};
}

template <class T, class S> body<T> spread(const body<S> &b) {
  return {b.kind,
          b.described,
          b.parent,
          b.q_index,
          b.v_index,
          b.nv,
          b.v_end,
          b.angle_index,
          b.chain_start,
          b.line_start,
          b.ancestors,
          b.pose_index,
          b.link,
          b.follows,
          b.has_children,
          b.ends_universal,
          b.is_base,
          b.no_offset,
          b.last_branch,
          spread<T>(b.placement),
          spread<T>(b.offset),
          spread<T>(b.alpha),
          spread<T>(b.theta0),
          spread<T>(b.alpha_of_tensor),
          T(b.pitch)};
}

template <class T, class S> link<T> spread(const link<S> &l) {
  const auto &p = l.permutation;
  return {l.body,
          l.parent,
          l.carried_by_moving_joint,
          l.axis_aligned,
          {spread<T>(p.about_z), T(p.sign), {p.slot[0], p.slot[1], p.slot[2]}},
          spread<T>(l.pose),
          spread<T>(l.inertia)};
}

/// The inertias of the bodies k with all welded links, in their canonical frames.
template <class P, class T> KSL_LANES spatial_inertia<P> own_inertia(const model_view<scalar_of<T>> &model,
                                                                     bodies_at<P, T> k) {
  if constexpr (is_number<T>)
    return k.template get<spatial_inertia>(model.inertia);
  else
    return spread<P>(bodies_at<scalar_of<T>, scalar_of<T>>{k.i}.template get<spatial_inertia>(model.inertia));
}

/// The own inertia of body i.
template <class T> KSL_LANES spatial_inertia<T> own_inertia(const model_view<scalar_of<T>> &model, int i) {
  return own_inertia(model, body_at<T>(i));
}

/// The own mass of body i.
template <class S> KSL_LANES S own_mass(const model_view<S> &model, int i) {
  return numbers_of<10>(model.inertia, i)[0];
}

} // namespace KSL_ISA
} // namespace ksl
