// The dynamics of a mechanism with loops at the states between the steps of a method, which are not quite closed, and projections onto
// the closed ones.
#pragma once

#include "engine/loops/assembly.hpp"
#include "engine/loops/closed_state.hpp"
#include "engine/loops/derivatives.hpp"

#include <optional>
#include <vector>

namespace ksl::simulating {

class closed_mechanism {
public:
  closed_mechanism(const model &m, int externals);

  /// Accelerations a (nv) at a state, however far open; false where a freedom moves no mass.
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

  /// The largest equation that is open: m, angles times the length of the mechanism.
  double error(const double *q);

  /// How far the position is from a singular one: the last pivot of the loops' equations; 0 where they have lost rank.
  double regularity(const double *q);

  /// Moves q and v to the nearest closed ones; false where there are none nearby.
  bool project(double *q, double *v);

private:
  const model &m_;
  std::optional<loops::closed_state> state_;
  std::optional<loops::assembly> assembly_;
  std::optional<loops::closed_derivatives> derivatives_; ///< where they are asked for
  std::vector<std::byte> of_state_, of_assembly_, of_derivatives_;
  int externals_;
  std::vector<double> moved_, rows_, reduced_;
  int rank_ = 0;                    ///< the largest so far
  std::vector<unsigned char> free_; ///< (nv) no coordinate is held
};

} // namespace ksl::simulating
