// KSL: how bodies lie in their parents: by turns about coordinate axes, so that a vector goes from one to the other for 12
// flops and nothing is stored but sines and cosines.  Denavit and Hartenberg (1955); docs/decisions/0007-turns.md.
#pragma once

#include "ksl/engine/data.hpp"
#include "ksl/engine/sine_cosine.hpp"
#include "ksl/engine/spread.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Sines and cosines of all joint angles, from the canonical axis on (body.after): data.sine, data.cosine.
template <class T> void sines_and_cosines(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q) {
  for (int i = 1; i < model.bodies; ++i)
    if (turns(model.body[i].kind)) {
      const int k = model.body[i].q_index;
      plane_turn<T> a;
      sine_cosine(q[k], a.sine, a.cosine);
      a = product(a, spread<T>(model.body[i].after));
      data.sine[k] = a.sine, data.cosine[k] = a.cosine;
    }
}

/// The same for plain doubles, with the joints in the lanes; of numbers that are no angles, too, which costs less than
/// choosing.
template <>
inline void sines_and_cosines<double>(const model_view<double> &model, const data_view<double> &data, const double *q) {
  using P = native_pack<double>;
  for (int i = model.first_angle; i < model.angles_end; i += native_lanes<double>) {
    plane_turn<P> a, after;
    __builtin_memcpy(&after.sine, model.after_sine + i, sizeof(P));
    __builtin_memcpy(&after.cosine, model.after_cosine + i, sizeof(P));
    sine_cosine(load_first(q + i, model.nq - i), a.sine, a.cosine);
    a = product(a, after);
    __builtin_memcpy(data.sine + i, &a.sine, sizeof(P));
    __builtin_memcpy(data.cosine + i, &a.cosine, sizeof(P));
  }
}

/// The rotation of a quaternion [x y z w]; it need not be of unit length.
template <class T> inline mat3x3<T> rotation_of(const T q[4]) {
  const T x = q[0], y = q[1], z = q[2], w = q[3], one = T(1);
  const T s = T(2) / (x * x + y * y + z * z + w * w);
  return {one - s * (y * y + z * z), s * (x * y + z * w),       s * (x * z - y * w),
          s * (x * y - z * w),       one - s * (x * x + z * z), s * (y * z + x * w),
          s * (x * z + y * w),       s * (y * z - x * w),       one - s * (x * x + y * y)};
}

/// The last of the turns from a parent's axes to those of a body whose joint has an axis; after sines_and_cosines.
template <joint_kind K, class T> KSL_LANES plane_turn<T> last_turn(const body<scalar_of<T>> &b, const data_view<T> &data) {
  if constexpr (K == joint_kind::revolute)
    return {data.sine[b.q_index], data.cosine[b.q_index]};
  else
    return spread<T>(b.after);
}

/// The inertia of a body in other axes, about the same origin.  90 flops.
template <class T> KSL_LANES spatial_inertia<T> turned(const spatial_inertia<T> &I, const mat3x3<T> &R) {
  using A = algebra<T>;
  mat3x3<T> J;
  vec3<T> h;
  A::spatial_inertia_getMatrix(&I, &J);
  A::product_drSdrinv(&R, &J, &J);
  A::product_drv(&R, &I.h, &h);
  return {I.m, h, J.m00, J.m11, J.m22, J.m10, J.m21, J.m20};
}

template <class T> KSL_LANES void turn(const mat3x3<T> &R, vec3<T> &v) { algebra<T>::product_drv(&R, &v, &v); }
template <class T> KSL_LANES void turn(const mat3x3<T> &R, spatial_inertia<T> &I) { I = turned(I, R); }

