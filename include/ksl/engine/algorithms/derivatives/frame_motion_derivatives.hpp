// KSL: the first derivatives of the velocities and accelerations of links' frames, expressed as the options say.
//
// V is the twist of a frame and A its spatial acceleration.  Seen from the frame, they change ((2) of coordinate_motions.hpp)
//
//     with q_k by Ψ̇ and Ψ̈ − V × Ψ̇,   with v_k by S and Ψ̇ + Ṡ − V × S,   with a_k by 0 and S.                    (1)
//
// Where other axes or another point are asked for, let ξ be the part of S by which the frame moves relative to them.  Then ξ × V and
// ξ × A are added to the derivatives by q.                                                                         (2)
//
// Other accelerations than the spatial one have `times` ω × v added to the linear half, and its derivative, too.   (3)
#pragma once

#include "ksl/engine/algorithms/derivatives/coordinate_motions.hpp"
#include "ksl/engine/algorithms/kinematics/frame_motion.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct frame_velocities_derivatives_workspace {
  coordinate_motions_workspace<T> motions;
  array_of<int> supports; ///< bodies that carry any of the frames
  array_of<bool> carries;

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    motions.lay_out(memory, model);
    memory.lay_out(model.bodies, supports, carries);
  }
};
template <class T> using frame_accelerations_derivatives_workspace = frame_velocities_derivatives_workspace<T>;

/// Motions of the bodies that carry n links, and of their coordinates, without gravity: coordinate_motions for a part of the tree.
template <class T>
void motions_of_supports(const model_view<scalar_of<T>> &model, const frame_velocities_derivatives_workspace<T> &w,
                         const T *q, const T *v, const T *a, int n, const int *links) {
  const coordinate_motions_workspace<T> &m = w.motions;
  const T o = T(0), l = T(1);
  const body_list list = list_supports(model, w, n, links);
  sines_and_cosines_of_links(model, m.pose, q, n, links);
  m.carrier.clear_beyond(model.nv), m.coordinate.clear_beyond(model.nv);
  m.rotation.set(0, {l, o, o, o, l, o, o, o, l});
  start_at_ground(m, {o, o, o});
  for (const int *i = list.first; i < list.end; ++i) {
    const body<scalar_of<T>> &b = model.body[*i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      mat3x3<T> R = m.rotation[b.parent];
      const vec3<T> offset = place<K>(b, m.pose, m.rotation, *i, q, R);
      move_body<K>(b, m, *i, offset, v + b.v_index, a + b.v_index);
    });
  }
  if (n == 1) // lanes beyond a run get the same numbers again, or belong to coordinates that don't carry the link
    for_carriers(model, model.link[links[0]].body,
                 [&](int first, int end) KSL_INLINED { set_rates_in_lanes(m, first, end); });
  else
    set_rates_in_lanes(m, 0, model.nv);
  for (const int *i = list.first; i < list.end; ++i)
    correct_several(m, model.body[*i], *i);
}

/// The frame that a motion is expressed in, and the motion in this frame.
template <class T> struct expressed_motion {
  SE3<T> target; ///< pose in the common axes of the frame's tree
  screw<T> velocity, acceleration;
};

/// A twist in common axes, expressed in the frame `target`.
template <class T> KSL_LANES screw<T> in_target(const SE3<T> &target, const screw<T> &s) {
  screw<T> out;
  algebra<T>::product_Adinvs(&target, &s, &out);
  return out;
}

template <class T>
inline expressed_motion<T> expressed_motion_of(const model_view<scalar_of<T>> &model,
                                               const coordinate_motions_workspace<T> &w, int link,
                                               const frame_options &how) {
  using A = algebra<T>;
  const int i = model.link[link].body;
  SE3<T> target = link_in_tree(model, w, link);
  const vec3<T> offset = offset_of<T>(how);
  A::product_dv(&target, &offset, &target.t);
  if (!in_own_frame(how)) {
    const SE3<T> tree = tree_pose(model, w, tree_of(model, i));
    SE3<T> world;
    A::SE3_inverted(&tree, &world);
    if (how.axes == expressed_in::world)
      target.R = world.R;
    if (how.at == expressed_in::world)
      target.t = world.t;
  }
  const body_twist<T> m = w.motion[i];
  return {target, in_target(target, m.velocity), in_target(target, m.acceleration)};
}

/// ξ of (2): the motion s of the frame, as far as the axes and the point that the options name don't move with it.
template <class P> KSL_LANES screw<P> relative_to_options(screw<P> s, const frame_options &how) {
  const P o = P(scalar_of<P>(0));
  if (how.at == expressed_in::frame)
    s.lin = {o, o, o};
  if (how.axes == expressed_in::frame)
    s.ang = {o, o, o};
  return s;
}

template <class P> KSL_LANES screw<P> cross(const screw<P> &x, const screw<P> &y) {
  screw<P> out;
  algebra<P>::cross_ss(&x, &y, &out);
  return out;
}

/// The derivative of V by q_k: Ψ̇ + ξ × V, by (1) and (2).
template <class P>
KSL_LANES screw<P> velocity_by_q(const expressed_motion<P> &m, const coordinate_motion<P> &c,
                                 const screw<P> &relative) {
  screw<P> by = in_target(m.target, c.velocity_by_q);
  const screw<P> turned = cross(relative, m.velocity);
  algebra<P>::xpy_ss(&turned, &by);
  return by;
}

