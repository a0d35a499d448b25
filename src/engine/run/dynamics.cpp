// The calls of dynamics.hpp that are not generated from api/algorithms/.
#include "ksl/dynamics.hpp"

#include "engine/run/compute.hpp"
#include "engine/run/section.hpp"

#include <cmath>

namespace ksl {

template <class S>
void reactions(const model &m, data &d, const reaction_request &request, S *out, const external_wrenches<S> &external) {
  const reaction_result<S> wanted = {&request, out};
  compute<S>(rows::inverse_dynamics_with_reactions, m, d,
             {.external = external, .reactions_n = 1, .reactions = &wanted});
}
template void reactions(const model &, data &, const reaction_request &, double *, const external_wrenches<double> &);
template void reactions(const model &, data &, const reaction_request &, float *, const external_wrenches<float> &);

bool is_beyond(const model &m, const link_section &section, int joint) {
  for (int k = 0; k < section.beyond_n; ++k)
    if (section.beyond[k] == joint)
      return true;
  if (section.beyond_n >= 0)
    return false;
  const std::size_t number = static_cast<std::size_t>(joint), joints = m.joints().size();
  if (number >= joints) {
    const loop_row &loop = m.loops()[number - joints];
    return sections::is_point_beyond(section,
                                     loop.successor == section.link ? loop.successor_pose.t : loop.predecessor_pose.t);
  }
  const joint_row &row = m.joints()[number];
  // n · (0 − p) > 0
  if (row.link == section.link) // its origin is the link's, and in the plane it is near
    return sections::dot(section.normal, sections::three<double>(section.point)) < 0;
  return sections::is_point_beyond(section,
                                   m.description().joints[static_cast<std::size_t>(row.description)].placement.t);
}

template void section_wrench(const model &, data &, const double *, const double *, const double *,
                             const link_section &, double *, const external_wrenches<double> &);
template void section_wrench(const model &, data &, const float *, const float *, const float *, const link_section &,
                             float *, const external_wrenches<float> &);

template <class S> void neutral(const model &m, S *q) {
  for (int i = 0; i < m.nq(); ++i)
    q[i] = S(0);
  for (const model::quaternion_in_q &quaternion : m.quaternions())
    q[quaternion.q_index + 3] = S(1);
}
template void neutral(const model &, double *);
template void neutral(const model &, float *);

template <class S> void random_position(const model &m, const S *uniform, S *q) {
  const nearest_rounding rounding;
  for (std::size_t i = 0; i < m.position_ranges().size(); ++i) {
    const auto [lower, upper] = m.position_ranges()[i];
    const double number = double(uniform[i]), width = upper - lower;
    // from (lower, upper]: uniform numbers are in [0, 1).  The width of two finite limits may overflow, half of it can't.
    q[i] = S(std::isfinite(width) ? upper - width * number : 2 * (upper / 2 - (upper / 2 - lower / 2) * number));
  }
  const double turn = 2 * std::acos(-1.0);
  for (const model::quaternion_in_q &quaternion : m.quaternions()) {
    const S *const u = uniform + quaternion.q_index;
    // Shoemake: (√(1 − u₁) (sin 2π u₂, cos 2π u₂), √u₁ (sin 2π u₃, cos 2π u₃)) is uniform on the unit sphere of four dimensions
    const double a = std::sqrt(1 - double(u[0])), b = std::sqrt(double(u[0])), x = turn * double(u[1]),
                 y = turn * double(u[2]);
    const double numbers[4] = {a * std::sin(x), a * std::cos(x), b * std::sin(y), b * std::cos(y)};
    for (int i = 0; i < 4; ++i)
      q[quaternion.q_index + i] = S(numbers[i]);
  }
}
template void random_position(const model &, const double *, double *);
template void random_position(const model &, const float *, float *);

SE3<double> frame_pose(const model &m, data &d, const double *q, int link) {
  double x[16];
  frame_poses(m, d, q, 1, &link, x);
  return {{x[0], x[4], x[8], x[1], x[5], x[9], x[2], x[6], x[10]}, {x[3], x[7], x[11]}};
}

} // namespace ksl
