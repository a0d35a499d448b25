// A step of one run, and the states within it.
#pragma once

#include "simulate/methods/steps.hpp"

namespace ksl::simulating {

class continuous_step {
public:
  virtual ~continuous_step() = default;
  continuous_step(const continuous_step &) = delete;
  continuous_step &operator=(const continuous_step &) = delete;

  /// The run is at a state with q (nq), v (nv) and work: a beginning, or after an event.  False if a function ended the run.
  virtual bool begin(double t, const double *q, const double *v, double work) = 0;

  virtual outcome attempt(double h) = 0;

  /// Readies `at` for a step that was attempted; false as above.
  virtual bool make_dense() = 0;

  /// The state at a share of the step: q (nq), v (nv) and the work.
  virtual outcome at(double share, double *q, double *v, double *work) = 0;

  /// Into how many parts a step is cut where events are sought.
  virtual int parts() const = 0;

  /// The position at the end of the step, in memory that is given.
  virtual const double *end_position(double *q) = 0;

  /// Goes to the end of the step, which is at time t.
  virtual void accept(double t) = 0;

  virtual double t() const = 0; ///< at its beginning
  virtual double h() const = 0;
  virtual const double *q() const = 0; ///< at its beginning
  virtual const double *v() const = 0;
  virtual double work() const = 0;

protected:
  continuous_step() = default;
};

} // namespace ksl::simulating
