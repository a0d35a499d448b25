// KSL: the second derivatives of inverse dynamics.
//
// After Singh, Russell, Wensing, "On Second-Order Derivatives of Rigid-Body Dynamics: Theory & Implementation", IEEE Transactions on
// Robotics 40, 2024 (arXiv 2302.06001); derived anew with the quantities of wrench_derivatives.hpp.  All is in common axes.
//
// First derivatives.  A coordinate k adds to the motion of the bodies that it carries.  Seen from these bodies, their velocity changes
// by x_k and their acceleration by y_k − v × x_k, where (coordinate_motions.hpp)
//
//     (x, y) = (Ψ̇, Ψ̈) for a position,   (S, Ψ̇ + Ṡ) for a velocity,   (0, S) for an acceleration.               (1)
//
// If k carries joint z, or is of this joint, the wrench through joint z changes by
//
//     2 B x_k + I y_k,      I and B summed over the subtree of z.                                                 (2)
//
// Second derivatives.  A further coordinate m changes each term of (2):
// - 2 B is linear in velocities, and velocities change by x_m: 2 B changes by 2 B(I, x_m).                        (3)
// - x_k and y_k contain v_λ and a_λ, the motion of the body that carries joint k.  If m carries that body, they change by (4)
//
//                    if m is a position           if m is a velocity
//     Ψ̇_k            Ψ̇_m × S_k                    S_m × S_k
//     Ψ̈_k            Ψ̈_m × S_k + 2 Ψ̇_m × Ψ̇_k      (Ψ̇ + Ṡ)_m × S_k + 2 S_m × Ψ̇_k
//     Ψ̇_k + Ṡ_k      2 Ψ̇_m × S_k                  2 S_m × S_k
//
// - A position m displaces the bodies beyond its joint, but not the coordinates that carry this joint.  Seen from the displaced
//   bodies, a vector X of such a coordinate changes by −S_m × X, and a wrench by −S_m ×* f.                       (5)
//
// An element is zero unless its three coordinates are on one path from the ground.  Let z be the outermost of them.  Then only sums
// over the subtree of z enter, and there are two kinds of elements.
//
// The effort of z, by two coordinates u and w of the path, where u doesn't carry w: (3) and (5) with m = u, k = w.  Since
// S_z · 2 B(I, x) y = (x ×* I S_z − I' x) · y with I' = S_z ×* I − I S_z ×, the change of I when S_z displaces it,
//
//     ∂²τ_z/∂q_u ∂q_w = e · Ψ̇_w + g · Ψ̈_w            e = Ψ̇_u ×* I S_z − I' Ψ̇_u + S_u ×* 2 Bᵀ S_z
//     ∂²τ_z/∂q_u ∂v_w = e · S_w + g · (Ψ̇ + Ṡ)_w      g = S_u ×* I S_z
//     ∂²τ_z/∂v_u ∂q_w = h · Ψ̇_w                      h = S_u ×* I S_z − I' S_u
//     ∂²τ_z/∂v_u ∂v_w = h · S_w
//     ∂M_zw/∂q_u      = g · S_w                                                                                   (6)
//
// The effort of a coordinate w that carries z, by z and another coordinate u of the path: S_w · (the change of the wrench through
// joint z with z and u).  With m = z, k = u in (2), where I and 2 B of the subtree change with z (subtree_rates.hpp) by I' and 2 B',
//
//     by q_z, q_u: 2 B'_q Ψ̇_u + I' Ψ̈_u         by q_z, v_u: 2 B'_q S_u + I' (Ψ̇ + Ṡ)_u     by q_z, a_u: I' S_u
//     by v_z, q_u: 2 B'_v Ψ̇_u                  by v_z, v_u: 2 B'_v S_u                                            (7)
//
// If w also carries u, then q_u displaces bodies and not S_w: S_u ×* ∂f_z is added to the derivatives by q_u (5).  ∂f_z is that by
// q_z or by v_z, from (3) of wrench_derivatives.hpp.
//
// So each pair (z, u) has some vectors, and each element is a product of them with those of w.  The cost is O(nv × depth²).  The
// lanes of a register have elements of several u, or of several w.
#pragma once

#include "ksl/engine/algorithms/derivatives/inverse_dynamics_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/subtree_rates.hpp"
#include "ksl/engine/model/joint_physics.hpp"

