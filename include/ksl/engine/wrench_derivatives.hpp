// KSL: how the wrenches through the joints change with positions, velocities and accelerations.
//
// Singh, Russell, Wensing, "Efficient Analytical Derivatives of Rigid-Body Dynamics Using Spatial Vector Algebra", IEEE
// Robotics and Automation Letters 7(2), 2022.  All quantities are in common axes and about a common point: the axes of the base,
// and the origin of the body that the base carries, or of the floating base itself.  Composite quantities of subtrees are then
// plain sums, and products of different bodies need no transformation.  No digits are lost far from the world's origin.
//
// With position q_k (v and a held componentwise), the bodies beyond the joint are displaced by S_k.  Seen from the displaced
// bodies, their velocity changes by Ψ̇ = v_λ × S, and their acceleration by Ψ̈ − v × Ψ̇, Ψ̈ = a_λ × S + v_λ × Ψ̇; λ is the body
// that carries the joint.  With velocity v_k they change by S, and by Ψ̇ + Ṡ − v × S.
#pragma once

#include "ksl/engine/base_axes.hpp"
#include "ksl/engine/external_wrenches.hpp"
#include "ksl/engine/per_coordinate.hpp"

namespace ksl {

/// Of a coordinate: its unit twist, and what it changes.
template <class T> struct coordinate_motion {
  screw<T> S;
  screw<T> velocity_by_q;     ///< Ψ̇
  screw<T> acceleration_by_q; ///< Ψ̈
  screw<T> acceleration_by_v; ///< Ψ̇ + Ṡ
};

/// The motion of a body: its twist, and the rate of its twist minus gravity (spatial acceleration).
template <class T> struct body_twist { screw<T> velocity, acceleration; };

/// Of a body, or the sum over a subtree.  2 B = v×* I − I v× + (I v)×̄* maps x to (x.ang × twice_p, K x.ang): particles m at r
/// have twice_p = 2 Σ m ṙ and K = 2 Σ m (r · ṙ 1 − ṙ rᵀ).
template <class T> struct subtree_dynamics {
  spatial_inertia<T> I;
  mat3x3<T> K;
  vec3<T> twice_p;
  coscrew<T> f; ///< the wrench that the motion needs, less external wrenches
};

/// Of a coordinate: how the wrench through its joint changes with it.
template <class T> struct wrench_derivative {
  coscrew<T> by_q; ///< 2 B Ψ̇ + I Ψ̈ + S ×* f
  coscrew<T> by_v; ///< 2 B S + I (Ψ̇ + Ṡ)
  coscrew<T> by_a; ///< I S
  vec3<T> turn;    ///< the angular half of 2 Bᵀ S; the linear half is zero
};

inline namespace KSL_ISA {

template <class T> struct wrench_derivatives_workspace {
  pose_workspace<T> pose;
  per_body<mat3x3, T> rotation; ///< axes of each body
  per_body<vec3, T> origin;
  per_body<body_twist, T> motion;
  per_coordinate<coordinate_motion, T> coordinate;
  per_coordinate<subtree_dynamics, T> subtree;     ///< of each body, at its joint's last coordinate; later of its subtree, at all
  per_coordinate<body_twist, T> carrier;           ///< motion of the body that carries the joint; for plain numbers
  per_coordinate<wrench_derivative, T> derivative;

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, rotation, origin, motion);
    memory.lay_out(is_number<T> ? model.nv : 0, carrier);
    memory.lay_out(model.nv, coordinate, subtree, derivative);
  }
};

/// The last coordinate of body i.  The ground has none; its place is before that of the first body.
template <class S> KSL_LANES int last_coordinate(const model_view<S> &model, int i) {
  const body<S> &b = model.body[i > 0 || model.bodies == 1 ? i : 1];
  return b.v_index + b.nv - (i > 0 ? 1 : 2);
}

/// Ψ̇, Ψ̈ and Ψ̇ + Ṡ of a coordinate that is the only one of its joint: Ṡ = Ψ̇, since S × S = 0.
template <class T> KSL_LANES void set_rates(const body_twist<T> &carrier, coordinate_motion<T> &c) {
  using A = algebra<T>;
  screw<T> turned;
  A::cross_ss(&carrier.velocity, &c.S, &c.velocity_by_q);
  A::cross_ss(&carrier.acceleration, &c.S, &c.acceleration_by_q);
  A::cross_ss(&carrier.velocity, &c.velocity_by_q, &turned);
  A::xpy_ss(&turned, &c.acceleration_by_q);
  A::add_ss(&c.velocity_by_q, &c.velocity_by_q, &c.acceleration_by_v);
}

