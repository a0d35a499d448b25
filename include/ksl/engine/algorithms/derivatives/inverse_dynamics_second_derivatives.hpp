// KSL: the second derivatives of inverse dynamics.
//
// After Singh, Russell, Wensing, "On Second-Order Derivatives of Rigid-Body Dynamics: Theory & Implementation", IEEE Transactions on
// Robotics 40, 2024 (arXiv 2302.06001); derived anew with the quantities of wrench_derivatives.hpp.  All is in common axes.
//
// A coordinate k changes the motions of the bodies beyond it, seen from these bodies, by a pair (x, y): (Ψ̇, Ψ̈) by q, (S, Ψ̇ + Ṡ) by v,
// (0, S) by a.  The wrench through joint z then changes by 2 B x + I y, and by S ×* f if k is of this joint and its position changes.
// A further coordinate m changes
//
//     2 B by 2 B(I, x_m): 2 B is linear in velocities;
//     Ψ̇, Ψ̈ and Ψ̇ + Ṡ of k, where m carries k, as v_λ and a_λ change: by Ψ̇_m × S, Ψ̈_m × S + 2 Ψ̇_m × Ψ̇, 2 Ψ̇_m × S if m is a position, and
//     by S_m × S, (Ψ̇ + Ṡ)_m × S + 2 S_m × Ψ̇, 2 S_m × S if m is a velocity;
//     vectors of coordinates that m displaces nothing of, seen from the displaced bodies, by −S_m × them.
//
// An element is zero unless its three coordinates are on one path from the ground.  Only the sums over the subtree of the outermost
// of them, z, enter.  If the effort is that of z, the elements are scalar products of vectors that depend on (z, u) with those of
// another coordinate w that doesn't lie beyond u.  Otherwise the wrench through joint z changes with z and u; the effort is that of w.
// So the cost is O(nv × depth²).  Elements of several u, or of several w, are in the lanes of a register.
#pragma once

#include "ksl/engine/algorithms/derivatives/inverse_dynamics_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/subtree_rates.hpp"

