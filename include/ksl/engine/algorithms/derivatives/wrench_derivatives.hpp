// KSL: how the wrenches through the joints change with positions, velocities and accelerations.
//
// Singh, Russell, Wensing, "Efficient Analytical Derivatives of Rigid-Body Dynamics Using Spatial Vector Algebra", IEEE
// Robotics and Automation Letters 7(2), 2022, from the motions of coordinate_motions.hpp.  In their common axes and about their
// common point, quantities of subtrees are sums over their bodies.
//
// The wrench that gives a body its motion is f = I a + v ×* I v.  If, seen from the body, v changes by x and a by y − v × x, then f
// changes by
//
//     2 B x + I y,   2 B = v ×* I − I v × + (I v) ×̄*,   where h ×̄* x = x ×* h.                                   (1)
//
// B is linear in I and in v.  2 B x is the Coriolis force of an additional rotation x.ang: each particle m at r with velocity ṙ
// contributes the force 2 m x.ang × ṙ at r.  Therefore the linear half of x has no part in it, and
//
//     2 B x = (x.ang × twice_p, K x.ang),   twice_p = 2 Σ m ṙ,   K = 2 Σ m ((r · ṙ) 1 − ṙ rᵀ).                   (2)
//
// All bodies beyond a joint see the same x and y of each of its coordinates.  With I, B and f summed over the joint's subtree, the
// wrench f through the joint changes with a coordinate of that joint
//
//     by q:  2 B Ψ̇ + I Ψ̈ + S ×* f,      by v:  2 B S + I (Ψ̇ + Ṡ),      by a:  I S.                              (3)
//
// S ×* f is the wrench turned with the bodies, which a position displaces.
#pragma once

#include "ksl/engine/algorithms/derivatives/coordinate_motions.hpp"
#include "ksl/engine/steps/external_wrenches.hpp"
#include "ksl/engine/steps/newton_euler.hpp"

