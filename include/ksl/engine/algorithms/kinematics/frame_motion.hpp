// KSL: velocities and accelerations of links' frames.  One walk over the bodies that carry them gives those of several frames.
//
// Motions of bodies are kept in three-vectors and in the bodies' own axes, as inverse dynamics does (newton_euler.hpp), but
// without gravity.  Poses are computed only if a motion is to be expressed in the world.
#pragma once

#include "ksl/engine/algorithms/kinematics/frame_jacobian.hpp"
#include "ksl/engine/steps/newton_euler.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// The motion of a frame, in its own axes.
template <class T> struct frame_motion {
  body_motion<T> body; ///< the acceleration is classical
  vec3<T> velocity;    ///< of the origin
};

template <class T> struct frame_velocities_workspace {
  pose_workspace<T> pose;
  array_of<SE3<T>> in_world;
  array_of<screw<T>> twist;
  array_of<int> supports; ///< bodies that carry any of the frames
  array_of<bool> carries;

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, in_world, twist, supports, carries);
  }
};

template <class T> struct frame_accelerations_workspace {
  pose_workspace<T> pose;
  array_of<SE3<T>> in_world;
  array_of<frame_motion<T>> motion;
  array_of<int> supports;
  array_of<bool> carries;

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, in_world, motion, supports, carries);
  }
};

/// Bodies by index, parents first.
struct body_list { const int *first, *end; };

/// Lists the bodies that carry any of n links, without the ground.
template <class Workspace, class S>
body_list list_supports(const model_view<S> &model, const Workspace &w, int n, const int *links) {
  int *const list = &w.supports[0], *end = list + model.bodies, *first = end;
  if (n == 1) { // filled from the end
    for (int i = model.link[links[0]].body; i > 0; i = model.body[i].parent)
      *--first = i;
    return {first, end};
  }
  for (int i = 0; i < model.bodies; ++i)
    w.carries[i] = i == 0;
  for (int k = 0; k < n; ++k)
    for (int i = model.link[links[k]].body; !w.carries[i]; i = model.body[i].parent)
      w.carries[i] = true;
  end = list;
  for (int i = 1; i < model.bodies; ++i)
    if (w.carries[i])
      *end++ = i;
  return {list, end};
}

/// Sines and cosines for the supports of n links.
template <class T> void sines_and_cosines_of_links(const model_view<scalar_of<T>> &model, const pose_workspace<T> &w,
                                                   const T *q, int n, const int *links) {
  if (n == 1)
    sines_and_cosines_of_supports(model, w, q, model.link[links[0]].body);
  else
    sines_and_cosines(model, w, q);
}

/// Adds ω × r to a velocity.
template <class T> KSL_LANES void move_along(const vec3<T> &angular_velocity, const vec3<T> &r, vec3<T> &velocity) {
  vec3<T> turning;
  algebra<T>::cross_vv(&angular_velocity, &r, &turning);
  algebra<T>::xpy_vv(&turning, &velocity);
}

/// Replaces the motion of a point by that of the point at r from it, of the same body.
template <class T> KSL_LANES void move_along(const vec3<T> &r, screw<T> &twist) { move_along(twist.ang, r, twist.lin); }
template <class T> KSL_LANES void move_along(const vec3<T> &r, frame_motion<T> &m) {
  move_along(m.body.angular_velocity, r, m.velocity);
  m.body.acceleration = acceleration_at(m.body, r);
}

/// Applies `rotate` to the vectors of a motion.
template <class T, class Rotate> KSL_LANES void rotate_motion(screw<T> &s, Rotate rotate) {
  rotate(s.lin), rotate(s.ang);
}
template <class T, class Rotate> KSL_LANES void rotate_motion(frame_motion<T> &m, Rotate rotate) {
  rotate(m.velocity), rotate(m.body.acceleration);
  rotate(m.body.angular_velocity), rotate(m.body.angular_acceleration);
}

