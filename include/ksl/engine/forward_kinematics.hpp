// KSL: where every body and every frame is.
#pragma once

#include "ksl/engine/joint_motion.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Poses of all bodies in the world from those in their parents.
template <class T> void compose_poses(const model_view<scalar_of<T>> &model, const data_view<T> &data) {
  data.in_world[0] = spread<T>(model.body[0].placement);
  for (int i = 1; i < model.bodies; ++i)
    by_kind(model.body[i].kind, [&]<joint_kind K>() KSL_INLINED {
      const auto D = pose_in_parent<K, T>::kept(model.body[i], data, i);
      data.in_world[i] = composed(data.in_world[model.body[i].parent], D);
    });
}

/// Poses of all bodies, in their parents and in the world, for q (nq).  Featherstone, RBDA (2008), table 4.1, lines 1–6.
template <class T> void forward_kinematics(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q) {
  sines_and_cosines(model, data, q);
  SE3<T> last = spread<T>(model.body[0].placement); // of body i − 1, mostly the parent
  data.in_world[0] = last;
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    if (turns(b.kind)) {
      if (b.parent != i - 1)
        last = data.in_world[b.parent];
      last = composed(last, pose_in_parent<joint_kind::revolute, T>::at(b, data, i, q));
      data.in_world[i] = last;
    } else { // through memory, so that the way above has its registers
      by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
        const auto D = pose_in_parent<K, T>::at(b, data, i, q);
        data.in_world[i] = composed(data.in_world[b.parent], D);
      });
      last = data.in_world[i];
    }
  }
}

/// Pose of a link's frame in the world; after compose_poses.
template <class T> inline SE3<T> link_pose(const model_view<scalar_of<T>> &model, const data_view<T> &data, int link) {
  const ksl::link<scalar_of<T>> &l = model.link[link];
  const SE3<T> in_body = spread<T>(l.pose);
  SE3<T> D;
  algebra<T>::product_dd(&data.in_world[l.body], &in_body, &D);
  return D;
}

/// A pose as the matrix that users see: 4 × 4, row-major.
template <class T> KSL_LANES void write_matrix(const SE3<T> &D, T *out) {
  const mat3x3<T> &R = D.R;
  const T zero = T(0), one = T(1);
  out[0] = R.m00, out[1] = R.m01, out[2] = R.m02, out[3] = D.t.x;
  out[4] = R.m10, out[5] = R.m11, out[6] = R.m12, out[7] = D.t.y;
  out[8] = R.m20, out[9] = R.m21, out[10] = R.m22, out[11] = D.t.z;
  out[12] = out[13] = out[14] = zero, out[15] = one;
}

/// Poses of n links' frames in the world into out (n, 4, 4), for q (nq).
template <class T>
void frame_poses(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, int n, const int *links, T *out) {
  forward_kinematics(model, data, q);
  for (int i = 0; i < n; ++i)
    write_matrix(link_pose(model, data, links[i]), out + 16 * i);
}

} // namespace KSL_ISA
} // namespace ksl
