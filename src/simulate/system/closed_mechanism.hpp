// The dynamics of a mechanism with loops at the states between the steps of a method, which are not quite closed, and projections onto
// the closed ones.
//
// K v = 0 are the loops' equations for velocities, G their null space: v = G y, y the velocities of the independent coordinates.  Then
//
//     (Gᵀ M G) ẏ = Gᵀ (τ − b − M c),   a = G ẏ + c,   K c = −K̇ v.                                                        (1)
//
// Stages of a method lie beside the closed positions, by the order of its error; (1) makes sense there, too, and is what is integrated.  How far
// loops have opened at the end of a step is taken back by project().
#pragma once

#include "engine/loops/assembly.hpp"
#include "engine/loops/closed_state.hpp"
#include "engine/loops/derivatives.hpp"
#include "engine/loops/closed_by_plan.hpp"

#include <optional>
#include <vector>

namespace ksl::simulating {

class closed_mechanism {
public:
  static constexpr int most_by_plan = loops::closed_by_plan<double>::most;

  /// For at most `most` states at once.
  closed_mechanism(const model &m, int externals, std::size_t most);

  /// Accelerations, batch.result[0], of n states from `first` on, at most most_by_plan, in lanes by the model's plan; done[k] says
  /// whether it fits state k.
  void accelerate_by_plan(const batch_view<double> &batch, std::size_t first, int n, bool *done);

  /// Accelerations a (nv) at a state, however far open, with pivots of its own; false where a freedom moves no mass.
  bool accelerate(const double *q, const double *v, const double *tau, const external_wrenches<double> &e, double *a);

  /// Derivatives of the accelerations, (nv, nv) each: by_q and by_v along the mechanism, in the columns of its independent coordinates and
  /// zero in the others, so that their products with changes that keep the loops closed are those of the accelerations; by efforts tau.
  bool derivatives(const double *q, const double *v, const double *tau, const external_wrenches<double> &e,
                   double *by_q, double *by_v, double *by_tau);

  /// After accelerate: a (nv) that an effort of 1 at a coordinate causes at rest.
  void response(int coordinate, double *a);

  /// Efforts tau (nv) of the drives for accelerations a; those of statics where v and a are null.
  bool efforts(const double *q, const double *v, const double *a, const external_wrenches<double> &e, double *tau);

  /// a: accelerations of the mechanism with those of the drives as they are.
  void complete_acceleration(const double *q, const double *v, double *a);

  /// The motions that keep loops closed at q, however far open: x = G y; G (nv, freedoms), whose number is returned.
  int set_tangent(const double *q, double *G);

  /// After set_tangent: x (nv) with K x = −error, to first order the way to a closed position, its independent coordinates zero.
  void way_back(double *x);

  /// After set_tangent: replaces r (freedoms) by (Gᵀ M G)⁻¹ r; false where a freedom moves no mass.
  bool solve_inertia(const double *q, double *r) { return !state_->solve_inertia(q, r, nullptr); }

  /// The largest equation that is open: m, angles times the length of the mechanism.
  double error(const double *q);

  /// How far the position is from a singular one: the last pivot of the loops' equations; 0 where they have lost rank.
  double regularity(const double *q);

  /// Moves q and v to the nearest closed ones, unless they are closed but for rounding; false where there are none nearby.  opened: the
  /// error before.  held (nv flags): coordinates that are kept where that is possible; null: none.
  bool project(double *q, double *v, double &opened, const unsigned char *held = nullptr);

private:
  bool keeps_closed(const double *v);

  const model &m_;
  std::optional<loops::closed_state> state_;
  std::optional<loops::assembly> assembly_;
  std::optional<loops::closed_derivatives> derivatives_; ///< where they are asked for
  std::optional<loop_view<double>> plan_; ///< the model's, for states however far open; where there is one
  std::optional<loops::closed_by_plan<double>> planned_;
  std::vector<std::byte> of_state_, of_assembly_, of_derivatives_, of_planned_;
  int externals_;
  std::vector<double> moved_, rows_, terms_, reduced_;
  int rank_ = 0;                    ///< the largest so far
  std::vector<unsigned char> free_; ///< (nv) no coordinate is held
};

} // namespace ksl::simulating