/// Sets the motions of the bodies in a list, in their own axes, and their poses if these are wanted.  add<K>(body, m) adds the motion
/// of a joint.  Featherstone, RBDA (2008), eqs. (5.14), (5.15).
template <class T, class Motions, class Add>
KSL_LANES void move_bodies(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                           const array_of<SE3<T>> &in_world, const Motions &motions, const T *q, body_list list,
                           bool with_poses, Add add) {
  in_world[0] = ground_pose<T>(model);
  for (const int *i = list.first; i < list.end; ++i) {
    const body<scalar_of<T>> &b = model.body[*i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      const auto D = joint<K>::computed_pose(b, pose, q);
      auto m = motions[b.parent];
      move_along(D.t, m);
      rotate_motion(m, [&](vec3<T> &x) KSL_INLINED { D.to_body(x); });
      add.template operator()<K>(b, m);
      motions[*i] = m;
      if (with_poses)
        in_world[*i] = composed(in_world[b.parent], D);
    });
  }
}

/// Replaces the motion of a link's body by that of the link's frame, with the options' offset.
template <class T, class Motion>
KSL_LANES void to_frame(const model_view<scalar_of<T>> &model, int link, const frame_options &how, Motion &m) {
  SE3<T> frame = spread<T>(model.link[link].pose);
  const vec3<T> offset = offset_of<T>(how);
  algebra<T>::product_dv(&frame, &offset, &frame.t);
  move_along(frame.t, m);
  rotate_motion(m, [&](vec3<T> &x) KSL_INLINED { algebra<T>::product_drinvv(&frame.R, &x, &x); });
}

/// Replaces the motion of a frame by that of the body's point at the world's origin, in the frame's axes.  `frame` is its pose.
template <class T, class Motion> KSL_LANES void to_world_origin(const SE3<T> &frame, Motion &m) {
  vec3<T> r;
  algebra<T>::product_drinvv(&frame.R, &frame.t, &r);
  algebra<T>::vec3_invert(&r);
  move_along(r, m);
}

/// Pose in the world of a link's frame, with the options' offset.
template <class T>
KSL_LANES SE3<T> frame_pose_at(const model_view<scalar_of<T>> &model, const array_of<SE3<T>> &in_world, int link,
                               const frame_options &how) {
  SE3<T> D = link_pose(model, in_world, link);
  const vec3<T> offset = offset_of<T>(how);
  algebra<T>::product_dv(&D, &offset, &D.t);
  return D;
}

/// Writes a twist or its rate, in the order of the options.
template <class T> KSL_LANES void write_motion(const screw<T> &s, const frame_options &how, T *out) {
  T *const lin = out + (how.angular_first ? 3 : 0), *const ang = out + (how.angular_first ? 0 : 3);
  lin[0] = s.lin.x, lin[1] = s.lin.y, lin[2] = s.lin.z;
  ang[0] = s.ang.x, ang[1] = s.ang.y, ang[2] = s.ang.z;
}

/// Calls write(k, m) with the motion of each of n frames at the requested origin and in the requested axes.
template <class T, class Motions, class Write>
KSL_LANES void express_motions(const model_view<scalar_of<T>> &model, const array_of<SE3<T>> &in_world,
                               const Motions &motions, int n, const int *links, const frame_options &how, Write write) {
  for (int k = 0; k < n; ++k) {
    auto m = motions[model.link[links[k]].body];
    to_frame<T>(model, links[k], how, m);
    if (!in_own_frame(how)) {
      const SE3<T> frame = frame_pose_at(model, in_world, links[k], how);
      if (how.at == expressed_in::world)
        to_world_origin(frame, m);
      if (how.axes == expressed_in::world)
        rotate_motion(m, [&](vec3<T> &x) KSL_INLINED { algebra<T>::product_drv(&frame.R, &x, &x); });
    }
    write(k, m);
  }
}