namespace ksl {

/// The vectors of a pair of coordinates: z, the outermost one, and u, on the path to the joint of z, which is included.
template <class T> struct pair_derivatives {
  coscrew<T> effort_by_q; ///< e of (6), for efforts of z by q_u and another coordinate
  coscrew<T> turned;      ///< g of (6)
  coscrew<T> effort_by_v; ///< h of (6), for efforts of z by v_u and another coordinate
  coscrew<T> by_qq; ///< the wrench through joint z by q_u and q_z (7), for efforts of coordinates that u displaces
  coscrew<T> by_qq_beyond;        ///< by_qq for efforts of coordinates that carry u: S_u ×* ∂f_z is added
  coscrew<T> by_vv;               ///< by v_u and v_z
  coscrew<T> by_qv, by_qv_beyond; ///< by q_u and v_z, likewise
  coscrew<T> by_vq;               ///< by v_u and q_z
  coscrew<T> by_aq;               ///< by a_u and q_z
};

inline namespace KSL_ISA {

/// One place of the path from the ground to a joint, whose coordinates are numbered from 0: the coordinate's index in v, and the
/// places [first, end) of all coordinates of its joint.
struct path_place { int coordinate, first, end; };

template <class T> struct inverse_dynamics_second_derivatives_workspace {
  wrench_derivatives_workspace<T> wrenches;
  per_coordinate<subtree_rates, T> rates;
  array_of<path_place> place;                ///< the path to the joint that is visited
  per_coordinate<coordinate_motion, T> path; ///< the motions of the coordinates at these places
  per_coordinate<pair_derivatives, T> pair;  ///< the pairs of one coordinate z with those at these places

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    wrenches.lay_out(memory, model);
    memory.lay_out(model.nv, rates);
    memory.lay_out(model.longest_path, place, path, pair);
  }
};

/// Calls set(place, number) for each place in the lanes of x, of which the first is `first`; places from `end` on are left out.
/// number(c) is the lane of x[c] that belongs to the place.
template <class T, class P, int n, class Set> KSL_LANES void for_lanes(const P (&x)[n], int first, int end, Set set) {
  constexpr int lanes = static_cast<int>(sizeof(P) / sizeof(T));
  if constexpr (lanes == 1) {
    set(first, [&](int c) KSL_INLINED -> const T & { return x[c]; });
  } else {
    const int last = end - first < lanes ? end - first : lanes;
    alignas(64) T number[n][lanes];
    for (int c = 0; c < n; ++c)
      body_lanes::write(x[c], number[c]);
    for (int k = 0; k < last; ++k)
      set(first + k, [&](int c) KSL_INLINED -> const T & { return number[c][k]; });
  }
}

/// The four results, each (nv, nv, nv), row-major: the derivatives of efforts by q and q, by v and v, by q and v, and of the mass
/// matrix by q.
template <class T> struct tau_second_derivatives {
  T *by_qq, *by_vv, *by_qv, *mass_by_q;
  index n;

  KSL_LANES index at(index i, index k, index m) const { return (i * n + k) * n + m; }
  void clear_all() const {
    for (index k = 0; k < n * n * n; ++k)
      by_qq[k] = by_vv[k] = by_qv[k] = mass_by_q[k] = T(0);
  }
};

template <class T> KSL_LANES void add_to(const coscrew<T> &x, coscrew<T> &sum) { algebra<T>::xpy_cc(&x, &sum); }

/// S ×* f: how f changes if it is carried along S.
template <class T> KSL_LANES coscrew<T> carried(const screw<T> &S, const coscrew<T> &f) {
  coscrew<T> change;
  algebra<T>::cross_sc(&S, &f, &change);
  return change;
}

/// I x
template <class T> KSL_LANES coscrew<T> momentum_of(const spatial_inertia<T> &I, const screw<T> &x) {
  coscrew<T> p;
  algebra<T>::product_Ms(&I, &x, &p);
  return p;
}

/// Sets e, g and h of (6).  z are the rates of the subtree of coordinate z, and d is how the wrench through its joint changes with z:
/// d.by_a = I S_z, and d.turn is the angular half of 2 Bᵀ S_z.
template <class T>
KSL_LANES void set_own(const subtree_rates<T> &z, const wrench_derivative<T> &d, const coordinate_motion<T> &u,
                       pair_derivatives<T> &out) {
  using A = algebra<T>;
  vec3<T> turn;
  out.turned = carried(u.S, d.by_a); // g
  out.effort_by_q = carried(u.velocity_by_q, d.by_a);
  A::cross_vv(&u.S.ang, &d.turn, &turn); // S_u ×* 2 Bᵀ S_z, which is angular
  A::xpy_vv(&turn, &out.effort_by_q.ang);
  const coscrew<T> by_q = momentum_of(z.I_by_q, u.velocity_by_q), by_v = momentum_of(z.I_by_q, u.S);
  A::subtract_cc(&out.effort_by_q, &by_q, &out.effort_by_q); // e
  A::subtract_cc(&out.turned, &by_v, &out.effort_by_v);      // h
}

/// Sets how the wrench through joint z changes with z and u (7).  d is how it changes with z.
template <class T>
KSL_LANES void set_wrenches(const subtree_rates<T> &z, const wrench_derivative<T> &d, const coordinate_motion<T> &u,
                            pair_derivatives<T> &out) {
  out.by_qq = product(z.B_by_q, u.velocity_by_q.ang); // (7)
  add_to(momentum_of(z.I_by_q, u.acceleration_by_q), out.by_qq);
  out.by_qq_beyond = carried(u.S, d.by_q); // S_u ×* ∂f_z/∂q_z
  add_to(out.by_qq, out.by_qq_beyond);
  out.by_vv = product(z.B_by_v, u.S.ang);
  out.by_qv = product(z.B_by_v, u.velocity_by_q.ang);
  out.by_qv_beyond = carried(u.S, d.by_v); // S_u ×* ∂f_z/∂v_z
  add_to(out.by_qv, out.by_qv_beyond);
  out.by_vq = product(z.B_by_q, u.S.ang);
  add_to(momentum_of(z.I_by_q, u.acceleration_by_v), out.by_vq);
  out.by_aq = momentum_of(z.I_by_q, u.S);
}

/// Sets the pairs of coordinate z with the coordinates at the first n places of the path.
template <class T> KSL_LANES void set_pairs(const inverse_dynamics_second_derivatives_workspace<T> &w, int z, int n) {
  using P = lanes_of_coordinates<T>;
  constexpr int lanes = static_cast<int>(sizeof(P) / sizeof(T));
  for (int u = 0; u < n; u += lanes) {
    const subtree_rates<P> rates = w.rates.template in_all_lanes<P>(z);
    const wrench_derivative<P> d = w.wrenches.derivative.template in_all_lanes<P>(z);
    const coordinate_motion<P> c = w.path.template get<P>(u);
    pair_derivatives<P> pair;
    set_own(rates, d, c, pair);
    set_wrenches(rates, d, c, pair);
    w.pair.set(u, pair);
  }
}

/// Corrects the pairs of z with coordinates u of its own joint.  v_u changes S_u q̇_u, but not v_λ, so that (4) doesn't hold between
/// them: I (S_z × S_u) is added to by_vv.
template <class T>
KSL_LANES void correct_pairs_of_joint(const inverse_dynamics_second_derivatives_workspace<T> &w, int z,
                                      const path_place &own) {
  constexpr int by_vv = 30;
  const spatial_inertia<T> I = w.wrenches.subtree.template part<spatial_inertia, T>(z);
  const screw<T> S = w.wrenches.coordinate.template part<screw, T>(z);
  for (int u = own.first; u < own.end; ++u) {
    const screw<T> other = w.path.template part<screw, T>(u);
    coscrew<T> corrected = w.pair.template part<coscrew, T, by_vv>(u);
    screw<T> turned;
    algebra<T>::cross_ss(&S, &other, &turned);
    add_to(momentum_of(I, turned), corrected);
    w.pair.template set_part<coscrew, T, by_vv>(u, corrected);
  }
}

/// Sets the second derivatives of the effort of z (6), by the coordinate u at place_u and each coordinate that u doesn't carry.
template <class T>
KSL_LANES void set_effort_of_outermost(const inverse_dynamics_second_derivatives_workspace<T> &w, index z, int place_u,
                                       const tau_second_derivatives<T> &out) {
  using A = algebra<lanes_of_coordinates<T>>;
  using P = lanes_of_coordinates<T>;
  constexpr int lanes = static_cast<int>(sizeof(P) / sizeof(T));
  const path_place at = w.place[place_u];
  const index u = at.coordinate;
  for (int k = 0; k < at.end; k += lanes) {
    const auto effort_by_q = in_all_lanes<P, coscrew>(w.pair.template part<coscrew, T>(place_u));
    const auto turned = in_all_lanes<P, coscrew>(w.pair.template part<coscrew, T, 6>(place_u));
    const auto effort_by_v = in_all_lanes<P, coscrew>(w.pair.template part<coscrew, T, 12>(place_u));
    const coordinate_motion<P> c = w.path.template get<P>(k);
    const P x[5] = {A::dot_cs(&effort_by_q, &c.velocity_by_q) + A::dot_cs(&turned, &c.acceleration_by_q),
                    A::dot_cs(&effort_by_v, &c.S),
                    A::dot_cs(&effort_by_q, &c.S) + A::dot_cs(&turned, &c.acceleration_by_v),
                    A::dot_cs(&effort_by_v, &c.velocity_by_q), A::dot_cs(&turned, &c.S)};
    for_lanes<T>(x, k, at.end, [&](int place, auto number) KSL_INLINED {
      const index m = w.place[place].coordinate;
      out.by_qq[out.at(z, u, m)] = number(0);
      out.by_qv[out.at(z, m, u)] = number(3);
      if (place >= at.first) { // of the same joint as u: neither changes the velocity of the body that carries it
        out.by_vv[out.at(z, u, m)] = number(1) - number(4);
        return;
      }
      out.by_qq[out.at(z, m, u)] = number(0);
      out.by_vv[out.at(z, u, m)] = out.by_vv[out.at(z, m, u)] = number(1);
      out.by_qv[out.at(z, u, m)] = number(2);
      out.mass_by_q[out.at(z, m, u)] = out.mass_by_q[out.at(m, z, u)] = number(4);
    });
  }
}

/// Sets the second derivatives (7) of the effort of the coordinate at place `carrier`, which carries z, by z and each coordinate u at
/// the places [first, end).  `beyond` says whether it carries these as well.  `own` is the place where the joint of z begins.
template <bool beyond, class T>
KSL_LANES void set_effort_of_carrier(const inverse_dynamics_second_derivatives_workspace<T> &w, index z, int own,
                                     int carrier, int first, int end, const tau_second_derivatives<T> &out) {
  using P = lanes_of_coordinates<T>;
  using A = algebra<P>;
  constexpr int lanes = static_cast<int>(sizeof(P) / sizeof(T));
  const index i = w.place[carrier].coordinate;
  for (int u = first; u < end; u += lanes) {
    const auto S = in_all_lanes<P, screw>(w.path.template part<screw, T>(carrier));
    const coscrew<P> by_qq = w.pair.template part<coscrew, P, beyond ? 24 : 18>(u),
                     by_vv = w.pair.template part<coscrew, P, 30>(u);
    const coscrew<P> by_qv = w.pair.template part<coscrew, P, beyond ? 42 : 36>(u),
                     by_vq = w.pair.template part<coscrew, P, 48>(u);
    const coscrew<P> by_aq = w.pair.template part<coscrew, P, 54>(u);
    const P x[5] = {A::dot_cs(&by_qq, &S), A::dot_cs(&by_vv, &S), A::dot_cs(&by_qv, &S), A::dot_cs(&by_vq, &S),
                    A::dot_cs(&by_aq, &S)};
    for_lanes<T>(x, u, end, [&](int place, auto number) KSL_INLINED {
      const index m = w.place[place].coordinate;
      out.by_qq[out.at(i, z, m)] = number(0);
      out.by_vv[out.at(i, z, m)] = number(1);
      out.by_qv[out.at(i, m, z)] = number(2);
      if (place >= own)
        return;
      out.by_qq[out.at(i, m, z)] = number(0);
      out.by_vv[out.at(i, m, z)] = number(1);
      out.by_qv[out.at(i, z, m)] = number(3);
      out.mass_by_q[out.at(i, m, z)] = number(4);
    });
  }
}

/// Sets all elements of which coordinate z is the outermost.  `own` is the place of its joint, at the end of the path.
template <class T>
void set_elements_of(const inverse_dynamics_second_derivatives_workspace<T> &w, int z, const path_place &own,
                     const tau_second_derivatives<T> &out) {
  set_pairs(w, z, own.end);
  if (own.end - own.first > 1)
    correct_pairs_of_joint(w, z, own);
  for (int u = 0; u < own.end; ++u)
    set_effort_of_outermost(w, z, u, out);
  for (int carrier = 0; carrier < own.first; ++carrier) {
    const int middle = w.place[carrier].end;
    set_effort_of_carrier<false>(w, z, own.first, carrier, 0, middle, out);
    set_effort_of_carrier<true>(w, z, own.first, carrier, middle, own.end, out);
  }
}

/// How the dynamics of each subtree change with the coordinates of its joint.
template <class T>
KSL_LANES void set_rates_of_subtrees(const model_view<scalar_of<T>> &model,
                                     const inverse_dynamics_second_derivatives_workspace<T> &w) {
  using P = lanes_of_coordinates<T>;
  for (int k = 0; k < model.nv; k += static_cast<int>(sizeof(P) / sizeof(T)))
    w.rates.set(k, rates_of(w.wrenches.subtree.template get<P>(k), w.wrenches.coordinate.template get<P>(k)));
}

/// The second derivatives of inverse_dynamics at q (nq), v and a (nv), without the zeros that follow from the shape of the tree.
template <class T>
void elements_of_inverse_dynamics_second_derivatives(const model_view<scalar_of<T>> &model,
                                                     const inverse_dynamics_second_derivatives_workspace<T> &w,
                                                     const T *q, const T *v, const T *a,
                                                     const external_wrenches<T> &external, T *d2tau_dqdq, T *d2tau_dvdv,
                                                     T *d2tau_dqdv, T *dM_dq) {
  const tau_second_derivatives<T> out = {d2tau_dqdq, d2tau_dvdv, d2tau_dqdv, dM_dq, model.nv};
  const bool held = external.axes == expressed_in::world; // these wrenches are added at the end
  forward_motions(model, w.wrenches, q, v, a, held ? external_wrenches<T>{} : external);
  sum_subtrees(model, w.wrenches);
  set_rates_of_subtrees(model, w);
  if constexpr (is_number<T>) // lanes beyond the end of a path are read, too
    for (int k = 0; k < model.longest_path; k += native_lanes<T>)
      w.path.clear_beyond(k);
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    for (int k = 0; k < b.nv; ++k) {
      w.place[b.ancestors + k] = {b.v_index + k, b.ancestors, b.ancestors + b.nv};
      w.path.template set<T>(b.ancestors + k, w.wrenches.coordinate.get(b.v_index + k));
    }
    for (int k = 0; k < b.nv; ++k)
      set_elements_of(w, b.v_index + k, w.place[b.ancestors], out);
  }
  if (held)
    add_second_derivatives_of_held(model, w.wrenches, external, d2tau_dqdq);
  if (model.physics)
    add_physics_second_derivatives(model, v, d2tau_dvdv);
}

