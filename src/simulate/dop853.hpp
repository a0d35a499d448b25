// One step of the method of Dormand and Prince of order 8(5,3) in local coordinates, its error, and the polynomial between its ends.
#pragma once

#include "simulate/dop853_coefficients.hpp"
#include "simulate/local_state.hpp"

namespace ksl::simulating {

class dop853_step {
public:
  dop853_step(system &of, std::size_t run, double relative, double absolute);

  /// The run is at a state with q (nq), v (nv), work, and rates that are computed here: a beginning, or after an event.
  bool begin(double t, const double *q, const double *v, double work);

  /// Tries a step; sets error(), which is at most 1 where it suffices.
  bool attempt(double h);
  double error() const { return error_; }
  /// The coordinate whose part of the error is largest; its first number that isn't finite, if there is one.
  int worst() const { return worst_; }
  double largest_turn() const { return of_.space().largest_turn(end_.data()); }

  /// A step of about the size that the error allows, for the first one.
  bool guess_step(double most, double &h);

  /// Computes the polynomial of the step that was attempted.
  bool make_dense();
  /// The state at a share of the step: q (nq), v (nv) and the work.
  void at(double share, double *q, double *v, double *work) const;

  /// The position at the end of the step that was attempted, in memory that is given.
  const double *end_position(double *q) const {
    of_.space().move(1, q_.data(), end_.data(), q);
    return q;
  }

  /// Goes to the end of the step.
  void accept();

  double t() const { return t_; }
  double h() const { return h_; }
  const double *q() const { return q_.data(); }
  const double *v() const { return start_.data() + of_.nv(); }
  double work() const { return start_[2 * of_.nv()]; }

private:
  void set_scale();
  bool stage(int s);

  system &of_;
  local_state state_;
  double relative_, absolute_, t_ = 0, h_ = 0, error_ = 0;
  int worst_ = -1;
  std::vector<double> q_, start_, end_, stage_, scale_, rate_[dop853::extended], dense_[7];
  std::vector<int> position_; ///< (nv) where a coordinate's size is in q; −1: the size is 1
};

} // namespace ksl::simulating
