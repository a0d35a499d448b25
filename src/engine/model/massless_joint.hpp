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

/// What is less than this share of the sum of the magnitudes of its terms counts as cancelled: rounding leaves about 1e−16 of them for
/// each step.  All terms of a sum have one unit.
constexpr double cancelled = 1e-13;

/// Bounds of the terms that make the articulated inertia of a body: reach[i]² is at least the sum of the magnitudes of the terms of its
/// diagonal element i, and reach[i] reach[j] that of element (i, j), since inertias are positive semidefinite.  kg^½, and kg^½ m.
struct term_bounds {
  double reach[6];

  void add(int i, double terms) { reach[i] = std::sqrt(reach[i] * reach[i] + std::fabs(terms)); }
  /// The bound of Sᵀ A S.
  double of(const screw<double> &S) const {
    const double s[6] = {S.lin.x, S.lin.y, S.lin.z, S.ang.x, S.ang.y, S.ang.z};
    double sum = 0;
    for (int i = 0; i < 6; ++i)
      sum += std::fabs(s[i]) * reach[i];
    return sum * sum;
  }
  /// U D⁻¹ Uᵀ is subtracted from A.
  void downdated(const coscrew<double> &U, double D_inverse) {
    const double u[6] = {U.lin.x, U.lin.y, U.lin.z, U.ang.x, U.ang.y, U.ang.z};
    for (int i = 0; i < 6; ++i)
      add(i, u[i] * u[i] * D_inverse);
  }
  /// Adds the terms of a child's A, about a point that is t away.
  void add_child(const term_bounds &child, const vec3<double> &t) {
    // A′ = Xᵀ A X, X the motion of the child's point for that of the parent's: |A′_ii| ≤ (Σ_j |X_ji| reach_j)², of moments m + t × f
    const double x = std::fabs(t.x), y = std::fabs(t.y), z = std::fabs(t.z), *const c = child.reach;
    const double moved[6] = {
        c[0], c[1], c[2], c[3] + y * c[2] + z * c[1], c[4] + z * c[0] + x * c[2], c[5] + x * c[1] + y * c[0]};
    for (int i = 0; i < 6; ++i)
      add(i, moved[i] * moved[i]);
  }
};

/// Arrays of the search, laid out for a model.  All are in double precision, whatever that of the call.
struct massless_joint_workspace {
  forward_dynamics_workspace<double> dynamics;
  array_of<term_bounds> terms;           ///< of the articulated inertia of each body
  double *q, *expanded_q, *no_effort;    ///< (nq), (expanded nq), (expanded nv)
  mass_matrix_workspace<double> inertia; ///< with mimic joints only, like all that follows
  double *M, *terms_of_pivot;            ///< (expanded nv, expanded nv), (expanded nv)

  static bool factors_mass_matrix(const model &m) {
    return m.followers() > 0 && m.view().nv <= most_coordinates_factored;
  }

  void lay_out(arena &memory, const model &m) {
    const model_view<double> view = m.view();
    dynamics.lay_out(memory, view);
    memory.lay_out(view.bodies, terms);
    q = memory.take<double>(m.nq()), expanded_q = memory.take<double>(view.nq),
    no_effort = memory.take<double>(view.nv);
    if (!factors_mass_matrix(m))
      return;
    inertia.lay_out(memory, view);
    M = memory.take<double>(static_cast<std::ptrdiff_t>(view.nv) * view.nv),
    terms_of_pivot = memory.take<double>(view.nv);
  }
};

/// The terms of each body's own inertia: those of its links, moved to the body's origin and rotated to any axes.
/// About the body's origin, t from the link's, I′ = I + 2 (t · h) 1 − t hᵀ − h tᵀ + m (t · t 1 − t tᵀ): the trace of I bounds its diagonal in any
/// axes, and |t| (4 |h| + 2 m |t|) that of what is added.
inline void own_terms(const model_view<double> &model, const massless_joint_workspace &w) {
  for (int i = 0; i < model.bodies; ++i)
    w.terms[i] = {};
  for (int l = 0; l < model.links; ++l) {
    const link<double> &link = model.link[l];
    const spatial_inertia<double> &I = link.inertia;
    const vec3<double> &t = link.pose.t, &h = I.h;
    const double mass = std::fabs(I.m), far = std::sqrt(t.x * t.x + t.y * t.y + t.z * t.z),
                 moment = std::sqrt(h.x * h.x + h.y * h.y + h.z * h.z);
    const double turned = std::fabs(I.Ixx) + std::fabs(I.Iyy) + std::fabs(I.Izz) + 4 * far * (moment + mass * far);
    term_bounds &terms = w.terms[link.body];
    for (int k = 0; k < 3; ++k)
      terms.add(k, mass), terms.add(3 + k, turned);
  }
}

