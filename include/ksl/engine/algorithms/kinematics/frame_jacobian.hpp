// KSL: the Jacobian of a link's frame, which maps joint velocities to the frame's twist, and its rate.
//
// A walk over the link's supports (support_walk.hpp) gives the columns in the frame itself.  The adjoint of one pose, the same for all
// columns, then carries them to the axes and the origin that are asked for.
#pragma once

#include "ksl/engine/algorithms/kinematics/forward_kinematics.hpp"
#include "ksl/engine/steps/support_walk.hpp"
#include "ksl/engine/steps/twist_columns.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct jacobian_workspace {
  pose_workspace<T> pose;

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) { pose.lay_out(memory, model); }
};

template <class T> struct jacobian_rate_workspace {
  pose_workspace<T> pose;
  T *jacobian; ///< (6, nv), linear first

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    jacobian = memory.take<T>(6 * model.nv);
  }
};

/// The frame that a twist is expressed in, which gives origin and axes.
template <class T> inline SE3<T> frame_of_options(const SE3<T> &frame, const frame_options &how) {
  const T o = T(0), l = T(1);
  SE3<T> target = {{l, o, o, o, l, o, o, o, l}, {o, o, o}};
  if (how.axes == expressed_in::frame)
    target.R = frame.R;
  if (how.at == expressed_in::frame)
    target.t = frame.t;
  return target;
}

/// Is a motion expressed in the frame itself?
constexpr bool in_own_frame(const frame_options &how) {
  return how.axes == expressed_in::frame && how.at == expressed_in::frame;
}

/// The pose of a frame in the frame that its motion is expressed in, from the pose of the world in the frame.
template <class T> inline SE3<T> pose_in_options(const SE3<T> &world_in_frame, const frame_options &how) {
  SE3<T> frame, D;
  algebra<T>::SE3_inverted(&world_in_frame, &frame);
  const SE3<T> target = frame_of_options(frame, how);
  algebra<T>::product_dinvd(&target, &frame, &D);
  return D;
}

/// The index in v after the last number of body i's joint.
template <class S> constexpr int end_in_v(const body<S> &b) { return b.v_index + b.nv; }

/// A pose, in the numbers P.
template <class P, class T> KSL_LANES SE3<P> in_lanes(const SE3<T> &D) {
  if constexpr (is_number<T>)
    return spread<P>(D);
  else
    return D;
}
template <class P, class T> KSL_LANES screw<P> in_lanes(const screw<T> &s) {
  if constexpr (is_number<T>)
    return {spread<P>(s.lin), spread<P>(s.ang)};
  else
    return s;
}
/// Turns −0 into 0.
template <class P> KSL_LANES screw<P> without_negative_zeros(const screw<P> &s) {
  const P o = P(scalar_of<P>(0));
  return {{s.lin.x + o, s.lin.y + o, s.lin.z + o}, {s.ang.x + o, s.ang.y + o, s.ang.z + o}};
}

/// J (6, nv), row-major, of a link's frame for q (nq): J v is the frame's twist.  Columns of joints that don't move the link
/// are zero; the others are S, carried from their body by the adjoint.  Featherstone, RBDA (2008), eq. (4.14).
/// O(depth), besides writing 6 nv numbers.
template <class T>
void jacobian(const model_view<scalar_of<T>> &model, const jacobian_workspace<T> &w, const T *q, int link,
              const frame_options &how, T *J) {
  const twist_columns<T> columns = {J, model.nv, how.angular_first};
  const int last = model.link[link].body; // the body that the link belongs to
  columns.clear();
  sines_and_cosines_of_supports(model, w.pose, q, last);
  const SE3<T> world = walk_supports(
      model, w.pose, q, body_in_frame<T>(model, link, how), last, 0, [&]<joint_kind K>(int i, const SE3<T> &D) KSL_INLINED {
        const body<scalar_of<T>> &b = model.body[i];
        for_coordinates<K>(b, [&](auto k) KSL_INLINED { columns.set(b.v_index + k, column_in<K>(k, b, D)); });
      });
  if (in_own_frame(how))
    return;
  const SE3<T> D = pose_in_options(world, how);
  for_columns<T>(0, end_in_v(model.body[last]), [&]<class P>(columns_at<P> k) KSL_INLINED {
    const SE3<P> carrying = in_lanes<P>(D);
    screw<P> s = columns.get(k);
    algebra<P>::product_Ads(&carrying, &s, &s);
    columns.set(k, without_negative_zeros(s));
  });
}

/// The rates (6, nv) of the numbers of J, for q (nq) and v (nv): the rate of J v is J a + rate · v.
///
/// A column is the twist S, constant in its body.  Seen from the frame, its rate is v × S, where v is the twist of the body relative to
/// the frame: minus the sum of S q̇ over the joints between body and frame.  Featherstone, RBDA (2008), eqs. (2.45), (3.35).
template <class T>
void jacobian_rate(const model_view<scalar_of<T>> &model, const jacobian_rate_workspace<T> &w, const T *q, const T *v,
                   int link, const frame_options &how, T *rate) {
  using A = algebra<T>;
  const twist_columns<T> rates = {rate, model.nv, how.angular_first}, columns = {w.jacobian, model.nv, false};
  const int last = model.link[link].body;
  rates.clear(), columns.clear();
  sines_and_cosines_of_supports(model, w.pose, q, last);
  screw<T> twist = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}}; // of the frame relative to the body
  const SE3<T> world = walk_supports(model, w.pose, q, body_in_frame<T>(model, link, how), last, 0,
                                     [&]<joint_kind K>(int i, const SE3<T> &D) KSL_INLINED {
                                       const body<scalar_of<T>> &b = model.body[i];
                                       const screw<T> beyond = twist;
                                       for_coordinates<K>(b, [&](auto k) KSL_INLINED {
                                         screw<T> s = column_in<K>(k, b, D), ds;
                                         A::cross_ss(&s, &beyond, &ds);
                                         columns.set(b.v_index + k, s), rates.set(b.v_index + k, ds);
                                         A::axpy_ss(v[b.v_index + k], &s, &twist);
                                       });
                                     });
  if (in_own_frame(how))
    return;
  // other axes or another origin: they belong to a frame that moves relative to the link, by which the columns turn in addition
  const SE3<T> D = pose_in_options(world, how);
  A::product_Ads(&D, &twist, &twist);
  const vec3<T> none = {T(0), T(0), T(0)};
  if (how.at == expressed_in::frame)
    twist.lin = none; // the origin moves with the link
  if (how.axes == expressed_in::frame)
    twist.ang = none; // the axes do
  for_columns<T>(0, end_in_v(model.body[last]), [&]<class P>(columns_at<P> k) KSL_INLINED {
    const SE3<P> carrying = in_lanes<P>(D);
    const screw<P> beyond = in_lanes<P>(twist);
    screw<P> s = columns.get(k), ds = rates.get(k), turning;
    algebra<P>::product_Ads(&carrying, &s, &s);
    algebra<P>::product_Ads(&carrying, &ds, &ds);
    algebra<P>::cross_ss(&beyond, &s, &turning);
    algebra<P>::xpy_ss(&turning, &ds);
    rates.set(k, without_negative_zeros(ds));
  });
}

} // namespace KSL_ISA
} // namespace ksl
