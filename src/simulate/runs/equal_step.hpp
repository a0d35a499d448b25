// A step of a method without error control, for one run.  The state at a share of it is that after a shorter step, so that events are of
// the method's order, whatever the method is.
#pragma once

#include "simulate/methods/continuous_step.hpp"
#include "simulate/runs/results.hpp"

namespace ksl::simulating {

class equal_step final : public continuous_step {
public:
  equal_step(system &of, stepping how);

  void set_run(std::size_t run) { start_.first = end_.first = within_.first = run; }

  bool begin(double t, const double *q, const double *v, double work) override;
  outcome attempt(double h) override;
  bool make_dense() override { return true; }
  outcome at(double share, double *q, double *v, double *work) override;
  int parts() const override { return 1; }
  const double *end_position(double *) override { return end_.q.data(); }
  void accept(double t) override;
  /// The first coordinate whose numbers at the end of the step are not finite; −1: none.
  int not_finite_at_end() const { return not_finite_speed(of_, end_, 0); }

  double t() const override { return start_.t; }
  double h() const override { return h_; }
  const double *q() const override { return start_.q.data(); }
  const double *v() const override { return start_.v.data(); }
  double work() const override { return start_.work[0]; }

private:
  system &of_;
  std::unique_ptr<method> method_;
  block start_, end_, within_;
  double h_ = 0;
  bool has_rates_ = false; ///< a and power of the start
  bool is_astray_ = false; ///< the method has been within the step since it was at its end
};

} // namespace ksl::simulating