namespace ksl {

/// Of an outermost coordinate z and a coordinate u on the path to its joint: how efforts change with both.
template <class T> struct pair_derivatives {
  coscrew<T> effort_by_q;  ///< of z by q_u and another: times (Ψ̇, Ψ̈)'s first, or (S, Ψ̇ + Ṡ)'s
  coscrew<T> turned;       ///< S_u ×* I S_z: times the second
  coscrew<T> effort_by_v;  ///< of z by v_u and another
  coscrew<T> by_qq;        ///< the wrench through joint z by q_z and q_u, for efforts of coordinates that u doesn't carry
  coscrew<T> by_qq_beyond; ///< for efforts of coordinates that carry u
  coscrew<T> by_vv;
  coscrew<T> by_qv, by_qv_beyond; ///< by q_u and v_z
  coscrew<T> by_vq;               ///< by v_u and q_z
  coscrew<T> by_aq;               ///< by a_u and q_z
};

inline namespace KSL_ISA {

/// A place on a path: its coordinate, and the places where those of the same joint begin and end.
struct path_place { int coordinate, first, end; };

template <class T> struct inverse_dynamics_second_derivatives_workspace {
  wrench_derivatives_workspace<T> wrenches;
  per_coordinate<subtree_rates, T> rates;
  array_of<path_place> place;                 ///< of the path to the joint that is visited
  per_coordinate<coordinate_motion, T> path;  ///< the motions of its coordinates
  per_coordinate<pair_derivatives, T> pair;   ///< of one coordinate and those on the path to it

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    wrenches.lay_out(memory, model);
    memory.lay_out(model.nv, rates);
    memory.lay_out(model.longest_path, place, path, pair);
  }
};

/// Calls set(place, number) for the places from `first` on that are below `end`; number(c) is that of x[c] at the place.
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

/// The four results (nv, nv, nv), row-major: of efforts by q and q, v and v, q and v, and the mass matrix by q.
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

template <class T> KSL_LANES coscrew<T> carried(const screw<T> &S, const coscrew<T> &f) {
  coscrew<T> change;
  algebra<T>::cross_sc(&S, &f, &change);
  return change;
}

template <class T> KSL_LANES coscrew<T> momentum_of(const spatial_inertia<T> &I, const screw<T> &x) {
  coscrew<T> p;
  algebra<T>::product_Ms(&I, &x, &p);
  return p;
}

/// What the efforts of coordinate z itself need: d is how the wrench through its joint changes with z.
template <class T>
KSL_LANES void set_own(const subtree_rates<T> &z, const wrench_derivative<T> &d, const coordinate_motion<T> &u, pair_derivatives<T> &out) {
  using A = algebra<T>;
  vec3<T> turn;
  out.turned = carried(u.S, d.by_a);
  out.effort_by_q = carried(u.velocity_by_q, d.by_a);
  A::cross_vv(&u.S.ang, &d.turn, &turn);
  A::xpy_vv(&turn, &out.effort_by_q.ang);
  const coscrew<T> by_q = momentum_of(z.I_by_q, u.velocity_by_q), by_v = momentum_of(z.I_by_q, u.S);
  A::subtract_cc(&out.effort_by_q, &by_q, &out.effort_by_q);
  A::subtract_cc(&out.turned, &by_v, &out.effort_by_v);
}

/// How the wrench through joint z changes with z and u.
template <class T>
KSL_LANES void set_wrenches(const subtree_rates<T> &z, const wrench_derivative<T> &d, const coordinate_motion<T> &u,
                            pair_derivatives<T> &out) {
  out.by_qq = product(z.B_by_q, u.velocity_by_q.ang);
  add_to(momentum_of(z.I_by_q, u.acceleration_by_q), out.by_qq);
  out.by_qq_beyond = carried(u.S, d.by_q);
  add_to(out.by_qq, out.by_qq_beyond);
  out.by_vv = product(z.B_by_v, u.S.ang);
  out.by_qv = product(z.B_by_v, u.velocity_by_q.ang);
  out.by_qv_beyond = carried(u.S, d.by_v);
  add_to(out.by_qv, out.by_qv_beyond);
  out.by_vq = product(z.B_by_q, u.S.ang);
  add_to(momentum_of(z.I_by_q, u.acceleration_by_v), out.by_vq);
  out.by_aq = momentum_of(z.I_by_q, u.S);
}

/// Sets the pairs of coordinate z and those at the first n places of the path.
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

/// Coordinates of one joint: the velocity of one changes S q̇, but not the velocity of the body that carries the joint.  That adds
/// I (S_z × S_u) to by_vv.
template <class T>
KSL_LANES void correct_pairs_of_joint(const inverse_dynamics_second_derivatives_workspace<T> &w, int z, const path_place &own) {
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

/// The effort of z by the coordinates at place u and at places that u doesn't carry.
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

/// The effort of the coordinate at a place by z, which it carries, and the coordinates at places [first, end) of the path; `own`:
/// where those of the joint of z begin.  beyond: does it carry these as well.
template <bool beyond, class T>
KSL_LANES void set_effort_of_carrier(const inverse_dynamics_second_derivatives_workspace<T> &w, index z, int own, int carrier, int first,
                                     int end, const tau_second_derivatives<T> &out) {
  using P = lanes_of_coordinates<T>;
  using A = algebra<P>;
  constexpr int lanes = static_cast<int>(sizeof(P) / sizeof(T));
  const index i = w.place[carrier].coordinate;
  for (int u = first; u < end; u += lanes) {
    const auto S = in_all_lanes<P, screw>(w.path.template part<screw, T>(carrier));
    const coscrew<P> by_qq = w.pair.template part<coscrew, P, beyond ? 24 : 18>(u), by_vv = w.pair.template part<coscrew, P, 30>(u);
    const coscrew<P> by_qv = w.pair.template part<coscrew, P, beyond ? 42 : 36>(u), by_vq = w.pair.template part<coscrew, P, 48>(u);
    const coscrew<P> by_aq = w.pair.template part<coscrew, P, 54>(u);
    const P x[5] = {A::dot_cs(&by_qq, &S), A::dot_cs(&by_vv, &S), A::dot_cs(&by_qv, &S), A::dot_cs(&by_vq, &S), A::dot_cs(&by_aq, &S)};
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

/// The elements of which z, a coordinate of a body that is visited after those that carry it, is the outermost coordinate.
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
KSL_LANES void set_rates_of_subtrees(const model_view<scalar_of<T>> &model, const inverse_dynamics_second_derivatives_workspace<T> &w) {
  using P = lanes_of_coordinates<T>;
  for (int k = 0; k < model.nv; k += static_cast<int>(sizeof(P) / sizeof(T)))
    w.rates.set(k, rates_of(w.wrenches.subtree.template get<P>(k), w.wrenches.coordinate.template get<P>(k)));
}

/// The second derivatives of inverse_dynamics at q (nq), v and a (nv), without the zeros that follow from the shape of the tree.
template <class T>
void elements_of_inverse_dynamics_second_derivatives(const model_view<scalar_of<T>> &model,
                                                     const inverse_dynamics_second_derivatives_workspace<T> &w, const T *q, const T *v,
                                                     const T *a, const external_wrenches<T> &external, T *d2tau_dqdq, T *d2tau_dvdv,
                                                     T *d2tau_dqdv, T *dM_dq) {
  const tau_second_derivatives<T> out = {d2tau_dqdq, d2tau_dvdv, d2tau_dqdv, dM_dq, model.nv};
  const bool held = external.axes == expressed_in::world; // what these do is added at the end
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
void inverse_dynamics_second_derivatives(const model_view<scalar_of<T>> &model, const inverse_dynamics_second_derivatives_workspace<T> &w,
                                         const T *q, const T *v, const T *a, const external_wrenches<T> &external, T *d2tau_dqdq,
                                         T *d2tau_dvdv, T *d2tau_dqdv, T *dM_dq) {
  tau_second_derivatives<T>{d2tau_dqdq, d2tau_dvdv, d2tau_dqdv, dM_dq, model.nv}.clear_all();
  elements_of_inverse_dynamics_second_derivatives(model, w, q, v, a, external, d2tau_dqdq, d2tau_dvdv, d2tau_dqdv, dM_dq);
}

} // namespace KSL_ISA
} // namespace ksl