/// How a body lies in its parent, as turns where its joint has an axis: 12 flops turn a vector, and nothing is stored but
/// what the joint moves (data.in_parent).
template <joint_kind K, class T> struct pose_in_parent {
  using S = scalar_of<T>;
  const body<S> &b;
  plane_turn<T> last;
  vec3<T> t;

  /// At the joint position in q.
  KSL_LANES static pose_in_parent at(const body<S> &b, const data_view<T> &data, int i, const T *q) {
    pose_in_parent D = {b, last_turn<K>(b, data), spread<T>(b.placement.t)};
    if constexpr (K == joint_kind::prismatic) {
      const mat3x3<S> &R = b.placement.R;
      const vec3<T> z = {T(R.m02), T(R.m12), T(R.m22)};
      algebra<T>::axpy_vv(q[b.q_index], &z, &D.t);
      data.in_parent[i].t = D.t;
    }
    return D;
  }
  /// As `at` left it.
  KSL_LANES static pose_in_parent kept(const body<S> &b, const data_view<T> &data, int i) {
    return {b, last_turn<K>(b, data), K == joint_kind::prismatic ? data.in_parent[i].t : spread<T>(b.placement.t)};
  }

  /// From the parent's axes to the body's, and back.
  template <class... V> KSL_LANES void to_body(V &...v) const {
    const plane_turn<T> lean = spread<T>(b.lean);
    if (!b.straight)
      (turn_back_z(spread<T>(b.before), v), ...);
    (turn_back_x(lean, v), ...);
    (turn_back_z(last, v), ...);
  }
  template <class... V> KSL_LANES void to_parent(V &...v) const {
    const plane_turn<T> lean = spread<T>(b.lean);
    (turn_z(last, v), ...);
    (turn_x(lean, v), ...);
    if (!b.straight)
      (turn_z(spread<T>(b.before), v), ...);
  }
  /// The body's axes, from the parent's.  43 flops, of which three wait for each other.
  KSL_LANES void turn_axes(mat3x3<T> &R) const {
    using A = algebra<T>;
    vec3<T> x, y, z, u, v;
    const plane_turn<T> lean = spread<T>(b.lean);
    if (!b.straight) {
      T before[2] = {T(b.before.sine), T(b.before.cosine)};
      A::product_drdrz(&R, before, &R);
    }
    A::mat3x3_toVectors(&R, &x, &y, &z);
    lincomb(last.cosine, x, last.sine * lean.cosine, y, last.sine * lean.sine, z, u);
    lincomb(-last.sine, x, last.cosine * lean.cosine, y, last.cosine * lean.sine, z, v);
    A::product_av(lean.cosine, &z, &z);
    A::axpy_vv(-lean.sine, &y, &z);
    A::mat3x3_setFromVectors(&R, &u, &v, &z);
  }

private:
  KSL_LANES static void lincomb(const T &a, const vec3<T> &x, const T &b, const vec3<T> &y, const T &c, const vec3<T> &z,
                                vec3<T> &out) {
    out.x = a * x.x + (b * y.x + c * z.x);
    out.y = a * x.y + (b * y.y + c * z.y);
    out.z = a * x.z + (b * y.z + c * z.z);
  }
};

template <class T> struct pose_in_parent<joint_kind::floating, T> {
  using S = scalar_of<T>;
  mat3x3<T> R;
  vec3<T> t;

  KSL_LANES static pose_in_parent at(const body<S> &b, const data_view<T> &data, int i, const T *q) {
    const T *const p = q + b.q_index;
    const SE3<T> placement = spread<T>(b.placement);
    SE3<T> D = {rotation_of(p + 3), {p[0], p[1], p[2]}};
    algebra<T>::product_dd(&placement, &D, &D);
    data.in_parent[i] = D;
    return {D.R, D.t};
  }
  KSL_LANES static pose_in_parent kept(const body<S> &, const data_view<T> &data, int i) {
    return {data.in_parent[i].R, data.in_parent[i].t};
  }
  template <class... V> KSL_LANES void to_body(V &...v) const { (algebra<T>::product_drinvv(&R, &v, &v), ...); }
  template <class... V> KSL_LANES void to_parent(V &...v) const { (turn(R, v), ...); }
  KSL_LANES void turn_axes(mat3x3<T> &parent) const { algebra<T>::product_drdr(&parent, &R, &parent); }
};

/// The pose of a body, from that of its parent, in whatever both are seen.
template <joint_kind K, class T> KSL_LANES SE3<T> composed(const SE3<T> &parent, const pose_in_parent<K, T> &D) {
  SE3<T> pose = parent;
  algebra<T>::product_dv(&parent, &D.t, &pose.t);
  D.turn_axes(pose.R);
  return pose;
}

} // namespace KSL_ISA
} // namespace ksl
