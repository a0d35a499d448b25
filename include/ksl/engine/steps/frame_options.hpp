// KSL: how a motion of a frame is expressed.
#pragma once

#include "ksl/isa.hpp"

namespace ksl {

enum class expressed_in : int { frame, world }; ///< the frame of the link itself, or that of the world

/// Which acceleration of a frame.
/// - classical: that of the body's point which is at the origin in question.
/// - spatial: the classical one less ω × v of this point.  It is the rate of the body's twist about a point at rest.
/// - rate: the rate of the numbers of the twist.  docs/conventions.md has a table of what it is in which axes, about which origin.
enum class acceleration_kind : int { spatial, classical, rate };

/// The order of the six numbers of a twist, a wrench or a momentum.
enum class component_order : int { linear_first, angular_first };

/// The axes and the origin that a motion is expressed in, and the order of its six numbers.
struct frame_options {
  expressed_in axes = expressed_in::frame;
  expressed_in at = expressed_in::frame;
  bool angular_first = false;
  acceleration_kind kind = acceleration_kind::spatial; ///< for accelerations
  double offset[3] = {0, 0, 0};                        ///< of the frame's origin from the link's, in the link's axes, m
};

inline namespace KSL_ISA {

/// The order of the numbers that options name, and options that name an order and nothing else.
constexpr component_order order_of(const frame_options &how) {
  return how.angular_first ? component_order::angular_first : component_order::linear_first;
}
constexpr frame_options options_of(component_order order) {
  frame_options how;
  how.angular_first = order == component_order::angular_first;
  return how;
}

} // namespace KSL_ISA

} // namespace ksl
