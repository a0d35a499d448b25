// KSL: reactions: the wrench that the parent side exerts on the child side through a joint, in parts, at any point, in
// any axes.  Coscrews page, eqs. (7)–(9).
#pragma once

#include "ksl/engine/inverse_dynamics.hpp"

namespace ksl {

enum class wrench_part : int { total, constraint, actuation };
enum class wrench_side : int { child, parent };       ///< the wrench on which side
enum class wrench_frame : int { joint, world, link }; ///< whose origin, or whose axes

/// Which reactions, and how they are to be expressed.
struct reaction_request {
  int n = 0;                  ///< joints
  const int *link = nullptr;  ///< (n) the child link of each
  wrench_part part = wrench_part::total;
  wrench_side on = wrench_side::child;
  wrench_frame at = wrench_frame::joint;   ///< point
  int at_link = -1;                        ///< whose origin, where `at` is link
  double offset[3] = {0, 0, 0};            ///< added to the joint's origin, in the joint's axes, where `at` is joint
  wrench_frame axes = wrench_frame::joint;
  int axes_link = -1;
  bool angular_first = false; ///< the order of the six numbers
};

inline namespace KSL_ISA {

/// The wrench through the joint that carries each link, fixed joints included, into data.link_wrench; after
/// inverse_dynamics with the same external wrenches.
template <class T>
void link_wrenches(const model_view<scalar_of<T>> &model, const data_view<T> &data, const external_wrenches<T> &external) {
  using A = algebra<T>;
  for (int l = 0; l < model.links; ++l) {
    const auto motion = body_at<T>(model.link[l].body).template get<body_motion>(data.motion);
    data.link_wrench[l] = newton_euler(spread<T>(model.link[l].inertia), motion);
  }
  for (int k = 0; k < external.n; ++k) {
    const coscrew<T> f = external_in_body(model, external, k);
    A::nxpy_cc(&f, &data.link_wrench[external.link[k]]);
  }
  for (int l = model.links - 1; l > 0; --l) {
    const link<scalar_of<T>> &child = model.link[l];
    if (child.parent < 0)
      continue;
    coscrew<T> f = data.link_wrench[l];
    if (child.first)
      by_kind(model.body[child.body].kind, [&]<joint_kind K>() KSL_INLINED {
        const auto D = pose_in_parent<K, T>::kept(model.body[child.body], data, child.body);
        D.to_parent(f.lin, f.ang);
        A::product_CoAdtc(&D.t, &f, &f);
      });
    A::xpy_cc(&f, &data.link_wrench[child.parent]);
  }
}

/// The part of a wrench in a body's canonical frame: h̄* f along the joint's motion, H̄* f across it (coscrews (7), (9)).
template <class T> inline coscrew<T> part_of(joint_kind kind, wrench_part part, const coscrew<T> &f) {
  const coscrew<T> zero = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  coscrew<T> actuation = zero, constraint = f;
  switch (kind) {
  case joint_kind::revolute:
  case joint_kind::continuous:
    actuation.ang.z = f.ang.z;
    constraint.ang.z = T(0);
    break;
  case joint_kind::prismatic:
    actuation.lin.z = f.lin.z;
    constraint.lin.z = T(0);
    break;
  case joint_kind::floating:
    actuation = f;
    constraint = zero;
    break;
  case joint_kind::fixed:
    break;
  }
  return part == wrench_part::total ? f : part == wrench_part::constraint ? constraint : actuation;
}

/// Pose of the joint's frame in the frame that a request asks for: the coadjoint of this pose carries the wrench there.
template <class T>
inline SE3<T> pose_in_requested(const model_view<scalar_of<T>> &model, const data_view<T> &data, const reaction_request &request,
                                int link) {
  using A = algebra<T>;
  const SE3<T> joint = link_pose(model, data, link);
  vec3<T> point = {T(request.offset[0]), T(request.offset[1]), T(request.offset[2])}; // in the joint's frame
  if (request.at == wrench_frame::joint) {
    A::product_dv(&joint, &point, &point);
  } else {
    point = {T(0), T(0), T(0)};
    if (request.at == wrench_frame::link)
      point = link_pose(model, data, request.at_link).t;
  }
  SE3<T> target = {{T(1), T(0), T(0), T(0), T(1), T(0), T(0), T(0), T(1)}, point}; // requested frame in the world
  if (request.axes == wrench_frame::joint)
    target.R = joint.R;
  else if (request.axes == wrench_frame::link)
    target.R = link_pose(model, data, request.axes_link).R;
  SE3<T> D;
  A::product_dinvd(&target, &joint, &D);
  return D;
}

/// Is a wrench asked for just where and as the joint's frame gives it?
inline bool in_joint_frame(const reaction_request &request) {
  return request.at == wrench_frame::joint && request.axes == wrench_frame::joint && request.offset[0] == 0 &&
         request.offset[1] == 0 && request.offset[2] == 0;
}

/// From the body's canonical frame to the link's.
template <class T> KSL_LANES void turn_to_link(const link<scalar_of<T>> &l, coscrew<T> &f) {
  using A = algebra<T>;
  const SE3<T> pose = spread<T>(l.pose);
  if (l.first) // turned about the joint's origin
    A::product_CoAdrinvc(&pose.R, &f, &f);
  else
    A::product_CoAdinvc(&pose, &f, &f);
}

template <class T> KSL_LANES void put_reaction(const coscrew<T> &f, bool angular_first, T *out) {
  T *const lin = out + (angular_first ? 3 : 0), *const ang = out + (angular_first ? 0 : 3);
  lin[0] = f.lin.x, lin[1] = f.lin.y, lin[2] = f.lin.z;
  ang[0] = f.ang.x, ang[1] = f.ang.y, ang[2] = f.ang.z;
}

/// The same from the canonical frame.
template <class T>
KSL_LANES void put_canonical(coscrew<T> f, const link<scalar_of<T>> &l, bool angular_first, T *out) {
  if (!l.along_axis) {
    turn_to_link(l, f);
    return put_reaction(f, angular_first, out);
  }
  T *const lin = out + (angular_first ? 3 : 0), *const ang = out + (angular_first ? 0 : 3);
  const plane_turn<T> about_z = spread<T>(l.turn.about_z);
  const T sense = T(l.turn.sense);
  const int x = l.turn.slot[0], y = l.turn.slot[1], z = l.turn.slot[2];
  turn_z(about_z, f.lin);
  turn_z(about_z, f.ang);
  lin[x] = f.lin.x, lin[y] = sense * f.lin.y, lin[z] = sense * f.lin.z;
  ang[x] = f.ang.x, ang[y] = sense * f.ang.y, ang[z] = sense * f.ang.z;
}

/// Reactions of the requested joints into out (n, 6); after inverse_dynamics.  The split is made in the joint's frame and
/// then moved by the coadjoint: splitting again at another point would give something else.
template <class T>
void reactions(const model_view<scalar_of<T>> &model, const data_view<T> &data, const external_wrenches<T> &external,
               const reaction_request &request, T *out) {
  using A = algebra<T>;
  bool any_welded = false;
  for (int k = 0; k < request.n; ++k)
    any_welded |= !model.link[request.link[k]].first;
  if (any_welded)
    link_wrenches(model, data, external);
  if (!in_joint_frame(request))
    compose_poses(model, data);

  const bool moved = !in_joint_frame(request);
  for (int k = 0; k < request.n; ++k, out += 6) {
    const link<scalar_of<T>> &l = model.link[request.link[k]];
    // number by number: a struct chosen as a whole would go through memory
    const T *const from = l.first ? numbers_of<6>(data.wrench, l.body) : &data.link_wrench[request.link[k]].lin.x;
    const int step = l.first ? group<T> : 1;
    coscrew<T> f = {{from[0], from[step], from[2 * step]}, {from[3 * step], from[4 * step], from[5 * step]}};
    coscrew<T> part = part_of(l.first ? model.body[l.body].kind : joint_kind::fixed, request.part, f);
    turn_to_link(l, part);
    if (moved) {
      const SE3<T> D = pose_in_requested(model, data, request, request.link[k]);
      A::product_CoAdc(&D, &part, &part);
    }
    if (request.on == wrench_side::parent)
      A::coscrew_invert(&part);
    put_reaction(part, request.angular_first, out);
  }
}

/// Efforts tau (nv) and the requested reactions out (n, 6) at once.  Those of joints that move, in their own frames and in
/// the order of the joints, are written as inverse dynamics comes by; others follow.
template <class T>
void inverse_dynamics_with_reactions(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, const T *v,
                                     const T *dv, const external_wrenches<T> &external, T *tau, const reaction_request &request,
                                     T *out) {
  const bool as_found = in_joint_frame(request) && request.on == wrench_side::child, total = request.part == wrench_part::total;
  const bool angular_first = request.angular_first;
  const int *const links = request.link;
  const link<scalar_of<T>> *const link_of = model.link;
  int missing = request.n;
  if (!as_found)
    inverse_dynamics(model, data, q, v, dv, external, tau);
  else
    inverse_dynamics(model, data, q, v, dv, external, tau, [&](int i, joint_kind kind, const coscrew<T> &f) KSL_INLINED {
      if (missing == 0)
        return;
      const link<scalar_of<T>> &l = link_of[links[missing - 1]];
      if (l.body != i || !l.first)
        return;
      --missing;
      if (total)
        put_canonical(f, l, angular_first, out + 6 * missing);
      else
        put_canonical(part_of(kind, request.part, f), l, angular_first, out + 6 * missing);
    });
  if (missing > 0)
    reactions(model, data, external, request, out);
}

} // namespace KSL_ISA
} // namespace ksl
