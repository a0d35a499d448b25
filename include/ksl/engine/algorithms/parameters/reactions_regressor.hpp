// KSL: the regressor of reactions: the wrench through each joint as a linear function of the links' inertial parameters.
#pragma once

#include "ksl/engine/algorithms/inverse/reactions.hpp"
#include "ksl/engine/algorithms/parameters/link_regressor.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct reactions_regressor_workspace {
  forward_kinematics_workspace<T> poses;
  per_body<body_motion, T> motion; ///< of each body, in its frame

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    poses.lay_out(memory, model);
    memory.lay_out(model.bodies, motion);
  }
};

/// The twist t with t · f = s · (the requested part of f) for every wrench f: the transpose of part_through (reactions.hpp), applied to
/// s.  All is in the frame of body b.
template <joint_kind K, class T>
KSL_LANES screw<T> part_of_twist(const body<scalar_of<T>> &b, const pose_workspace<T> &pose, wrench_part part,
                                 const screw<T> &s) {
  if (part == (b.follows ? wrench_part::actuation : wrench_part::coupling))
    return {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  T share[most_coordinates<K>];
  for_coordinates<K>(b, [&](auto k) KSL_INLINED {
    T unit[most_coordinates<K>];
    for (int c = 0; c < most_coordinates<K>; ++c)
      unit[c] = T(c == k ? 1 : 0);
    const coscrew<T> f = joint<K>::drive(b, unit);
    share[k] = algebra<T>::dot_cs(&f, &s);
  });
  screw<T> driven = joint<K>::twist(b, share), held;
  algebra<T>::subtract_ss(&s, &driven, &held);
  if constexpr (only_turns(K))
    if (b.ends_universal) { // this split is a symmetric projector, so that it is the same for twists as for wrenches
      coscrew<T> constraint = {held.lin, held.ang}, actuation = {driven.lin, driven.ang};
      joint<joint_kind::universal>::move_first_drive(pose.rotation(b), constraint, actuation);
      held.ang = constraint.ang, driven.ang = actuation.ang;
    }
  return part == wrench_part::constraint ? held : driven;
}

/// The part of a wrench through the joint that carries a link, with twists of the link's frame in its axes.  A fixed joint has
/// neither actuation nor coupling.
template <class T>
inline screw<T> part_at_link(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                             const link<scalar_of<T>> &l, wrench_part part, screw<T> s) {
  const body<scalar_of<T>> &b = model.body[l.body];
  if (part == wrench_part::total)
    return s;
  if (!l.carried_by_moving_joint || l.body == 0)
    return part == wrench_part::constraint ? s : screw<T>{{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  const SE3<T> in_body = spread<T>(l.pose);
  algebra<T>::product_Ads(&in_body, &s, &s);
  by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED { s = part_of_twist<K>(b, pose, part, s); });
  algebra<T>::product_Adinvs(&in_body, &s, &s);
  return s;
}

/// Calls step(r, c, l, s) for component c of the reaction of request.link[r] and each link l beyond that joint, after the poses are
/// known.  s is a twist of the frame of link l.  The component is the sum of s · f_l over these links, where f_l is the wrench that
/// gives link l its motion.
template <class T, class Step>
KSL_LANES void for_components(const model_view<scalar_of<T>> &model, const forward_kinematics_workspace<T> &poses,
                              const reaction_request &request, Step step) {
  using A = algebra<T>;
  const T sign = T(request.on == wrench_side::parent ? -1 : 1);
  for (int r = 0; r < request.n; ++r) {
    const int first = request.link[r];
    const SE3<T> joint = link_pose(model, poses.in_world, first);
    const SE3<T> target = requested_frame(model, poses.in_world, request, joint);
    SE3<T> D; // of the joint's frame in the requested one
    A::product_dinvd(&target, &joint, &D);
    screw<T> component[6]; // as twists of the joint's frame
    for (int c = 0; c < 6; ++c) {
      T unit[6] = {T(0), T(0), T(0), T(0), T(0), T(0)};
      unit[request.angular_first ? (c + 3) % 6 : c] = sign;
      screw<T> s = {{unit[0], unit[1], unit[2]}, {unit[3], unit[4], unit[5]}};
      A::product_Adinvs(&D, &s, &s);
      component[c] = part_at_link(model, poses.pose, model.link[first], request.part, s);
    }
    for (int l = first; l < model.links; ++l) {
      if (!is_carried(model, first, l))
        continue;
      const SE3<T> pose = link_pose(model, poses.in_world, l);
      SE3<T> seen; // of the joint's frame in the link's
      A::product_dinvd(&pose, &joint, &seen);
      for (int c = 0; c < 6; ++c) {
        screw<T> s;
        A::product_Ads(&seen, &component[c], &s);
        step(r, c, l, s);
      }
    }
  }
}

/// Y (request.n, 6, links, 10), row-major, for q (nq), v (nv), dv (nv): reactions are Σ Y φ over all links of the model, with their
/// ten parameters φ (link_regressor.hpp), under gravity without external wrenches.  Point, axes, part, side and order are those of the
/// request.  A component of a wrench is its power on a unit twist.  O(joints × links).
template <class T>
void reactions_regressor(const model_view<scalar_of<T>> &model, const reactions_regressor_workspace<T> &w, const T *q,
                         const T *v, const T *dv, const reaction_request &request, T *Y) {
  const int n = model.links;
  for (std::ptrdiff_t k = 0; k < std::ptrdiff_t(60) * request.n * n; ++k)
    Y[k] = T(0);
  body_motions(model, w.poses.pose, w.motion, ground_motion<T>(model), q, v, dv, [](auto) KSL_INLINED {});
  compose_poses(model, w.poses.pose, w.poses.in_world);
  for_components(model, w.poses, request, [&](int r, int c, int l, const screw<T> &s) KSL_INLINED {
    const body_motion<T> motion = motion_of_link(model.link[l], w.motion[model.link[l].body]);
    wrench_form(s, motion, Y + parameters_of_link * ((std::ptrdiff_t(6) * r + c) * n + l));
  });
}

} // namespace KSL_ISA
} // namespace ksl
