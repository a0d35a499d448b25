// KSL: reactions: the wrench that the parent side exerts on the child side through a joint, whole or in parts, about any point
// and in any axes.  Coscrews page, eqs. (7)–(9).
#pragma once

#include "ksl/engine/algorithms/inverse/inverse_dynamics.hpp"
#include "ksl/engine/algorithms/kinematics/forward_kinematics.hpp"
#include "ksl/engine/steps/reaction_request.hpp"

namespace ksl {

inline namespace KSL_ISA {

/// Begins with the workspace of inverse dynamics, so that reactions can read its results in the same memory.
template <class T> struct reactions_workspace {
  inverse_dynamics_workspace<T> dynamics;
  array_of<SE3<T>> in_world;        ///< pose of each body
  array_of<coscrew<T>> link_wrench; ///< through the joint that carries each link, in its body's frame

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    dynamics.lay_out(memory, model);
    dynamics.wrench.with_ground = true;
    in_world.lay_out(memory, model.bodies);
    link_wrench.lay_out(memory, model.links);
  }
};
template <class T> using inverse_dynamics_with_reactions_workspace = reactions_workspace<T>;

/// The wrench through the joint that carries each link, fixed joints included, into w.link_wrench; after inverse_dynamics
/// with the same external wrenches.
template <class T>
void link_wrenches(const model_view<scalar_of<T>> &model, const reactions_workspace<T> &w,
                   const external_wrenches<T> &external) {
  using A = algebra<T>;
  for (int l = 0; l < model.links; ++l)
    w.link_wrench[l] = newton_euler(spread<T>(model.link[l].inertia), w.dynamics.motion[model.link[l].body]);
  for (int k = 0; k < external.n; ++k) {
    const coscrew<T> f = external_in_body(model, w.dynamics.pose, external, k);
    A::nxpy_cc(&f, &w.link_wrench[external.link[k]]);
  }
  for (int l = model.links - 1; l > 0; --l) {
    const link<scalar_of<T>> &child = model.link[l];
    coscrew<T> f = w.link_wrench[l];
    const int parent_body =
        model.link[child.parent].body; // that of a welded link; two bodies up through a universal joint
    for (int i = child.body; i != parent_body; i = model.body[i].parent) {
      const body<scalar_of<T>> &b = model.body[i];
      by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
        const auto D = joint<K>::kept_pose(b, w.dynamics.pose);
        D.to_parent(f.lin, f.ang);
        A::product_CoAdtc(&D.t, &f, &f);
      });
    }
    A::xpy_cc(&f, &w.link_wrench[child.parent]);
  }
}

/// Is link l on the child side of the joint that carries `first`?
template <class S> inline bool is_carried(const model_view<S> &model, int first, int l) {
  while (l > first)
    l = model.link[l].parent;
  return l == first;
}

/// The requested part, not the total, of a wrench in a body's canonical frame.  The actuation part is h* Sᵀ f, called
/// coupling where the joint follows another; the constraint part is the rest (coscrews (7), (9)).  pose: a
/// pose_workspace<T>, or what has such a function rotation.
template <joint_kind K, class T, class Poses>
KSL_LANES coscrew<T> part_through(const body<scalar_of<T>> &b, const Poses &pose, wrench_part part,
                                  const coscrew<T> &f) {
  if (part == (b.follows ? wrench_part::actuation : wrench_part::coupling))
    return {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  T tau[most_coordinates<K>];
  joint<K>::effort(b, f, tau);
  coscrew<T> actuation = joint<K>::drive(b, tau), constraint;
  algebra<T>::subtract_cc(&f, &actuation, &constraint);
  if constexpr (only_turns(K))
    if (b.ends_universal) [[unlikely]] // the first axis is that of the body inside
      joint<joint_kind::universal>::move_first_drive(pose.rotation(b), constraint, actuation);
  return part == wrench_part::constraint ? constraint : actuation;
}

/// The part of the wrench through the joint that carries a link.  Through a fixed joint all of it is constraint.
template <class T> inline coscrew<T> part_of(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                                             const link<scalar_of<T>> &l, wrench_part part, const coscrew<T> &f) {
  const body<scalar_of<T>> &b = model.body[l.body];
  const bool moves = l.carried_by_moving_joint && l.body > 0;
  if (part == wrench_part::total || !moves) {
    const coscrew<T> none = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
    return part == wrench_part::actuation || part == wrench_part::coupling ? none : f;
  }
  coscrew<T> found = f;
  by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED { found = part_through<K>(b, pose, part, f); });
  return found;
}