/// Ψ̇ + Ṡ of a coordinate of a joint that has several; `velocity` is that of the joint's body.
template <class T> KSL_LANES screw<T> several_rates(const screw<T> &velocity, const screw<T> &S, const screw<T> &velocity_by_q) {
  screw<T> rate;
  algebra<T>::cross_ss(&velocity, &S, &rate);
  algebra<T>::xpy_ss(&velocity_by_q, &rate);
  return rate;
}

/// The K of 2 B for an inertia I, about the common point, that moves with a twist (v, ω).
template <class T> KSL_LANES mat3x3<T> moment_of_momentum(const spatial_inertia<T> &I, const screw<T> &twist) {
  const vec3<T> &v = twist.lin, &w = twist.ang;
  // Q = Σ m ṙ rᵀ = v hᵀ + ω̃ E with E = Σ m r rᵀ; all times −2
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
  const T x = K.m00, y = K.m11, z = K.m22; // K = 2 (tr Q 1 − Q)
  K.m00 = -(y + z), K.m11 = -(z + x), K.m22 = -(x + y);
  return K;
}

/// Inertia, momentum and wrench of a body, for its own inertia in its own axes.
template <class T> KSL_LANES subtree_dynamics<T> body_dynamics(const spatial_inertia<T> &own, const mat3x3<T> &R,
                                                               const vec3<T> &origin, const body_twist<T> &m) {
  using A = algebra<T>;
  subtree_dynamics<T> d;
  const spatial_inertia<T> turned = rotated(own, R);
  A::spatial_inertia_translated(&turned, &origin, &d.I);
  const spatial_inertia<T> &I = d.I;
  const vec3<T> &v = m.velocity.lin, &w = m.velocity.ang;

  vec3<T> p;
  A::cross_vv(&w, &I.h, &p);
  A::axpy_vv(I.m, &v, &p);
  A::add_vv(&p, &p, &d.twice_p);

  d.K = moment_of_momentum(I, m.velocity);

  body_motion<T> at_point = {w, m.acceleration.ang, {}}; // of the body's point at the common point
  A::cross_vv(&w, &v, &at_point.acceleration);
  A::xpy_vv(&m.acceleration.lin, &at_point.acceleration);
  d.f = newton_euler(I, at_point);
  return d;
}