namespace ksl {

/// I, 2 B and f of a body, or their sums over the bodies of a subtree.  2 B is given by K and twice_p (2).
template <class T> struct subtree_dynamics {
  spatial_inertia<T> I;
  mat3x3<T> K;
  vec3<T> twice_p;
  coscrew<T> f; ///< the wrench that the motion needs, less external wrenches
};

/// How the wrench through the joint of a coordinate changes with the coordinate: (3).
template <class T> struct wrench_derivative {
  coscrew<T> by_q; ///< 2 B Ψ̇ + I Ψ̈ + S ×* f
  coscrew<T> by_v; ///< 2 B S + I (Ψ̇ + Ṡ)
  coscrew<T> by_a; ///< I S, the momentum at unit velocity
  vec3<T> turn;    ///< the angular half of 2 Bᵀ S; the linear half is zero, by (2)
};

inline namespace KSL_ISA {

template <class T> struct wrench_derivatives_workspace : coordinate_motions_workspace<T> {
  /// at first of each body, at its joint's last coordinate; then of its subtree, at
  /// all coordinates of its joint
  per_coordinate<subtree_dynamics, T> subtree;
  per_coordinate<wrench_derivative, T> derivative;

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    coordinate_motions_workspace<T>::lay_out(memory, model);
    memory.lay_out(model.nv, subtree, derivative);
  }
};

/// The last coordinate of body i.  The ground has none: for it this is the index before the first coordinate, which is reserved
/// (per_coordinate.hpp).
template <class S> KSL_LANES int last_coordinate(const model_view<S> &model, int i) {
  const body<S> &b = model.body[i > 0 || model.bodies == 1 ? i : 1];
  return b.v_index + b.nv - (i > 0 ? 1 : 2);
}

/// K (2) of a body with the inertia I, about the common point, and the twist (v, ω).
template <class T> KSL_LANES mat3x3<T> moment_of_momentum(const spatial_inertia<T> &I, const screw<T> &twist) {
  const vec3<T> &v = twist.lin, &w = twist.ang;
  // ṙ = v + ω × r.  So Q = Σ m ṙ rᵀ = v hᵀ + ω̃ E with E = Σ m r rᵀ = ½ tr(I) 1 − I.  All is multiplied by −2: K holds −2 Q first.
  const T two = T(2), xx = I.Ixx - I.Iyy - I.Izz, yy = I.Iyy - I.Izz - I.Ixx, zz = I.Izz - I.Ixx - I.Iyy; // −2 E
  const T xy = two * I.Ixy, yz = two * I.Iyz, zx = two * I.Izx;
  const vec3<T> h = {-two * I.h.x, -two * I.h.y, -two * I.h.z};
  mat3x3<T> K;
  K.m00 = v.x * h.x + (w.y * zx - w.z * xy);
  K.m10 = v.y * h.x + (w.z * xx - w.x * zx);
  K.m20 = v.z * h.x + (w.x * xy - w.y * xx);
  K.m01 = v.x * h.y + (w.y * yz - w.z * yy);
  K.m11 = v.y * h.y + (w.z * xy - w.x * yz);
  K.m21 = v.z * h.y + (w.x * yy - w.y * xy);
  K.m02 = v.x * h.z + (w.y * zz - w.z * yz);
  K.m12 = v.y * h.z + (w.z * zx - w.x * zz);
  K.m22 = v.z * h.z + (w.x * yz - w.y * zx);
  const T x = K.m00, y = K.m11, z = K.m22; // K = 2 (tr(Q) 1 − Q), since tr(Q) = Σ m r · ṙ
  K.m00 = -(y + z), K.m11 = -(z + x), K.m22 = -(x + y);
  return K;
}

/// Sets I, 2 B and f of one body with the motion m.  `own` is its inertia in its own frame, whose axes are R and whose origin is `origin`.
template <bool in_memory, class T>
KSL_LANES void set_body_dynamics(const spatial_inertia<T> &own, const mat3x3<T> &R, const vec3<T> &origin,
                                 const body_twist<T> &m, subtree_dynamics<T> &d) {
  using A = algebra<T>;
  const spatial_inertia<T> turned = rotated(own, R);
  A::spatial_inertia_translated(&turned, &origin, &d.I);
  read_again<in_memory>();
  const spatial_inertia<T> &I = d.I;
  const vec3<T> &v = m.velocity.lin, &w = m.velocity.ang;

  vec3<T> p;
  A::cross_vv(&w, &I.h, &p);
  A::axpy_vv(I.m, &v, &p);
  A::add_vv(&p, &p, &d.twice_p); // p = m v + ω × h

  d.K = moment_of_momentum(I, m.velocity);
  read_again<in_memory>();

  body_motion<T> at_point = {
      w, m.acceleration.ang, {}}; // of the body's point at the common point; classical: a.lin + ω × v
  A::cross_vv(&w, &v, &at_point.acceleration);
  A::xpy_vv(&m.acceleration.lin, &at_point.acceleration);
  d.f = newton_euler(I, at_point);
}
template <class T> KSL_LANES subtree_dynamics<T> body_dynamics(const spatial_inertia<T> &own, const mat3x3<T> &R,
                                                               const vec3<T> &origin, const body_twist<T> &m) {
  subtree_dynamics<T> d;
  set_body_dynamics<false>(own, R, origin, m, d);
  return d;
}

/// 2 B x + I y (1); x is the angular half, which is all that counts.
template <class T> KSL_LANES coscrew<T> wrench_change(const subtree_dynamics<T> &d, const vec3<T> &x,
                                                      const screw<T> &y) {
  using A = algebra<T>;
  coscrew<T> change;
  vec3<T> lin, ang;
  A::product_Ms(&d.I, &y, &change);
  A::cross_vv(&x, &d.twice_p, &lin);
  A::product_drv(&d.K, &x, &ang);
  A::xpy_vv(&lin, &change.lin);
  A::xpy_vv(&ang, &change.ang);
  return change;
}

/// How the wrench through a joint changes with one of its coordinates (3).  d is the sum over the joint's subtree; by_a, which is I S, is
/// set already.
template <bool in_memory = true, class T>
KSL_LANES void set_derivative(const subtree_dynamics<T> &d, const coordinate_motion<T> &c, wrench_derivative<T> &out) {
  using A = algebra<T>;
  coscrew<T> carried;
  vec3<T> turn;
  out.by_q = wrench_change(d, c.velocity_by_q.ang, c.acceleration_by_q);
  read_again<in_memory>();
  A::cross_sc(&c.S, &d.f, &carried); // S ×* f
  A::xpy_cc(&carried, &out.by_q);
  read_again<in_memory>();
  out.by_v = wrench_change(d, c.S.ang, c.acceleration_by_v);
  read_again<in_memory>();
  A::cross_vv(&d.twice_p, &c.S.lin, &out.turn); // 2 Bᵀ S = (0, twice_p × S.lin + Kᵀ S.ang)
  A::product_drinvv(&d.K, &c.S.ang, &turn);
  A::xpy_vv(&turn, &out.turn);
}
template <class T>
KSL_LANES wrench_derivative<T> derivative_of(const subtree_dynamics<T> &d, const coordinate_motion<T> &c,
                                             const coscrew<T> &by_a) {
  wrench_derivative<T> out;
  out.by_a = by_a;
  set_derivative<false>(d, c, out);
  return out;
}
template <class T> KSL_LANES wrench_derivative<T> derivative_of(const subtree_dynamics<T> &d,
                                                                const coordinate_motion<T> &c) {
  coscrew<T> by_a;
  algebra<T>::product_Ms(&d.I, &c.S, &by_a);
  return derivative_of(d, c, by_a);
}

/// Stores d, the dynamics of the bodies in lanes, each at the last coordinate of its joint.
template <class P, class T>
KSL_LANES void set_bodies(const model_view<scalar_of<T>> &model, const per_coordinate<subtree_dynamics, T> &subtree,
                          bodies_at<P, T> k, const subtree_dynamics<P> &d) {
  constexpr int lanes = static_cast<int>(sizeof(P) / sizeof(T)), numbers = per_coordinate<subtree_dynamics, T>::numbers;
  const int first = last_coordinate(model, k.i);
  if constexpr (lanes == 1) {
    if (k.i > 0)
      subtree.set(first, d);
  } else {
    const int last = k.i + lanes < model.bodies ? k.i + lanes - 1 : model.bodies - 1;
    if (last_coordinate(model, last) - first == last - k.i)
      return subtree.set(first,
                         d); // each has one coordinate; lanes beyond the last body are overwritten later, or unused
    for (int i = k.i; i <= last; ++i)
      for (int c = 0; c < numbers; ++c)
        if (i > 0)
          subtree.number(last_coordinate(model, i), c) =
              reinterpret_cast<const T *>(reinterpret_cast<const P *>(&d) + c)[i - k.i];
  }
}

/// External wrench e, in common axes and about the common point.
template <class T>
inline coscrew<T> external_in_common_axes(const model_view<scalar_of<T>> &model,
                                          const wrench_derivatives_workspace<T> &w,
                                          const external_wrenches<T> &external, int e) {
  const int i = model.link[external.link[e]].body;
  const SE3<T> D = {w.rotation[i], w.origin[i]};
  coscrew<T> f = external_in_body(model, w.pose, external, e);
  algebra<T>::product_CoAdc(&D, &f, &f);
  return f;
}

/// Sets the motions of all bodies and coordinates, and the dynamics of each body by itself.  `ground` is the acceleration of the
/// ground.
template <class T>
KSL_LANES void forward_motions(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &w,
                               const vec3<T> &ground, const T *q, const T *v, const T *a,
                               const external_wrenches<T> &external) {
  w.derivative.clear_beyond(model.nv);
  coordinate_motions(model, w, ground, q, v, a, [&](auto k) KSL_INLINED {
    if constexpr (is_number<T>) {
      set_bodies(model, w.subtree, k, body_dynamics(own_inertia(model, k), w.rotation[k], w.origin[k], w.motion[k]));
    } else {
      read_again();
      set_body_dynamics<true>(own_inertia(model, k), w.rotation.at(k.i), w.origin.at(k.i), w.motion.at(k.i),
                              w.subtree.at(last_coordinate(model, k.i)));
    }
  });
  for (int e = 0; e < external.n; ++e) {
    const int i = model.link[external.link[e]].body;
    if (i == 0)
      continue;
    const int k = last_coordinate(model, i);
    const coscrew<T> f = external_in_common_axes(model, w, external, e);
    coscrew<T> rest = w.subtree.template part<coscrew, T, 22>(k);
    algebra<T>::nxpy_cc(&f, &rest);
    w.subtree.template set_part<coscrew, T, 22>(k, rest);
  }
}

/// The motions with gravity: the ground accelerates upwards.
template <class T>
KSL_LANES void forward_motions(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &w,
                               const T *q, const T *v, const T *a, const external_wrenches<T> &external) {
  forward_motions(model, w, ground_motion<T>(model).acceleration, q, v, a, external);
}

/// Writes n numbers to all lanes of P; unrolled, as body_lanes::read_all.
template <int n, class T, class P> KSL_LANES void spread_all(const T *from, P *to) {
  if constexpr (n > 0) {
    spread_all<n - 1>(from, to);
    to[n - 1] = P(from[n - 1]);
  }
}
template <class P, template <class> class V, class T> KSL_LANES V<P> in_all_lanes(const V<T> &v) {
  V<P> out;
  spread_all<numbers_in<V<T>, T>>(reinterpret_cast<const T *>(&v), reinterpret_cast<P *>(&out));
  return out;
}

/// sum += d
template <class T> KSL_LANES void add_dynamics(const subtree_dynamics<T> &d, subtree_dynamics<T> &sum) {
  for (int c = 0; c < numbers_in<subtree_dynamics<T>, T>; ++c) {
    T &x = reinterpret_cast<T *>(&sum)[c];
    x = x + reinterpret_cast<const T *>(&d)[c];
  }
}

/// Sums the dynamics of subtrees, from the leaves to the root, and sets the derivatives (3) of the wrenches through the joints.
/// `derivatives` is false where only the sums are needed.  These are then stored at all coordinates of a joint if T is a plain number,
/// and at the last one for other scalars.
template <bool derivatives = true, class T>
KSL_LANES void sum_subtrees(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &w) {
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    const int last = b.v_index + b.nv - 1, parent = last_coordinate(model, b.parent);
    if constexpr (is_number<T>) {
      const subtree_dynamics<T> d = w.subtree.get(last);
      for (int k = b.v_index; k < last; ++k)
        w.subtree.set(k, d);
      for (int c = 0; b.parent > 0 && c < numbers_in<subtree_dynamics<T>, T>; ++c) {
        T &sum = w.subtree.number(parent, c);
        sum = sum + reinterpret_cast<const T *>(&d)[c];
      }
    } else {
      const subtree_dynamics<T> &d = w.subtree.at(last);
      for (int k = b.v_index; derivatives && k <= last; ++k) {
        if (k < last)
          w.subtree.at(k) = d;
        w.derivative.set(k, derivative_of(d, w.coordinate.at(k)));
      }
      if (b.parent > 0)
        add_dynamics(d, w.subtree.at(parent));
    }
  }
  if constexpr (derivatives && is_number<T>)
    for (int k = 0; k < model.nv; k += native_lanes<T>) {
      using P = native_pack<T>;
      w.derivative.set(k, derivative_of(w.subtree.template get<P>(k), w.coordinate.template get<P>(k)));
    }
}

} // namespace KSL_ISA
} // namespace ksl