/// The requested frame of a joint's wrench, in the world; joint: pose of the joint's frame.
template <class T> inline SE3<T> requested_frame(const model_view<scalar_of<T>> &model,
                                                 const array_of<SE3<T>> &in_world, const reaction_request &request,
                                                 const SE3<T> &joint) {
  vec3<T> point = {T(request.offset[0]), T(request.offset[1]), T(request.offset[2])}; // in the joint's frame
  if (request.at == wrench_frame::joint) {
    algebra<T>::product_dv(&joint, &point, &point);
  } else {
    point = {T(0), T(0), T(0)};
    if (request.at == wrench_frame::link)
      point = link_pose(model, in_world, request.at_link).t;
  }
  SE3<T> target = {{T(1), T(0), T(0), T(0), T(1), T(0), T(0), T(0), T(1)}, point};
  if (request.axes == wrench_frame::joint)
    target.R = joint.R;
  else if (request.axes == wrench_frame::link)
    target.R = link_pose(model, in_world, request.axes_link).R;
  return target;
}

/// Pose of the joint's frame in the requested frame.  The coadjoint of this pose transforms the wrench.
template <class T> inline SE3<T> pose_in_requested(const model_view<scalar_of<T>> &model,
                                                   const reactions_workspace<T> &w, const reaction_request &request,
                                                   int link) {
  const SE3<T> joint = link_pose(model, w.in_world, link);
  const SE3<T> target = requested_frame(model, w.in_world, request, joint);
  SE3<T> D;
  algebra<T>::product_dinvd(&target, &joint, &D);
  return D;
}

/// Is the wrench requested about the joint's origin and in the joint's axes?
inline bool in_joint_frame(const reaction_request &request) {
  return request.at == wrench_frame::joint && request.axes == wrench_frame::joint && request.offset[0] == 0 &&
         request.offset[1] == 0 && request.offset[2] == 0;
}

/// Transforms a wrench from the body's canonical frame to the link's.
template <class T> KSL_LANES void rotate_to_link(const link<scalar_of<T>> &l, coscrew<T> &f) {
  using A = algebra<T>;
  const SE3<T> pose = spread<T>(l.pose);
  if (l.carried_by_moving_joint) // rotated about the joint's origin
    A::product_CoAdrinvc(&pose.R, &f, &f);
  else
    A::product_CoAdinvc(&pose, &f, &f);
}

template <class T> KSL_LANES void put_reaction(const coscrew<T> &f, bool angular_first, T *out) {
  T *const lin = out + (angular_first ? 3 : 0), *const ang = out + (angular_first ? 0 : 3);
  lin[0] = f.lin.x, lin[1] = f.lin.y, lin[2] = f.lin.z;
  ang[0] = f.ang.x, ang[1] = f.ang.y, ang[2] = f.ang.z;
}

/// Writes a wrench that is given in the canonical frame, in the axes of the link.
template <class T>
KSL_LANES void put_canonical(coscrew<T> f, const link<scalar_of<T>> &l, bool angular_first, T *out) {
  if (!l.axis_aligned) {
    rotate_to_link(l, f);
    return put_reaction(f, angular_first, out);
  }
  T *const lin = out + (angular_first ? 3 : 0), *const ang = out + (angular_first ? 0 : 3);
  const plane_rotation<T> about_z = spread<T>(l.permutation.about_z);
  const T sign = T(l.permutation.sign);
  const int x = l.permutation.slot[0], y = l.permutation.slot[1], z = l.permutation.slot[2];
  rotate_z(about_z, f.lin);
  rotate_z(about_z, f.ang);
  lin[x] = f.lin.x, lin[y] = sign * f.lin.y, lin[z] = sign * f.lin.z;
  ang[x] = f.ang.x, ang[y] = sign * f.ang.y, ang[z] = sign * f.ang.z;
}

