// KSL: how the motions of bodies change with positions and velocities.
//
// Singh, Russell, Wensing, "Efficient Analytical Derivatives of Rigid-Body Dynamics Using Spatial Vector Algebra", IEEE
// Robotics and Automation Letters 7(2), 2022.  All quantities are in common axes and about a common point: the axes of the base,
// and the origin of the body that the base carries, or of the floating base itself.  Products of different bodies then need no
// transformation.  No digits are lost far from the world's origin.
//
// S is the unit twist of a coordinate k, v and a are the twist and the spatial acceleration of a body beyond its joint, and λ is the
// body that carries the joint.  The rates of S are
//
//     Ψ̇ = v_λ × S,   Ψ̈ = a_λ × S + v_λ × Ψ̇,   Ṡ = v_body × S,                                                 (1)
//
// v_body being the twist of the joint's own body.  If the joint has one coordinate, Ṡ = Ψ̇.  A change of position q_k, with v and a
// held componentwise, displaces the bodies beyond the joint by S.  Seen from the displaced bodies, v and a change
//
//     with q_k by Ψ̇ and Ψ̈ − v × Ψ̇,   with v_k by S and Ψ̇ + Ṡ − v × S,   with a_k by 0 and S.                   (2)
#pragma once

#include "ksl/engine/algorithms/kinematics/forward_kinematics.hpp"
#include "ksl/engine/lanes/per_coordinate.hpp"
#include "ksl/engine/steps/base_axes.hpp"
#include "ksl/engine/steps/newton_euler.hpp"

namespace ksl {

/// The unit twist S of a coordinate, and its rates (1).  Their names say what they change, by (2).
template <class T> struct coordinate_motion {
  screw<T> S;
  screw<T> velocity_by_q;     ///< Ψ̇
  screw<T> acceleration_by_q; ///< Ψ̈
  screw<T> acceleration_by_v; ///< Ψ̇ + Ṡ
};

/// The motion of a body: its twist, and the rate of its twist (spatial acceleration), minus gravity where forces are computed.
template <class T> struct body_twist { screw<T> velocity, acceleration; };

inline namespace KSL_ISA {

template <class T> struct coordinate_motions_workspace {
  pose_workspace<T> pose;
  per_body<mat3x3, T> rotation; ///< axes of each body
  per_body<vec3, T> origin;
  per_body<body_twist, T> motion;
  per_coordinate<coordinate_motion, T> coordinate;
  per_coordinate<body_twist, T> carrier; ///< motion of the body that carries the joint; for plain numbers

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, rotation, origin, motion);
    memory.lay_out(is_number<T> ? model.nv : 0, carrier);
    memory.lay_out(model.nv, coordinate);
  }
};

/// Sets Ψ̇, Ψ̈ and Ψ̇ + Ṡ (1) of a coordinate that is the only one of its joint.  Then Ṡ = Ψ̇, since S × S = 0.
template <class T> KSL_LANES void set_rates(const body_twist<T> &carrier, coordinate_motion<T> &c) {
  using A = algebra<T>;
  screw<T> turned;
  A::cross_ss(&carrier.velocity, &c.S, &c.velocity_by_q);         // Ψ̇
  A::cross_ss(&carrier.acceleration, &c.S, &c.acceleration_by_q); // Ψ̈
  A::cross_ss(&carrier.velocity, &c.velocity_by_q, &turned);
  A::xpy_ss(&turned, &c.acceleration_by_q);
  A::add_ss(&c.velocity_by_q, &c.velocity_by_q, &c.acceleration_by_v);
}

/// Ψ̇ + Ṡ (1) of a coordinate of a joint that has several; `velocity` is v_body.
template <class T> KSL_LANES screw<T> several_rates(const screw<T> &velocity, const screw<T> &S,
                                                    const screw<T> &velocity_by_q) {
  screw<T> rate;
  algebra<T>::cross_ss(&velocity, &S, &rate);
  algebra<T>::xpy_ss(&velocity_by_q, &rate);
  return rate;
}

/// Sets the motion of the ground.  An acceleration upwards has the effect of gravity.
template <class T> KSL_LANES void start_at_ground(const coordinate_motions_workspace<T> &w,
                                                  const vec3<T> &acceleration) {
  const vec3<T> zero = {T(0), T(0), T(0)};
  w.origin.set(0, zero);
  w.motion.set(0, {{zero, zero}, {acceleration, zero}});
}

template <class T> KSL_LANES vec3<T> sum(const vec3<T> &a, const vec3<T> &b) {
  vec3<T> s;
  algebra<T>::add_vv(&a, &b, &s);
  return s;
}

