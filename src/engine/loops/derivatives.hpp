// Derivatives of the dynamics of mechanisms with loops along the mechanism: independent coordinates q_i, v_i and a_i vary, one at a time,
// and the others follow.
//
// With (1) to (3) of closed_state.hpp, b(q, v, a) the efforts of the tree, and a variation dq = G dq_i, K dv = −∂(K v)/∂q dq, and da
// likewise (dv_i = 0, da_i = 0), the multipliers' variation has no part in
//
//     Gᵀ E dτ_d = Gᵀ (∂b/∂q dq + ∂b/∂v dv + M da − ∂(Kᵀ λ)/∂q dq).
//
// Why: (1) holds at all positions of the mechanism, so its variation does,
//
//     ∂(M a + b)/∂q dq + ∂b/∂v dv + M da = E dτ_d + ∂(Kᵀ λ)/∂q dq + Kᵀ dλ,
//
// and Gᵀ takes the last term off, K G = 0.  (Above, ∂b/∂q stands for ∂(M a + b)/∂q at the a given, which derivatives of inverse dynamics are.)  G
// varies along the mechanism, too, but needs no derivative: it multiplies an equation of nv rows that holds.
//
//     what varies      dq    dv        da                     numbers, of set_motions()
//     q_i              G     v_by_q_   a_by_q_                dv = dG v_i, da = d(G a_i + a₀): those at which the loops stay closed
//     v_i              0     G         a_by_v_
//     a_i              0     0         G
#pragma once

#include "engine/loops/closed_state.hpp"
#include "engine/loops/variation.hpp"

namespace ksl::loops {

class closed_derivatives {
public:
  closed_derivatives(const model &m, double tolerance) : m_(m), t_(m.loop_tables()), c_(m, tolerance), by_(m, t_) {}

  void lay_out(arena &memory, int externals);

  /// The state whose derivatives are wanted; its position is set first.
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
  /// How the numbers of a motion vary with each independent coordinate: (nv, freedoms) each, null where they don't.
  struct varied { const double *q, *v, *a; };
  static constexpr int kinds = 3; ///< by positions, velocities and accelerations

  void set_tree(const double *q, const double *v, const double *a, const external_wrenches<double> &e);
  void set_motions();
  void follow(const double *by_q, const double *by_v, const double *v, double *out);
  varied motion(int kind) const;
  void set_efforts(const varied &by);
  void project();
  double *copy_motion(const varied &by, int j, double *to) const;

  const model &m_;
  const tables &t_;
  closed_state c_;
  variation by_;
  double *by_q_ = nullptr, *by_v_ = nullptr, *M_ = nullptr;          ///< (nv, nv) of the tree
  double *v_by_q_ = nullptr, *a_by_q_ = nullptr, *a_by_v_ = nullptr; ///< (nv, freedoms)
  /// (nv, freedoms), but for rates
  double *efforts_ = nullptr, *projected_ = nullptr, *solved_ = nullptr, *rates_ = nullptr;
  double *a_ = nullptr, *tau_ = nullptr, *column_ = nullptr; ///< (nv)
};

/// Derivatives by the model's plan, whose independent coordinates are the drives, of forward dynamics or of inverse dynamics.  by_x: by efforts
/// (nv, nv), or by accelerations.  d may be null.  Returns false, and leaves the results as they are, where there is no plan or the state doesn't fit it.
bool derive_by_plan(bool forward, const model &m, data *d, state_view<double> s, double *by_q, double *by_v,
                    double *by_x);

/// How many columns these derivatives have; 0 where there is no plan for them.
int freedoms_by_plan(const model &m);

/// Derivatives of a batch, with its three results, in lanes.  done (batch.n): has the state its results; those of others are to be written
/// over.
void derive_in_lanes(bool forward, const model &m, const batch_view<double> &batch, unsigned char *done);

} // namespace ksl::loops
