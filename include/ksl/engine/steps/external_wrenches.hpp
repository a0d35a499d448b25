// KSL: wrenches that the environment exerts on links.
#pragma once

#include "ksl/engine/model/joints.hpp"
#include "ksl/engine/steps/frame_options.hpp"

namespace ksl {

/// Linear first, at the link's origin; in the link's axes, or in those of the world.
template <class T> struct external_wrenches {
  int n = 0;
  const int *link = nullptr;               ///< (n)
  const T *wrench = nullptr;               ///< (n, 6)
  expressed_in axes = expressed_in::frame; ///< in derivatives by q, wrenches are held in these axes
};

inline namespace KSL_ISA {

/// The axes of body i in the world, from the poses of the bodies that carry it.
template <class T> inline mat3x3<T> axes_in_world(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                                                  int i) {
  const T o = T(0), l = T(1);
  vec3<T> x = {l, o, o}, y = {o, l, o}, z = {o, o, l};
  for (; i > 0; i = model.body[i].parent)
    by_kind(model.body[i].kind,
            [&]<joint_kind K>() KSL_INLINED { joint<K>::kept_pose(model.body[i], pose).to_parent(x, y, z); });
  mat3x3<T> R;
  R.m00 = x.x, R.m10 = x.y, R.m20 = x.z;
  R.m01 = y.x, R.m11 = y.y, R.m21 = y.z;
  R.m02 = z.x, R.m12 = z.y, R.m22 = z.z;
  return R;
}

/// External wrench k, about the origin of its body and in the body's axes; after the poses of the bodies are computed.
template <class T>
inline coscrew<T> external_in_body(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                                   const external_wrenches<T> &external, int k) {
  using A = algebra<T>;
  const T *e = external.wrench + 6 * k;
  const link<scalar_of<T>> &l = model.link[external.link[k]];
  SE3<T> in_body = spread<T>(l.pose);
  coscrew<T> f = {{e[0], e[1], e[2]}, {e[3], e[4], e[5]}};
  if (external.axes == expressed_in::world) {
    const mat3x3<T> R = axes_in_world(model, pose, l.body);
    A::product_CoAdrinvc(&R, &f, &f);
    A::product_CoAdtc(&in_body.t, &f, &f);
  } else {
    A::product_CoAdc(&in_body, &f, &f);
  }
  return f;
}

/// Adds a wrench to that of body i.
template <class T> KSL_LANES void add_wrench(const per_body<coscrew, T> &wrench, int i, const coscrew<T> &f) {
  coscrew<T> sum = wrench[i];
  algebra<T>::xpy_cc(&f, &sum);
  wrench.set(i, sum);
}

/// Subtracts external wrenches from the wrenches that the bodies' motions need.  express(body, wrench) converts each from the
/// body's axes to those of the algorithm.
template <class T, class Express>
KSL_LANES void subtract_external(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                                 const external_wrenches<T> &external, const per_body<coscrew, T> &wrench,
                                 Express express) {
  for (int k = 0; k < external.n; ++k) {
    const int i = model.link[external.link[k]].body;
    coscrew<T> f = external_in_body(model, pose, external, k), rest = wrench[i];
    express(i, f);
    algebra<T>::nxpy_cc(&f, &rest);
    wrench.set(i, rest);
  }
}

} // namespace KSL_ISA
} // namespace ksl
