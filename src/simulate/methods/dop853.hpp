// One step of the method of Dormand and Prince of order 8(5,3) in local coordinates, its error, and the polynomial between its ends.
//
// The state is y = (u, v, W): local coordinates of the position about the one where the step begins, joint velocities, and the work.  With rates
// k_s at 12 stages
//
//     y′ = y + h Σ b_s k_s,   e₅ = Σ (b_s − b̂_s) k_s,   e₃ = Σ (b_s − b̃_s) k_s                                           (1)
//
// and the rates at y′ are those at the beginning of the next step: 12 evaluations a step, and 3 where a polynomial is wanted.
#pragma once

#include "simulate/methods/continuous_step.hpp"
#include "simulate/methods/dop853_coefficients.hpp"
#include "simulate/system/local_state.hpp"

namespace ksl::simulating {

class dop853_step final : public continuous_step {
public:
  dop853_step(system &of, std::size_t run, double relative, double absolute);

  bool begin(double t, const double *q, const double *v, double work) override;

  /// Errors are allowed to be as large as this, whatever the tolerances say: what rounding leaves of rates.
  void set_rounding(double rounding) { rounding_ = rounding; }

  /// Tries a step; sets error(), which is at most 1 where it suffices.
  outcome attempt(double h) override;
  double error() const { return error_; }
  /// The coordinate whose part of the error is largest; its first number that isn't finite, if there is one.
  int worst() const { return worst_; }
  double largest_turn() const { return of_.space().largest_turn(end_.data()); }

  /// A step of about the size that the error allows, for the first one.
  bool guess_step(double most, double &h);

  /// Computes the polynomial of the step that was attempted.
  bool make_dense() override;
  outcome at(double share, double *q, double *v, double *work) override;
  int parts() const override { return 8; }

  const double *end_position(double *q) override;

  void accept(double t) override;

  /// Keeps the polynomial of the step that was attempted, after make_dense.
  void keep_polynomial();
  /// The next step is as long as that polynomial goes on; nothing is evaluated.
  void go_on(double h);
  bool goes_on() const { return goes_on_; }

  double t() const override { return t_; }
  double h() const override { return h_; }
  const double *q() const override { return q_.data(); }
  const double *v() const override { return start_.data() + of_.nv(); }
  double work() const override { return start_[2 * of_.nv()]; }

private:
  struct polynomial { // NOLINT(bugprone-reserved-identifier): the name is the compiler's, of a loop that copies `part`
    double h = 0;
    std::vector<double> q, start, part[7]; ///< about the position q
  };

  void set_scale();
  void state_on(const polynomial &p, double share, double *q, double *y) const;
  bool stage(int s);

  system &of_;
  local_state state_;
  double relative_, absolute_, rounding_ = 0, t_ = 0, h_ = 0, error_ = 0;
  int worst_ = -1;
  std::vector<double> q_, start_, end_, stage_, scale_, rate_[dop853::extended];
  polynomial of_step_, kept_;
  bool goes_on_ = false;      ///< is the step one along kept_
  std::vector<int> position_; ///< (nv) where a coordinate's size is in q; −1: the size is 1
};

} // namespace ksl::simulating