/// Calls step<P>(columns, motion in all lanes) for the coordinates that carry a link.
template <class T, class Step>
KSL_LANES void for_columns_of(const model_view<scalar_of<T>> &model, int link, const expressed_motion<T> &m,
                              Step step) {
  for_carriers(model, model.link[link].body, [&](int first, int end) KSL_INLINED {
    for_columns<T>(first, end, [&]<class P>(columns_at<P> k) KSL_INLINED {
      step(k, expressed_motion<P>{in_lanes<P>(m.target), in_lanes<P>(m.velocity), in_lanes<P>(m.acceleration)});
    });
  });
}

/// The derivatives of frame_velocities, each (n, 6, nv), row-major: by q along q ⊕ s e_k with v held componentwise; by v they are
/// the Jacobians.  O(bodies that carry the links + links × depth), besides writing 12 nv numbers for each link.
template <class T>
void frame_velocities_derivatives(const model_view<scalar_of<T>> &model,
                                  const frame_velocities_derivatives_workspace<T> &w, const T *q, const T *v, int n,
                                  const int *links, const frame_options &how, T *by_q, T *by_v) {
  motions_of_supports(model, w, q, v, v, n, links); // the accelerations have no effect here
  for (int l = 0; l < n; ++l) {
    const std::ptrdiff_t at = std::ptrdiff_t(6) * model.nv * l;
    const twist_columns<T> of_q = {by_q + at, model.nv, how.angular_first},
                           of_v = {by_v + at, model.nv, how.angular_first};
    of_q.clear(), of_v.clear();
    const expressed_motion<T> found = expressed_motion_of(model, w.motions, links[l], how);
    for_columns_of(model, links[l], found, [&]<class P>(columns_at<P> k, const expressed_motion<P> &m) KSL_INLINED {
      const coordinate_motion<P> c = w.motions.coordinate.template get<P>(k.c);
      const screw<P> S = in_target(m.target, c.S);
      of_v.set(k, S);
      of_q.set(k, velocity_by_q(m, c, relative_to_options(S, how)));
    });
  }
}

/// Adds `times` (dω × v + ω × dv) to dA (3), for a change of the twist V by dV.
template <class P> KSL_LANES void add_turning(const P &times, const screw<P> &V, const screw<P> &dV, screw<P> &dA) {
  using A = algebra<P>;
  vec3<P> turning, other;
  A::cross_vv(&dV.ang, &V.lin, &turning);
  A::cross_vv(&V.ang, &dV.lin, &other);
  A::xpy_vv(&other, &turning);
  A::axpy_vv(times, &turning, &dA.lin);
}

/// The derivatives of frame_accelerations, each (n, 6, nv), row-major: by q along q ⊕ s e_k with v and dv held componentwise; by v;
/// by dv they are the Jacobians.  O(bodies that carry the links + links × depth), besides writing 18 nv numbers for each link.
template <class T>
void frame_accelerations_derivatives(const model_view<scalar_of<T>> &model,
                                     const frame_accelerations_derivatives_workspace<T> &w, const T *q, const T *v,
                                     const T *dv, int n, const int *links, const frame_options &how, T *by_q, T *by_v,
                                     T *by_dv) {
  motions_of_supports(model, w, q, v, dv, n, links);
  for (int l = 0; l < n; ++l) {
    const std::ptrdiff_t at = std::ptrdiff_t(6) * model.nv * l;
    const twist_columns<T> of_q = {by_q + at, model.nv, how.angular_first},
                           of_v = {by_v + at, model.nv, how.angular_first},
                           of_dv = {by_dv + at, model.nv, how.angular_first};
    of_q.clear(), of_v.clear(), of_dv.clear();
    const expressed_motion<T> found = expressed_motion_of(model, w.motions, links[l], how);
    for_columns_of(model, links[l], found, [&]<class P>(columns_at<P> k, const expressed_motion<P> &m) KSL_INLINED {
      using A = algebra<P>;
      const P times = P(static_cast<scalar_of<P>>(1 - times_turning(how)));
      const coordinate_motion<P> c = w.motions.coordinate.template get<P>(k.c);
      const screw<P> S = in_target(m.target, c.S), own = in_target(m.target, c.velocity_by_q);
      const screw<P> relative = relative_to_options(S, how), moved = velocity_by_q(m, c, relative);
      screw<P> q_rate = in_target(m.target, c.acceleration_by_q), v_rate = in_target(m.target, c.acceleration_by_v);
      const screw<P> q_turned = cross(own, m.velocity), v_turned = cross(S, m.velocity),
                     a_turned = cross(relative, m.acceleration);
      A::xpy_ss(&q_turned, &q_rate); // Ψ̈ − V × Ψ̇ = Ψ̈ + Ψ̇ × V (1)
      A::xpy_ss(&a_turned, &q_rate); // ξ × A (2)
      A::xpy_ss(&v_turned, &v_rate); // Ψ̇ + Ṡ − V × S (1)
      add_turning(times, m.velocity, moved, q_rate);
      add_turning(times, m.velocity, S, v_rate);
      of_q.set(k, q_rate), of_v.set(k, v_rate), of_dv.set(k, S);
    });
  }
}

} // namespace KSL_ISA
} // namespace ksl
