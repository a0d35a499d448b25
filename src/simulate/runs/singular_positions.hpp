// Positions on the way of a run at which its loops lose rank: there the motion may go on in several ways, and reactions grow without bound.
//
// The measure is the last pivot of the elimination of K(q), the Jacobian of the loops (closed_mechanism::regularity).  Where K loses rank it passes
// zero about linearly, of which it gives the absolute value:
//
//     pivot  ─╲          ╱─        largest so far: usual_
//              ╲        ╱
//               ╲      ╱           below `watched` of it, the minimum of a step is looked for
//                ╲    ╱
//                 ╲  ╱             below `left` of it, this one is still the one that was told
//     ─────────────╲╱────────→ t   a minimum below `zero` of it: a singular position
#pragma once

#include "simulate/methods/continuous_step.hpp"

namespace ksl::simulating {

class singular_positions {
public:
  explicit singular_positions(system &of) : of_(of), q_(of.nq()), v_(of.nv()) {}

  /// The run is at the beginning of its first step, or after an event.
  void begin(const double *q) { before_ = first_ = regularity(q), falls_ = false; }

  /// Is there one in the step to its end, at the position q there: the share of the step, or a negative number.  The step is made dense
  /// if that is needed; a function may end the run then, which the next step will find.  passes_one: the step goes on where one is ahead.
  double find(continuous_step &step, const double *q, bool passes_one);

  /// The step that find() was asked for last isn't taken.
  void take_back() { before_ = first_, falls_ = fell_, is_near_ = was_near_; }

  /// How far ahead the next one is, in lengths of the step that find() was asked for last, if its pivot goes on to fall as it did; infinite
  /// where that is not near.
  double ahead() const;

  /// How large the last pivot is where the run is, as a share of the largest so far.
  double pivot() const { return before_ / usual_; }

private:
  double regularity(const double *q);
  double at(continuous_step &step, double share);
  double least_share(continuous_step &step, double first);

  system &of_;
  std::vector<double> q_, v_;
  double before_ = 1, usual_ = 0;        ///< at the beginning of the step; the largest so far
  double first_ = 0;                     ///< at the beginning of the last one
  bool falls_ = false;                   ///< did the pivot fall until the end of the last step
  bool fell_ = false, was_near_ = false; ///< at the beginning of the last step
  bool is_near_ = false;                 ///< has a singular position been told that the run hasn't left
};

} // namespace ksl::simulating
