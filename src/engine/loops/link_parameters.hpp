// What a link's ten inertial parameters do, from what wrenches on it do: its inertia is the wrench −B φ, with B (6, 10) of its motion (link_regressor.hpp).
#pragma once

#include "ksl/engine/algorithms/parameters/link_regressor.hpp"

#include <cstddef>

namespace ksl::loops {

/// The motion that a link's inertia resists, from its pose (4, 4), twist (6) and classical acceleration (6), which are at its origin and in its axes.
template <class S>
body_motion<S> resisted_motion(const S *pose, const S *twist, const S *acceleration, const vec3<S> &weight) {
  const mat3x3<S> R = {pose[0], pose[4], pose[8], pose[1], pose[5], pose[9], pose[2], pose[6], pose[10]};
  vec3<S> fall;
  algebra<S>::product_drinvv(&R, &weight, &fall);
  body_motion<S> motion;
  motion.angular_velocity = {twist[3], twist[4], twist[5]};
  motion.angular_acceleration = {acceleration[3], acceleration[4], acceleration[5]};
  motion.acceleration = {acceleration[0] - fall.x, acceleration[1] - fall.y, acceleration[2] - fall.z};
  return motion;
}

/// by_parameter (rows, links, 10) from by_wrench (rows, links, 6), of the link with this number.  Results are linear in wrenches on links, w · B, and
/// the wrench of inertia is linear in its ten parameters: B of the force that they need, as regressors of trees have it.
/// The row of results is w (6) for a unit wrench, so −w · B φ for the wrench of inertia −B φ; with h = m c and I about the link's origin
///
///     B φ = [ m (a − g) + ω̇ × h + ω × (ω × h) ;  h × (a − g) + I ω̇ + ω × I ω ],   linear in φ = (m, h, I).
template <class S>
void set_by_parameters(const body_motion<S> &motion, std::ptrdiff_t rows, std::ptrdiff_t links, std::ptrdiff_t link,
                       const S *by_wrench, S *by_parameter) {
  for (std::ptrdiff_t i = 0; i < rows; ++i) {
    // minus the twist on which the inertia's wrench has this power
    const S *const w = by_wrench + (i * links + link) * 6;
    const screw<S> s = {{-w[0], -w[1], -w[2]}, {-w[3], -w[4], -w[5]}};
    wrench_form(s, motion, by_parameter + (i * links + link) * parameters_of_link);
  }
}

} // namespace ksl::loops
