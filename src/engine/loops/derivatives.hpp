// Derivatives of the dynamics of mechanisms with loops along the mechanism: independent coordinates q_i, v_i and a_i vary, one at a time,
// and the others follow.
//
// With (1) to (3) of closed_state.hpp, b(q, v, a) the efforts of the tree, and a variation dq = G dq_i, K dv = −∂(K v)/∂q dq, and da
// likewise (dv_i = 0, da_i = 0), the multipliers' variation has no part in
//
//     Gᵀ E dτ_d = Gᵀ (∂b/∂q dq + ∂b/∂v dv + M da − ∂(Kᵀ λ)/∂q dq).
#pragma once

#include "engine/loops/closed_state.hpp"
#include "engine/loops/variation.hpp"

namespace ksl::loops {

class closed_derivatives {
public:
  closed_derivatives(const model &m, double tolerance) : m_(m), t_(m.loop_tables()), c_(m, tolerance), by_(m, t_) {}

  void lay_out(arena &memory, int externals);

  /// Its position is set first.
  closed_state &state() { return c_; }

  /// Derivatives of the efforts of drives, which must be as many as the freedoms: (nv, freedoms) each.
  finding inverse_dynamics(const double *q, const double *v, const double *a, const external_wrenches<double> &e,
                           double *by_q, double *by_v, double *by_a);

  /// Of the accelerations under efforts tau (nv): by_q and by_v (nv, freedoms), by_tau (nv, nv).
  finding forward_dynamics(const double *q, const double *v, const double *tau, const external_wrenches<double> &e,
                           double *by_q, double *by_v, double *by_tau);

  /// How the motion varies along the mechanism: for each independent coordinate of q, of v and of a, (3, freedoms) dq, dv and da, (3, nv).
  void motions(const double *v, const double *a, double *motions);

  /// How the motion and the wrenches of the loops' joints vary along the mechanism: for each independent coordinate of q, of v and of a
  /// (3, freedoms) dq, dv and da, (3, nv); the wrenches on links, (loops, 2, 6), at the links' origins in their axes; and at the joints'
  /// frames, (loops, 6).
  finding reaction_variations(const double *q, const double *v, const double *a, const external_wrenches<double> &e,
                              double *motions, double *on_links, double *at_joints);

private:
  void set_tree(const double *q, const double *v, const double *a, const external_wrenches<double> &e);
  enum class varied { position, velocity, acceleration };
  void vary(varied what, int j);
  void vary_efforts(varied what, int j);
  void accelerate(double *a);
  void project(const double *matrix, double *out) const;
  void set_projections();
  void add_product(const double *matrix, int rows, const double *x, double sign, double *out) const;

  const model &m_;
  const tables &t_;
  closed_state c_;
  variation by_;
  double *by_q_ = nullptr, *by_v_ = nullptr, *M_ = nullptr;                ///< (nv, nv) of the tree
  double *dq_ = nullptr, *dv_ = nullptr, *da_ = nullptr, *left_ = nullptr; ///< (nv)
  double *rates_ = nullptr, *a_ = nullptr, *tau_ = nullptr, *r_ = nullptr;
  double *projected_q_ = nullptr, *projected_v_ = nullptr, *projected_a_ = nullptr; ///< (freedoms, nv) Gᵀ times these
};

} // namespace ksl::loops