/// Sets the motion of body i from that of its parent, v = v_λ + Σ S q̇ and a = a_λ + Σ (S q̈ + Ψ̇ q̇), and the twists of its joint's
/// coordinates.  Featherstone, RBDA (2008), eqs. (5.7), (5.8), where Ṡ takes the place of Ψ̇.  Their difference vanishes in the sum
/// over the coordinates of a joint.
template <joint_kind K, class T>
KSL_LANES void move_body(const body<scalar_of<T>> &b, const coordinate_motions_workspace<T> &w, int i,
                         const vec3<T> &offset, const T *v, const T *a) {
  using A = algebra<T>;
  body_twist<T> m = w.motion[b.parent];
  vec3<T> r = {T(0), T(0), T(0)};
  if (b.parent > 0) // bodies on the ground have no joint in common: each tree has a common point of its own
    r = sum(w.origin[b.parent], offset);
  w.origin.set(i, r);
  if constexpr (joint<K>::is_free)
    if (b.is_base) { // it floats on the ground; from here on all axes are those of this body
      const auto D = joint<K>::kept_pose(b, w.pose);
      D.to_body(m.acceleration.lin);
    }
  const body_twist<T> carrier = m;
  for_coordinates<K>(b, [&](auto k) KSL_INLINED {
    const int c = b.v_index + k;
    coordinate_motion<T> own;
    own.S = joint<K>::column(k, b, w.rotation, i).twist(r);
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
    A::axpy_ss(v[k], &own.velocity_by_q, &m.acceleration); // Ψ̇ q̇
  });
  w.motion.set(i, m);
}

/// Corrects Ψ̇ + Ṡ of the joint of body i if it has several coordinates.
template <class T> KSL_LANES void correct_several(const coordinate_motions_workspace<T> &w, const body<scalar_of<T>> &b,
                                                  int i) {
  if (b.nv < 2)
    return;
  const screw<T> velocity = w.motion[i].velocity;
  for (int k = b.v_index; k < b.v_index + b.nv; ++k) {
    const screw<T> S = w.coordinate.template part<screw, T>(k), rate = w.coordinate.template part<screw, T, 6>(k);
    w.coordinate.template set_part<screw, T, 18>(k, several_rates(velocity, S, rate));
  }
}

/// With plain numbers, sets Ψ̇, Ψ̈ and Ψ̇ + Ṡ of the coordinates [first, end), as many at a time as a register has lanes.
template <class T> KSL_LANES void set_rates_in_lanes(const coordinate_motions_workspace<T> &w, int first, int end) {
  if constexpr (is_number<T>)
    for (int k = first; k < end; k += native_lanes<T>) {
      using P = native_pack<T>;
      coordinate_motion<P> c;
      c.S = w.coordinate.template part<screw, P>(k);
      set_rates(w.carrier.template get<P>(k), c);
      w.coordinate.set(k, c);
    }
}

/// Sets the motions of all bodies and coordinates.  `ground` is the acceleration of the ground.  Calls lanes(k) in the order of
/// for_bodies.
template <class T, class Lanes>
KSL_LANES void coordinate_motions(const model_view<scalar_of<T>> &model, const coordinate_motions_workspace<T> &w,
                                  const vec3<T> &ground, const T *q, const T *v, const T *a, Lanes lanes) {
  w.rotation.clear_last_lanes(model.bodies), w.origin.clear_last_lanes(model.bodies),
      w.motion.clear_last_lanes(model.bodies);
  w.carrier.clear_beyond(model.nv), w.coordinate.clear_beyond(model.nv);
  start_at_ground(w, ground);
  const auto move = [&]<joint_kind K>(int i, const vec3<T> &offset) KSL_INLINED {
    const body<scalar_of<T>> &b = model.body[i];
    move_body<K>(b, w, i, offset, v + b.v_index, a + b.v_index);
  };
  express_in_base(model, w.pose, w.rotation, q, move, lanes);
  set_rates_in_lanes(w, 0, model.nv);
  for (int i = 1; i < model.bodies && model.nv >= model.bodies; ++i)
    correct_several(w, model.body[i], i);
}

/// The root of the tree that body i is in: the body on the ground that carries it, or 0 for the ground itself.  All bodies of a tree
/// have the same common axes and the same common point.
template <class S> inline int tree_of(const model_view<S> &model, int i) {
  while (model.body[i].parent > 0)
    i = model.body[i].parent;
  return i;
}

/// Pose in the world of a tree's common axes and point.
template <class T>
inline SE3<T> tree_pose(const model_view<scalar_of<T>> &model, const coordinate_motions_workspace<T> &w, int tree) {
  SE3<T> D = ground_pose<T>(model);
  if (tree > 0)
    by_kind(model.body[tree].kind, [&]<joint_kind K>() KSL_INLINED {
      const auto pose = joint<K>::kept_pose(model.body[tree], w.pose);
      D.t = pose.t;
      if constexpr (joint<K>::is_free)
        D.R = pose.R;
    });
  return D;
}

/// Pose of a link's frame in its tree's axes.
template <class T>
inline SE3<T> link_in_tree(const model_view<scalar_of<T>> &model, const coordinate_motions_workspace<T> &w, int link) {
  const ksl::link<scalar_of<T>> &l = model.link[link];
  const SE3<T> body = {w.rotation[l.body], w.origin[l.body]}, in_body = spread<T>(l.pose);
  SE3<T> D;
  algebra<T>::product_dd(&body, &in_body, &D);
  return D;
}

/// Calls step(first, end) for each run of coordinates that carry body i, its joint's own included.
template <class S, class Step> KSL_LANES void for_carriers(const model_view<S> &model, int i, Step step) {
  for (int end = model.body[i].v_index + model.body[i].nv; i > 0;) {
    i = model.body[i].chain_start;
    const int parent = model.body[i].parent;
    if (parent == 0 || parent != i - 1) {
      step(model.body[i].v_index, end);
      end = model.body[parent].v_index + model.body[parent].nv;
    }
    i = parent;
  }
}

} // namespace KSL_ISA
} // namespace ksl