/// 2 B x + I y
template <class T> KSL_LANES coscrew<T> wrench_change(const subtree_dynamics<T> &d, const vec3<T> &x, const screw<T> &y) {
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

/// How the wrench through a joint changes with one of its coordinates; d is the sum over its subtree, by_a is I S.
template <class T>
KSL_LANES wrench_derivative<T> derivative_of(const subtree_dynamics<T> &d, const coordinate_motion<T> &c, const coscrew<T> &by_a) {
  using A = algebra<T>;
  wrench_derivative<T> out;
  coscrew<T> carried;
  vec3<T> turn;
  out.by_q = wrench_change(d, c.velocity_by_q.ang, c.acceleration_by_q);
  A::cross_sc(&c.S, &d.f, &carried);
  A::xpy_cc(&carried, &out.by_q);
  out.by_v = wrench_change(d, c.S.ang, c.acceleration_by_v);
  out.by_a = by_a;
  A::cross_vv(&d.twice_p, &c.S.lin, &out.turn);
  A::product_drinvv(&d.K, &c.S.ang, &turn);
  A::xpy_vv(&turn, &out.turn);
  return out;
}
template <class T> KSL_LANES wrench_derivative<T> derivative_of(const subtree_dynamics<T> &d, const coordinate_motion<T> &c) {
  coscrew<T> by_a;
  algebra<T>::product_Ms(&d.I, &c.S, &by_a);
  return derivative_of(d, c, by_a);
}

/// Sets the motion of the ground: it accelerates upwards, which has the effect of gravity.
template <class T> KSL_LANES void start_at_ground(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &w) {
  const vec3<T> zero = {T(0), T(0), T(0)};
  w.origin.set(0, zero);
  w.motion.set(0, {{zero, zero}, {ground_motion<T>(model).acceleration, zero}});
}

template <class T> KSL_LANES vec3<T> sum(const vec3<T> &a, const vec3<T> &b) {
  vec3<T> s;
  algebra<T>::add_vv(&a, &b, &s);
  return s;
}

/// Motion of body i, from that of its parent, and the twists of its joint's coordinates.
template <joint_kind K, class T>
KSL_LANES void move_body(const body<scalar_of<T>> &b, const wrench_derivatives_workspace<T> &w, int i, const vec3<T> &offset,
                         const T *v, const T *a) {
  using A = algebra<T>;
  body_twist<T> m = w.motion[b.parent];
  vec3<T> r = {T(0), T(0), T(0)};
  if (b.parent > 0) // bodies on the ground don't share any joint: each has a common point of its own
    r = sum(w.origin[b.parent], offset);
  w.origin.set(i, r);
  if constexpr (joint<K>::is_free)
    if (b.is_base) { // it floats on the ground; from here on all axes are those of this body
      const auto D = joint<K>::kept_pose(b, w.pose);
      D.to_body(m.acceleration.lin);
    }
  const body_twist<T> carrier = m;
  for_each_coordinate<joint<K>::nv>([&](auto k) KSL_INLINED {
    const int c = b.v_index + k;
    coordinate_motion<T> own;
    own.S = joint<K>::template column<k>(b, w.rotation, i).twist(r);
    if constexpr (is_number<T>) { // the other rates are computed in lanes
      A::cross_ss(&carrier.velocity, &own.S, &own.velocity_by_q);
      w.carrier.template set<T>(c, carrier);
      w.coordinate.template set_part<screw, T>(c, own.S);
    } else {
      set_rates(carrier, own);
      w.coordinate.template set<T>(c, own);
    }
    A::axpy_ss(v[k], &own.S, &m.velocity);
    A::axpy_ss(a[k], &own.S, &m.acceleration);
    A::axpy_ss(v[k], &own.velocity_by_q, &m.acceleration);
  });
  w.motion.set(i, m);
}

/// Corrects Ψ̇ + Ṡ of joints with several coordinates.
template <class T>
KSL_LANES void correct_several(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &w) {
  for (int i = 1; i < model.bodies && model.nv >= model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    if (b.nv < 2)
      continue;
    const screw<T> velocity = w.motion[i].velocity;
    for (int k = b.v_index; k < b.v_index + b.nv; ++k) {
      const screw<T> S = w.coordinate.template part<screw, T>(k), rate = w.coordinate.template part<screw, T, 6>(k);
      w.coordinate.template set_part<screw, T, 18>(k, several_rates(velocity, S, rate));
    }
  }
}

/// Stores the bodies k at their last coordinates.
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
      return subtree.set(first, d); // lanes beyond the last body are written over, or lie beyond the last coordinate
    for (int i = k.i; i <= last; ++i)
      for (int c = 0; c < numbers; ++c)
        if (i > 0)
          subtree.number(last_coordinate(model, i), c) = reinterpret_cast<const T *>(reinterpret_cast<const P *>(&d) + c)[i - k.i];
  }
}

/// External wrench e, in common axes and about the common point.
template <class T>
inline coscrew<T> external_in_common_axes(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &w,
                                          const external_wrenches<T> &external, int e) {
  const int i = model.link[external.link[e]].body;
  const SE3<T> D = {w.rotation[i], w.origin[i]};
  coscrew<T> f = external_in_body(model, external, e);
  algebra<T>::product_CoAdc(&D, &f, &f);
  return f;
}

/// Motions of all bodies and coordinates, and the dynamics of each body by itself.
template <class T>
KSL_LANES void forward_motions(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &w, const T *q, const T *v,
                               const T *a, const external_wrenches<T> &external) {
  w.rotation.clear_last_lanes(model.bodies), w.origin.clear_last_lanes(model.bodies), w.motion.clear_last_lanes(model.bodies);
  w.carrier.clear_beyond(model.nv), w.coordinate.clear_beyond(model.nv), w.derivative.clear_beyond(model.nv);
  start_at_ground(model, w);
  const auto move = [&]<joint_kind K>(int i, const vec3<T> &offset) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    move_body<K>(b, w, i, offset, v + b.v_index, a + b.v_index);
  };
  express_in_base(model, w.pose, w.rotation, q, move, [&](auto k) KSL_INLINED {
    set_bodies(model, w.subtree, k, body_dynamics(k.inertia(model), w.rotation[k], w.origin[k], w.motion[k]));
  });
  if constexpr (is_number<T>)
    for (int k = 0; k < model.nv; k += native_lanes<T>) {
      using P = native_pack<T>;
      coordinate_motion<P> c;
      c.S = w.coordinate.template part<screw, P>(k);
      set_rates(w.carrier.template get<P>(k), c);
      w.coordinate.set(k, c);
    }
  correct_several(model, w);
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

/// The same numbers in all lanes of P; unrolled, as body_lanes::read_all.
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

/// Adds the dynamics of each subtree to its parent's, and sets the derivatives of the wrenches through the joints.  Without these,
/// the dynamics are at all coordinates of a joint with plain numbers only, and at the last one otherwise.
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
