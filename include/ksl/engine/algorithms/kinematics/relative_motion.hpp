// KSL: pose, velocity and Jacobian of a link's frame as seen from the frame of another link.
//
// Only the joints between the two links enter: those from either link to the body that carries both.
#pragma once

#include "ksl/engine/algorithms/kinematics/frame_motion.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct relative_pose_workspace {
  pose_workspace<T> pose;

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) { pose.lay_out(memory, model); }
};
template <class T> using relative_velocity_workspace = relative_pose_workspace<T>;
template <class T> using relative_jacobian_workspace = relative_pose_workspace<T>;

/// The last body that carries both links: bodies are in topological order.
template <class S> int common_support(const model_view<S> &model, int link, int other) {
  int i = model.link[link].body, j = model.link[other].body;
  while (i != j)
    (i > j ? i : j) = model.body[i > j ? i : j].parent;
  return i;
}

/// Walks from both links to the body that carries both.  of_link is called for the bodies between `link` and that body, with their
/// poses in the frame of `link`, as by walk_supports; of_other likewise for the other link, in its frame.  Returns the pose of the
/// other frame in the first one.
template <class T, class OfLink, class OfOther>
KSL_LANES SE3<T> walk_between(const model_view<scalar_of<T>> &model, const pose_workspace<T> &w, const T *q, int link,
                              int other, int common, const frame_options &how, OfLink of_link, OfOther of_other) {
  sines_and_cosines_of_supports(model, w, q, model.link[link].body, common);
  sines_and_cosines_of_supports(model, w, q, model.link[other].body, common);
  const SE3<T> in_link =
      walk_supports(model, w, q, body_in_frame<T>(model, link, how), model.link[link].body, common, of_link);
  const SE3<T> in_other =
      walk_supports(model, w, q, body_in_frame<T>(model, other, {}), model.link[other].body, common, of_other);
  SE3<T> D;
  algebra<T>::product_ddinv(&in_link, &in_other, &D);
  return D;
}

/// The pose of a link's frame as seen from another link's, as a matrix (4, 4), row-major, for q (nq).  O(joints between).
template <class T> void relative_pose(const model_view<scalar_of<T>> &model, const relative_pose_workspace<T> &w,
                                      const T *q, int link, int seen_from, const frame_options &how, T *out) {
  const auto nothing = []<joint_kind>(int, const SE3<T> &) KSL_INLINED {};
  SE3<T> D =
      walk_between(model, w.pose, q, link, seen_from, common_support(model, link, seen_from), how, nothing, nothing);
  algebra<T>::SE3_inverted(&D, &D);
  write_matrix(D, out);
}

/// The twist (6) of a link's frame relative to another link's, m/s and rad/s, for q (nq) and v (nv).  The other frame takes the place of
/// the world in the options.  O(joints between).
template <class T>
void relative_velocity(const model_view<scalar_of<T>> &model, const relative_velocity_workspace<T> &w, const T *q,
                       const T *v, int link, int seen_from, const frame_options &how, T *out) {
  using A = algebra<T>;
  const screw<T> none = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  screw<T> of_link = none, of_other = none;
  const auto add_to = [&](screw<T> &twist) KSL_INLINED {
    return [&]<joint_kind K>(int i, const SE3<T> &D) KSL_INLINED {
      const body<scalar_of<T>> &b = model.body[i];
      for_coordinates<K>(b, [&](auto k) KSL_INLINED {
        const screw<T> s = column_in<K>(k, b, D);
        A::axpy_ss(v[b.v_index + k], &s, &twist);
      });
    };
  };
  const int common = common_support(model, link, seen_from);
  const SE3<T> other = walk_between(model, w.pose, q, link, seen_from, common, how, add_to(of_link), add_to(of_other));
  A::product_Ads(&other, &of_other, &of_other);
  A::nxpy_ss(&of_other, &of_link);
  const SE3<T> D = pose_in_options(other, how);
  if (!in_own_frame(how))
    A::product_Ads(&D, &of_link, &of_link);
  write_motion(of_link, how, out);
}

/// J (6, nv), row-major, such that J v is relative_velocity.  Columns of joints that don't lie between the links are zero.
template <class T>
void relative_jacobian(const model_view<scalar_of<T>> &model, const relative_jacobian_workspace<T> &w, const T *q,
                       int link, int seen_from, const frame_options &how, T *J) {
  using A = algebra<T>;
  const twist_columns<T> columns = {J, model.nv, how.angular_first};
  columns.clear();
  const auto set = [&]<joint_kind K>(int i, const SE3<T> &D) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    for_coordinates<K>(b, [&](auto k) KSL_INLINED { columns.set(b.v_index + k, column_in<K>(k, b, D)); });
  };
  const int common = common_support(model, link, seen_from);
  SE3<T> other = walk_between(model, w.pose, q, link, seen_from, common, how, set, set);
  const SE3<T> D = pose_in_options(other, how);
  A::product_dd(&D, &other, &other);
  // subtrees are contiguous in v, so that the columns of the two paths lie apart
  const auto carry = [&](int of, const SE3<T> &pose, bool negative) KSL_INLINED {
    int first = model.link[of].body;
    const int end = end_in_v(model.body[first]);
    if (first == common)
      return;
    while (model.body[first].parent != common)
      first = model.body[first].parent;
    for_columns<T>(model.body[first].v_index, end, [&]<class P>(columns_at<P> k) KSL_INLINED {
      const SE3<P> carrying = in_lanes<P>(pose);
      screw<P> s = columns.get(k);
      algebra<P>::product_Ads(&carrying, &s, &s);
      if (negative)
        algebra<P>::screw_invert(&s);
      columns.set(k, without_negative_zeros(s));
    });
  };
  carry(seen_from, other, true);
  if (!in_own_frame(how))
    carry(link, D, false);
}

} // namespace KSL_ISA
} // namespace ksl
