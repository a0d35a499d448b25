// Finds a joint that can move without moving any mass.  Either it follows from the structure of a mechanism, and is found when the
// model is constructed; or it is so at one position, and is found when results are not finite.  The search uses the memory that it is
// given, since calls must not allocate.
#pragma once

#include "ksl/engine/algorithms/mass/mass_matrix.hpp"
#include "ksl/engine/algorithms/mass/solve_mass_matrix.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"
#include "ksl/model.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace ksl {

/// The most coordinates of a mass matrix that the search factors, which takes O(nv³).
constexpr int most_coordinates_factored = 500;

/// Arrays of the search, laid out for a model.  All are in double precision, whatever that of the call.
struct massless_joint_workspace {
  forward_dynamics_workspace<double> dynamics;
  double *q, *expanded_q, *no_effort;    ///< (nq), (expanded nq), (expanded nv)
  mass_matrix_workspace<double> inertia; ///< with mimic joints only, like all that follows
  double *M, *own;                       ///< (expanded nv, expanded nv), (nv)

  static bool factors_mass_matrix(const model &m) {
    return m.followers() > 0 && m.view().nv <= most_coordinates_factored;
  }

  void lay_out(arena &memory, const model &m) {
    const model_view<double> view = m.view();
    dynamics.lay_out(memory, view);
    q = memory.take<double>(m.nq()), expanded_q = memory.take<double>(view.nq),
    no_effort = memory.take<double>(view.nv);
    if (!factors_mass_matrix(m))
      return;
    inertia.lay_out(memory, view);
    M = memory.take<double>(static_cast<std::ptrdiff_t>(view.nv) * view.nv), own = memory.take<double>(m.nv());
  }
};

/// Has one of the joint's coordinates no inertia, after pass_to_parent?  What is less than 1e−13 of the articulated inertia counts as
/// none; rounding leaves about 1e−16.
template <joint_kind K>
bool moves_no_mass(const body<double> &b, const forward_dynamics_workspace<double> &w, int i) {
  constexpr double least = 1e-13;
  const articulated_inertia<double> A = w.A[i];
  const double size = A.Mxx + A.Myy + A.Mzz + A.Ixx + A.Iyy + A.Izz;
  bool none = false;
  if constexpr (joint<K>::is_free) {
    const screw<double> x = solve<double>(A, {{1, 1, 1}, {1, 1, 1}});
    for (double y : {x.lin.x, x.lin.y, x.lin.z, x.ang.x, x.ang.y, x.ang.z})
      none = none || !(std::fabs(y) * least * size <= 1);
  } else {
    for (int k = 0; k < coordinates<K>(b); ++k)
      none = none ||
             !(std::fabs(w.coordinate[b.v_index + k].D_inverse) * least * size <= 1); // D may be negative by rounding
  }
  return none;
}

/// The body whose joint moves no mass at one position, or 0.
inline int body_without_mass(const model_view<double> &model, const forward_dynamics_workspace<double> &w,
                             const double *q, const double *no_effort) {
  start_at_rest(model, w, q, {});
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<double> &b = model.body[i];
    bool none = false;
    by_kind(b.kind, [&]<joint_kind K>() {
      pass_to_parent<K>(b, w, i, no_effort + b.v_index, physics_of(model, b));
      none = moves_no_mass<K>(b, w, i);
    });
    if (none)
      return i; // the bodies that carry it have numbers that are not finite
  }
  return 0;
}

/// The joint that moves a body of the expanded mechanism: an index into m.joints().
inline int joint_of_body(const model &m, int body) {
  while (m.view().body[body].link < 0) // inside a universal joint
    ++body;
  return m.joint_above(m.view().body[body].link);
}

/// The joint that has coordinate k of a user's v: an index into m.joints().
inline int joint_of_coordinate(const model &m, int k) {
  int found = -1;
  for (int j = 0; j < m.moving_joints() && m.joints()[static_cast<std::size_t>(j)].v_index <= k; ++j)
    found = j;
  return found;
}

/// The first coordinate whose pivot is zero but for rounding in Gᵀ M̂ G = L D Lᵀ, the mass matrix of a mechanism with mimic joints at
/// the position w.expanded_q, or −1.  The articulated-body algorithm doesn't tell: a follower without mass moves the mass of its
/// leader, and the other way round.  O(nv³).
inline int coordinate_without_mass(const model &m, const massless_joint_workspace &w) {
  const model_view<double> view = m.view();
  const std::size_t n = static_cast<std::size_t>(m.nv());
  double *const M = w.M;
  mass_matrix(view, w.inertia, w.expanded_q, M);
  reduce_axis(m.coupling_in<double>(), along::efforts, view.nv, 1, view.nv, M);
  reduce_axis(m.coupling_in<double>(), along::efforts, view.nv, m.nv(), 1, M);
  for (std::size_t k = 0; k < n; ++k)
    w.own[k] = M[k * n + k];
  for (std::size_t k = 0; k < n; ++k) {
    if (!(M[k * n + k] > 1e-13 * w.own[k]))
      return static_cast<int>(k);
    for (std::size_t i = k + 1; i < n; ++i)
      for (std::size_t j = k + 1; j <= i; ++j)
        M[i * n + j] -= M[i * n + k] / M[k * n + k] * M[j * n + k];
  }
  return -1;
}

/// The joint that moves no mass at a position q (nq), an index into m.joints(), or −1.  It is found by the articulated-body algorithm,
/// and with mimic joints by factors of the mass matrix.  With more than most_coordinates_factored coordinates these are not computed,
/// and the result is −1.
template <class S> int massless_joint_at(const model &m, const massless_joint_workspace &w, const S *q) {
  for (int i = 0; i < m.nq(); ++i)
    w.q[i] = static_cast<double>(q[i]);
  std::fill_n(w.no_effort, m.view().nv, 0.0);
  if (!m.followers()) {
    const int body = body_without_mass(m.view(), w.dynamics, w.q, w.no_effort);
    return body == 0 ? -1 : joint_of_body(m, body);
  }
  expand_position(m.coupling_in<double>(), w.q, w.expanded_q);
  if (body_without_mass(m.view(), w.dynamics, w.expanded_q, w.no_effort) == 0 ||
      !massless_joint_workspace::factors_mass_matrix(m))
    return -1;
  const int coordinate = coordinate_without_mass(m, w);
  return coordinate < 0 ? -1 : joint_of_coordinate(m, coordinate);
}

/// The joint that moves no mass by the structure of the mechanism, or −1: one that moves none at two arbitrary positions.
inline int massless_joint(const model &m) {
  const owned_workspace<massless_joint_workspace> w(m);
  std::vector<double> q(static_cast<std::size_t>(m.nq()));
  int found = -1;
  for (int turn = 0; turn < 2; ++turn) {
    for (std::size_t k = 0; k < q.size(); ++k)
      q[k] = std::sin(1.0 + 2.3 * static_cast<double>(k) + 0.7 * turn); // quaternions need not be of unit length
    found = massless_joint_at(m, *w, q.data());
    if (found < 0)
      return -1;
  }
  return found;
}

} // namespace ksl
