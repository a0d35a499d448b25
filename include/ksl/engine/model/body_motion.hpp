// KSL: the motion of a body, to which its joint contributes (joints/) and from which its laws of motion follow
// (steps/newton_euler.hpp).
#pragma once

#include "ksl/algebra.hpp"

namespace ksl {

/// The motion of a body, as far as its laws of motion depend on it.
template <class T> struct body_motion {
  vec3<T> angular_velocity, angular_acceleration;
  vec3<T> acceleration; ///< classical, of the frame's origin, minus gravity
};

} // namespace ksl
