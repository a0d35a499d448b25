// KSL: the Jacobian of a link's frame, which maps joint velocities to the frame's twist.
#pragma once

#include "ksl/engine/forward_kinematics.hpp"
#include "ksl/engine/frame_options.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> using jacobian_workspace = forward_kinematics_workspace<T>;

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

/// J (6, nv), row-major, of a link's frame for q (nq): J v is the frame's twist.  Columns of joints that don't move the link
/// are zero; the others are S, carried from their body by the adjoint.  Featherstone, RBDA (2008), eq. (4.14).
template <class T>
void jacobian(const model_view<scalar_of<T>> &model, const jacobian_workspace<T> &w, const T *q, int link,
              const frame_options &how, T *J) {
  forward_kinematics(model, w, q);
  const SE3<T> target = frame_of_options(link_pose(model, w.in_world, link), how);
  const int nv = model.nv, first = how.angular_first ? 3 : 0; // row of the linear part
  for (int i = 0; i < 6 * nv; ++i)
    J[i] = T(0);
  for (int i = model.link[link].body; i > 0; i = model.body[i].parent) {
    const body<scalar_of<T>> &b = model.body[i];
    SE3<T> D; // of the body in the target frame
    algebra<T>::product_dinvd(&target, &w.in_world[i], &D);
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      for_each_coordinate<joint<K>::nv>([&](auto k) KSL_INLINED {
        T rates[joint<K>::nv];
        for (int c = 0; c < joint<K>::nv; ++c)
          rates[c] = T(c == k ? 1 : 0);
        screw<T> s = joint<K>::twist(b, rates);
        algebra<T>::product_Ads(&D, &s, &s);
        T *const lin = J + first * nv + b.v_index + k, *const ang = J + (3 - first) * nv + b.v_index + k;
        lin[0] = s.lin.x, lin[nv] = s.lin.y, lin[2 * nv] = s.lin.z;
        ang[0] = s.ang.x, ang[nv] = s.ang.y, ang[2 * nv] = s.ang.z;
      });
    });
  }
}

} // namespace KSL_ISA
} // namespace ksl