/// Twists of n links' frames into out (n, 6) for q (nq) and v (nv).  O(bodies that carry the links).
template <class T>
void frame_velocities(const model_view<scalar_of<T>> &model, const frame_velocities_workspace<T> &w, const T *q,
                      const T *v, int n, const int *links, const frame_options &how, T *out) {
  const body_list list = list_supports(model, w, n, links);
  sines_and_cosines_of_links(model, w.pose, q, n, links);
  w.twist[0] = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  move_bodies(model, w.pose, w.in_world, w.twist, q, list, !in_own_frame(how),
              [&]<joint_kind K>(const body<scalar_of<T>> &b, screw<T> &twist) KSL_INLINED {
                const screw<T> own = joint<K>::twist(b, v + b.v_index);
                algebra<T>::xpy_ss(&own, &twist);
              });
  express_motions(model, w.in_world, w.twist, n, links, how,
                  [&](int k, const screw<T> &s) KSL_INLINED { write_motion(s, how, out + 6 * k); });
}

/// How many times ω × v is subtracted from the classical acceleration: once for the spatial one; for the rate of the twist's numbers
/// once if the origin is at rest, and once more if the axes are the frame's own.
constexpr int times_turning(const frame_options &how) {
  if (how.kind != acceleration_kind::rate)
    return how.kind == acceleration_kind::spatial ? 1 : 0;
  return (how.at == expressed_in::world ? 1 : 0) + (how.axes == expressed_in::frame ? 1 : 0);
}

/// Accelerations of n links' frames into out (n, 6) for q (nq), v (nv) and dv (nv), without gravity: of the kind that the
/// options say.  O(bodies that carry the links).
template <class T>
void frame_accelerations(const model_view<scalar_of<T>> &model, const frame_accelerations_workspace<T> &w, const T *q,
                         const T *v, const T *dv, int n, const int *links, const frame_options &how, T *out) {
  const vec3<T> none = {T(0), T(0), T(0)};
  const body_list list = list_supports(model, w, n, links);
  sines_and_cosines_of_links(model, w.pose, q, n, links);
  w.motion[0] = {{none, none, none}, none};
  move_bodies(model, w.pose, w.in_world, w.motion, q, list, !in_own_frame(how),
              [&]<joint_kind K>(const body<scalar_of<T>> &b, frame_motion<T> &m) KSL_INLINED {
                const screw<T> own = joint<K>::twist(b, v + b.v_index);
                algebra<T>::xpy_vv(&own.lin, &m.velocity);
                joint<K>::add_motion(b, v + b.v_index, dv + b.v_index, m.body);
              });
  express_motions(model, w.in_world, w.motion, n, links, how, [&](int k, const frame_motion<T> &m) KSL_INLINED {
    vec3<T> a = m.body.acceleration, turning;
    algebra<T>::cross_vv(&m.body.angular_velocity, &m.velocity, &turning);
    algebra<T>::axpy_vv(T(static_cast<scalar_of<T>>(-times_turning(how))), &turning, &a);
    write_motion({a, m.body.angular_acceleration}, how, out + 6 * k);
  });
}

/// Velocity (3) of the point of a link at the options' offset, for q (nq) and v (nv); in the link's axes or the world's.
template <class T> void point_velocity(const model_view<scalar_of<T>> &model, const frame_velocities_workspace<T> &w,
                                       const T *q, const T *v, int link, frame_options how, T *out) {
  T twist[6];
  how.at = expressed_in::frame, how.angular_first = false;
  frame_velocities(model, w, q, v, 1, &link, how, twist);
  for (int k = 0; k < 3; ++k)
    out[k] = twist[k];
}

/// Acceleration (3) of the point, for q (nq), v (nv) and dv (nv), without gravity.
template <class T>
void point_acceleration(const model_view<scalar_of<T>> &model, const frame_accelerations_workspace<T> &w, const T *q,
                        const T *v, const T *dv, int link, frame_options how, T *out) {
  T acceleration[6];
  how.at = expressed_in::frame, how.angular_first = false, how.kind = acceleration_kind::classical;
  frame_accelerations(model, w, q, v, dv, 1, &link, how, acceleration);
  for (int k = 0; k < 3; ++k)
    out[k] = acceleration[k];
}

} // namespace KSL_ISA
} // namespace ksl
