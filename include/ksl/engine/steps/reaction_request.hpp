// KSL: which reactions are wanted, and how they are expressed.  Apart from what computes them, since every call has one.
#pragma once

namespace ksl {

/// total = constraint + actuation + coupling: what the structure carries; what lies along the joint's motion; and the same of a
/// follower, a mimic joint, through which the mechanism of the coupling acts and no motor.
enum class wrench_part : int { total, constraint, actuation, coupling };
enum class wrench_side : int { child, parent };       ///< the wrench on which side
enum class wrench_frame : int { joint, world, link }; ///< whose origin, or whose axes

/// The joints whose reactions are wanted, and how these are expressed.
struct reaction_request {
  int n = 0;                 ///< joints
  const int *link = nullptr; ///< (n) the child link of each
  wrench_part part = wrench_part::total;
  wrench_side on = wrench_side::child;
  wrench_frame at = wrench_frame::joint; ///< point
  int at_link = -1;                      ///< whose origin, if `at` is link
  double offset[3] = {0, 0, 0};          ///< added to the joint's origin, in the joint's axes, if `at` is joint
  wrench_frame axes = wrench_frame::joint;
  int axes_link = -1;
  bool angular_first = false; ///< the order of the six numbers
};

} // namespace ksl