/// The second derivatives of tau = inverse_dynamics(q, v, a), each (nv, nv, nv), row-major.  Element (i, k, m) of d2tau_dqdq is the
/// derivative along q ⊕ s e_m of the derivative of effort i along q ⊕ s e_k, v and a held componentwise; in k and m it is symmetric
/// unless these are of one joint with several coordinates.  That of d2tau_dvdv is by v_k and v_m, that of d2tau_dqdv by q_k and v_m, and
/// that of dM_dq is the derivative of M_ik by q_m, or d²tau_i / da_k dq_m.  External wrenches are held in the axes in which they are
/// given, those of their links, which move, or of the world.  q (nq), v and a (nv).  O(nv × depth²), besides writing 4 nv³ numbers.
template <class T>
void inverse_dynamics_second_derivatives(const model_view<scalar_of<T>> &model,
                                         const inverse_dynamics_second_derivatives_workspace<T> &w, const T *q,
                                         const T *v, const T *a, const external_wrenches<T> &external, T *d2tau_dqdq,
                                         T *d2tau_dvdv, T *d2tau_dqdv, T *dM_dq) {
  tau_second_derivatives<T>{d2tau_dqdq, d2tau_dvdv, d2tau_dqdv, dM_dq, model.nv}.clear_all();
  elements_of_inverse_dynamics_second_derivatives(model, w, q, v, a, external, d2tau_dqdq, d2tau_dvdv, d2tau_dqdv,
                                                  dM_dq);
}

} // namespace KSL_ISA
} // namespace ksl
