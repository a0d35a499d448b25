// KSL: the bodies that carry a link, its supports, from the link to the ground.
//
// The motion of a single frame depends on its supports only.  A walk from the frame towards the ground computes the pose of each
// support, in the frame, from the pose of the body before.  So it needs no list of the supports.
#pragma once

#include "ksl/engine/model/joints.hpp"
#include "ksl/engine/steps/frame_options.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Computes the joint rotations about z of the bodies on the path from `first` to `last`, which carries `first` and is left out.
/// compute(angle, sine, cosine) is called for each.
template <class T, class Compute> KSL_LANES void rotations_of_supports(const model_view<scalar_of<T>> &model,
                                                                       const pose_workspace<T> &w, const T *q,
                                                                       int first, int last, Compute compute) {
  for (int i = first; i != last; i = model.body[i].parent) {
    const int k = model.body[i].angle_index;
    if (k < 0)
      continue;
    plane_rotation<T> a;
    compute(q[k], a.sine, a.cosine);
    a = product(a, spread<T>(model.body[i].theta0));
    w.sine[k] = a.sine, w.cosine[k] = a.cosine;
  }
}

/// Rotations for plain doubles, with joints in lanes.  A register ends with the next angle that isn't computed yet, since the angles of
/// supports descend in q.
template <class Compute> KSL_LANES void rotations_of_supports(const model_view<double> &model,
                                                              const pose_workspace<double> &w, const double *q,
                                                              int first, int last, Compute compute) {
  using P = native_pack<double>;
  constexpr int lanes = native_lanes<double>;
  int computed = model.nq; // angles from here on
  for (int i = first; i != last; i = model.body[i].parent) {
    const int k = model.body[i].angle_index;
    if (k < 0 || k >= computed)
      continue;
    computed = k < lanes - 1 ? 0 : k - (lanes - 1);
    plane_rotation<P> a, theta0;
    __builtin_memcpy(&theta0.sine, model.theta0_sine + computed, sizeof(P));
    __builtin_memcpy(&theta0.cosine, model.theta0_cosine + computed, sizeof(P));
    compute(load_first(q + computed, model.nq - computed), a.sine, a.cosine);
    a = product(a, theta0);
    __builtin_memcpy(w.sine + computed, &a.sine, sizeof(P));
    __builtin_memcpy(w.cosine + computed, &a.cosine, sizeof(P));
  }
}

/// sines_and_cosines for the bodies from `first` to `last`, which carries it and is left out.
template <class T> void sines_and_cosines_of_supports(const model_view<scalar_of<T>> &model, const pose_workspace<T> &w,
                                                      const T *q, int first, int last = 0) {
  const auto any = []<class P>(const P &x, P &sine, P &cosine) { sine_cosine(x, sine, cosine); };
  if constexpr (is_number<T> || is_pack<T>) {
    bool in_range = true;
    rotations_of_supports(model, w, q, first, last, [&]<class P>(const P &x, P &sine, P &cosine) KSL_INLINED {
      in_range &= magnitudes_at_most(x, trigonometry<scalar_of<P>>::fast_range);
      sine_cosine_in_fast_range(x, sine, cosine);
    });
    if (in_range) [[likely]]
      return;
  }
  rotations_of_supports(model, w, q, first, last, any);
}

/// The offset of the options, in any scalar.
template <class T> KSL_LANES vec3<T> offset_of(const frame_options &how) {
  using S = scalar_of<T>;
  return {T(static_cast<S>(how.offset[0])), T(static_cast<S>(how.offset[1])), T(static_cast<S>(how.offset[2]))};
}

/// The pose of a link's body in a frame of that link, `offset` from the link's origin.
template <class T> inline SE3<T> body_in_frame(const model_view<scalar_of<T>> &model, int link,
                                               const frame_options &how) {
  using A = algebra<T>;
  SE3<T> frame = spread<T>(model.link[link].pose), D;
  const vec3<T> offset = offset_of<T>(how);
  A::product_dv(&frame, &offset, &frame.t);
  A::SE3_inverted(&frame, &D);
  return D;
}

/// Walks from body `first` to body `last`, which carries `first`.  D is the pose of `first` in some frame.  step<K>(i, D) is called
/// for each body but the last, with its pose in that frame.  Returns the pose of the last.
template <class T, class Step>
KSL_LANES SE3<T> walk_supports(const model_view<scalar_of<T>> &model, const pose_workspace<T> &w, const T *q, SE3<T> D,
                               int first, int last, Step step) {
  for (int i = first; i != last;) {
    const body<scalar_of<T>> &b = model.body[i];
    if (only_turns(b.kind)) {
      step.template operator()<turning_kind>(i, D);
      D = composed_back(D, joint<turning_kind>::computed_pose(b, w, q));
    } else { // through memory, which leaves more registers to the fast path
      SE3<T> in_memory = D;
      by_slower_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
        step.template operator()<K>(i, in_memory);
        in_memory = composed_back(in_memory, joint<K>::computed_pose(b, w, q));
      });
      D = in_memory;
    }
    i = b.parent;
  }
  return D;
}

/// Column k of a joint's motion subspace, in the frame in which its body has the pose D.
template <joint_kind K, class Index, class T> KSL_LANES screw<T> column_in(Index k, const body<scalar_of<T>> &b,
                                                                           const SE3<T> &D) {
  return joint<K>::column(k, b, D.R).about(D.t);
}

} // namespace KSL_ISA
} // namespace ksl