/// Writes the requested part of the wrench through the joint that carries a link, in a pose that the request names; moved: it isn't that of the
/// joint.  The wrench is split in the joint's frame and the part is then transformed by the coadjoint.  A split at another point would give a
/// different result.
template <class T>
KSL_LANES void put_part(const model_view<scalar_of<T>> &model, const reactions_workspace<T> &w,
                        const reaction_request &request, bool moved, int link_index, T *out) {
  const link<scalar_of<T>> &l = model.link[link_index];
  // number by number: a struct selected as a whole is copied by wide loads of narrow stores, which stall
  const bool own = l.carried_by_moving_joint;
  const T *const from = own ? &w.dynamics.wrench.through.number(l.body, 0) : &w.link_wrench[link_index].lin.x;
  const int step = own ? lane_block<T> : 1;
  const coscrew<T> f = {{from[0], from[step], from[2 * step]}, {from[3 * step], from[4 * step], from[5 * step]}};
  coscrew<T> part = part_of(model, w.dynamics.pose, l, request.part, f);
  rotate_to_link(l, part);
  if (moved) {
    const SE3<T> D = pose_in_requested(model, w, request, link_index);
    algebra<T>::product_CoAdc(&D, &part, &part);
  }
  if (request.on == wrench_side::parent)
    algebra<T>::coscrew_invert(&part);
  put_reaction(part, request.angular_first, out);
}

/// Is the joint that carries the link, in its body, a weld?  Its wrench is found by link_wrenches.
template <class S> bool is_welded(const model_view<S> &model, int link) {
  return !model.link[link].carried_by_moving_joint;
}

/// Reactions of the requested joints into out (n, 6); after inverse_dynamics.  Inlined, it would take registers from the recursion, which most
/// calls are.
template <class T>
KSL_NOT_INLINED void reactions(const model_view<scalar_of<T>> &model, const reactions_workspace<T> &w,
                               const external_wrenches<T> &external, const reaction_request &request, T *out) {
  bool any_welded = false;
  for (int k = 0; k < request.n; ++k)
    any_welded |= is_welded(model, request.link[k]);
  if (any_welded)
    link_wrenches(model, w, external);
  const bool moved = !in_joint_frame(request);
  if (moved)
    compose_poses(model, w.dynamics.pose, w.in_world);
  for (int k = 0; k < request.n; ++k)
    put_part(model, w, request, moved, request.link[k], out + 6 * k);
}

/// Efforts tau (nv) and the requested reactions out (n, 6) in one call.  Reactions of moving joints, if requested in their own
/// frames and in the order of the joints, are written during the backward pass.  Others are computed afterwards.
template <class T>
void inverse_dynamics_with_reactions(const model_view<scalar_of<T>> &model, const reactions_workspace<T> &w, const T *q,
                                     const T *v, const T *dv, const external_wrenches<T> &external, T *tau,
                                     const reaction_request &request, T *out) {
  const bool as_found = in_joint_frame(request) && request.on == wrench_side::child;
  const bool angular_first = request.angular_first;
  const wrench_part part = request.part;
  const int *const links = request.link;
  int missing = request.n;
  if (!as_found)
    inverse_dynamics(model, w.dynamics, q, v, dv, external, tau);
  else
    inverse_dynamics_by_joint(
        model, w.dynamics, q, v, dv, external, tau, [&]<joint_kind K>(int i, const coscrew<T> &f) KSL_INLINED {
          if (missing == 0)
            return;
          const link<scalar_of<T>> &l = model.link[links[missing - 1]];
          if (l.body != i || !l.carried_by_moving_joint)
            return;
          --missing;
          if (part == wrench_part::total) // not one call for both: a struct chosen as a whole is copied through memory
            put_canonical(f, l, angular_first, out + 6 * missing);
          else
            put_canonical(part_through<K>(model.body[i], w.dynamics.pose, part, f), l, angular_first,
                          out + 6 * missing);
        });
  if (missing > 0)
    reactions(model, w, external, request, out);
}

} // namespace KSL_ISA
} // namespace ksl
