// KSL: forward kinematics: poses of bodies and of links' frames.
#pragma once

#include "ksl/engine/model/joints.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct forward_kinematics_workspace {
  pose_workspace<T> pose;
  array_of<SE3<T>> in_world; ///< pose of each body

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    in_world.lay_out(memory, model.bodies);
  }
};

/// The pose of body 0, the ground: the identity.
template <class T> KSL_LANES SE3<T> ground_pose(const model_view<scalar_of<T>> &model) {
  return spread<T>(model.body[0].placement);
}

/// Poses of all bodies in the world from their poses in their parents, which another algorithm has stored.
template <class T>
void compose_poses(const model_view<scalar_of<T>> &model, const pose_workspace<T> &kept,
                   const array_of<SE3<T>> &in_world) {
  in_world[0] = ground_pose<T>(model);
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind,
            [&]<joint_kind K>() KSL_INLINED { in_world[i] = composed(in_world[b.parent], joint<K>::kept_pose(b, kept)); });
  }
}

/// Poses of all bodies, in their parents and in the world, for q (nq).  Featherstone, RBDA (2008), table 4.1, lines 1–6.
template <class T>
void forward_kinematics(const model_view<scalar_of<T>> &model, const forward_kinematics_workspace<T> &w, const T *q) {
  sines_and_cosines(model, w.pose, q);
  SE3<T> last = ground_pose<T>(model); // of body i − 1, usually the parent
  w.in_world[0] = last;
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    if (only_turns(b.kind)) {
      if (b.parent != i - 1)
        last = w.in_world[b.parent];
      last = composed(last, joint<turning_kind>::computed_pose(b, w.pose, q));
      w.in_world[i] = last;
    } else { // reloaded from memory afterwards, which leaves more registers to the fast path
      by_slower_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
        w.in_world[i] = composed(w.in_world[b.parent], joint<K>::computed_pose(b, w.pose, q));
      });
      last = w.in_world[i];
    }
  }
}

/// Pose of a link's frame in the world.
template <class T>
inline SE3<T> link_pose(const model_view<scalar_of<T>> &model, const array_of<SE3<T>> &in_world, int link) {
  const ksl::link<scalar_of<T>> &l = model.link[link];
  const SE3<T> in_body = spread<T>(l.pose);
  SE3<T> D;
  algebra<T>::product_dd(&in_world[l.body], &in_body, &D);
  return D;
}

/// Writes a pose as a 4 × 4 matrix, row-major.
template <class T> KSL_LANES void write_matrix(const SE3<T> &D, T *out) {
  const mat3x3<T> &R = D.R;
  const T zero = T(0), one = T(1);
  out[0] = R.m00, out[1] = R.m01, out[2] = R.m02, out[3] = D.t.x;
  out[4] = R.m10, out[5] = R.m11, out[6] = R.m12, out[7] = D.t.y;
  out[8] = R.m20, out[9] = R.m21, out[10] = R.m22, out[11] = D.t.z;
  out[12] = out[13] = out[14] = zero, out[15] = one;
}

/// Poses of n links in the world into out (n, 4, 4), each row-major, for q (nq).
template <class T>
void frame_poses(const model_view<scalar_of<T>> &model, const forward_kinematics_workspace<T> &w, const T *q, int n,
                 const int *links, T *out) {
  forward_kinematics(model, w, q);
  for (int k = 0; k < n; ++k)
    write_matrix(link_pose(model, w.in_world, links[k]), out + 16 * k);
}

} // namespace KSL_ISA
} // namespace ksl