/// Has one of the joint's coordinates no inertia but what rounding leaves of its terms?  After pass_to_parent, which has eliminated them;
/// D is compared with the terms that made it, and these are added to those of A.
template <joint_kind K> bool moves_no_mass(const body<double> &b, const massless_joint_workspace &w, int i) {
  term_bounds &terms = w.terms[i];
  bool none = false;
  if constexpr (joint<K>::is_free) { // the pivots of A = L D Lᵀ, as `solve` has them
    const articulated_inertia<double> A = w.dynamics.A[i];
    double L[6][6] = {{A.Mxx},
                      {A.Mxy, A.Myy},
                      {A.Mzx, A.Myz, A.Mzz},
                      {A.H.m00, A.H.m10, A.H.m20, A.Ixx},
                      {A.H.m01, A.H.m11, A.H.m21, A.Ixy, A.Iyy},
                      {A.H.m02, A.H.m12, A.H.m22, A.Izx, A.Iyz, A.Izz}};
    for (int k = 0; k < 6; ++k) {
      none = none || !(L[k][k] > cancelled * terms.reach[k] * terms.reach[k]);
      for (int r = k + 1; r < 6; ++r) {
        const double l = L[r][k] / L[k][k];
        terms.add(r, l * L[r][k]);
        for (int c = k + 1; c <= r; ++c)
          L[r][c] -= l * L[c][k];
      }
    }
  } else {
    for_coordinates_backwards<K>(b, [&](auto k) {
      screw<double> S = {{0, 0, 0}, {0, 0, 0}};
      joint<K>::column(k, b, w.dynamics.rotation, i).add(1.0, S);
      const coordinate_state<double> &c = w.dynamics.coordinate[b.v_index + k];
      none = none || !(std::fabs(c.D_inverse) * cancelled * terms.of(S) < 1); // D may be negative by rounding
      terms.downdated(c.U, c.D_inverse);
    });
  }
  return none;
}

/// The body whose joint moves no mass at one position, or 0.
inline int body_without_mass(const model_view<double> &model, const massless_joint_workspace &w, const double *q) {
  start_at_rest(model, w.dynamics, q, {});
  own_terms(model, w);
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<double> &b = model.body[i];
    bool none = false;
    by_kind(b.kind, [&]<joint_kind K>() {
      pass_to_parent<K>(b, w.dynamics, i, w.no_effort + b.v_index, physics_of(model, b));
      none = moves_no_mass<K>(b, w, i);
      if (b.parent > 0 && !joint<K>::is_free)
        w.terms[b.parent].add_child(w.terms[i], w.dynamics.offset[i]);
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
/// The terms of (Gᵀ M̂ G)_kk are those of (√M̂_ll + Σ |r_f| √M̂_ff)², f the followers of l; the terms of each pivot are those of its diagonal
/// element, since what is taken off it is no more than that.
inline int coordinate_without_mass(const model &m, const massless_joint_workspace &w) {
  const model_view<double> view = m.view();
  const std::size_t n = static_cast<std::size_t>(m.nv());
  double *const M = w.M;
  mass_matrix(view, w.inertia, w.expanded_q, M);
  const coupling_view<double> coupling = m.coupling_in<double>();
  double *const terms = w.terms_of_pivot; // first their roots: |Mᵢⱼ| is at most √(Mᵢᵢ Mⱼⱼ)
  for (int k = 0; k < view.nv; ++k)
    terms[k] = std::sqrt(std::fabs(M[static_cast<std::ptrdiff_t>(k) * (view.nv + 1)]));
  for (int f = 0; f < coupling.followers; ++f)
    terms[coupling.follower[f].leader_v] += std::fabs(coupling.follower[f].multiplier) * terms[coupling.follower[f].v];
  for (std::size_t k = 0; k < n; ++k) // in_v increases
    terms[k] = terms[coupling.in_v[k]] * terms[coupling.in_v[k]];
  reduce_axis(coupling, along::efforts, view.nv, 1, view.nv, M, M);
  reduce_axis(coupling, along::efforts, view.nv, m.nv(), 1, M, M);
  for (std::size_t k = 0; k < n; ++k) {
    if (!(M[k * n + k] > cancelled * terms[k]))
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
  for (int i = 0; i < m.nq(); ++i)      // w.q is null only where memory is measured
    w.q[i] = static_cast<double>(q[i]); // NOLINT(clang-analyzer-core.NullDereference)
  std::fill_n(w.no_effort, m.view().nv, 0.0);
  if (!m.followers()) {
    const int body = body_without_mass(m.view(), w, w.q);
    return body == 0 ? -1 : joint_of_body(m, body);
  }
  expand_position(m.coupling_in<double>(), w.q, w.expanded_q);
  if (body_without_mass(m.view(), w, w.expanded_q) == 0 || !massless_joint_workspace::factors_mass_matrix(m))
    return -1;
  const int coordinate = coordinate_without_mass(m, w);
  return coordinate < 0 ? -1 : joint_of_coordinate(m, coordinate);
}

/// The joint that moves no mass by the structure of the mechanism, or −1: one that moves none at two arbitrary positions.
inline int massless_joint(const model &m) {
  // The inertia that a joint moves is an analytic function of q: zero at a position without any meaning, it is zero everywhere but by chance, and
  // that doesn't come twice.
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
