#include "engine/loops/wrenches_on_links.hpp"

#include "ksl/engine/algorithms/parameters/link_regressor.hpp"

#include <algorithm>

namespace ksl::loops {

void wrenches_on_links::lay_out(arena &memory, const model &m, room wanted) {
  m_ = &m, all_ = static_cast<int>(m.links().size());
  const std::ptrdiff_t columns = std::max(wanted.links, all_), rows = std::max(m.nv(), 6 * wanted.joints);
  requested_.lay_out(memory, m, wanted.joints);
  efforts_ = memory.take<double>(m.nv()), jacobian_ = memory.take<double>(6 * m.nv());
  by_wrench_ = memory.take<double>(rows * 6 * columns);
  by_parameter_ = memory.take<double>(rows * parameters_of_link * columns);
  poses_ = memory.take<double>(16 * all_), twists_ = memory.take<double>(6 * all_);
  accelerations_ = memory.take<double>(6 * all_), indices_ = memory.take<int>(all_);
}

/// efforts_ for a unit of component i of a wrench on a link, by the link's Jacobian.
finding wrenches_on_links::set_efforts(closed_state &c, const double *q, int link, int i) {
  const int nv = m_->nv();
  if (i == 0) {
    state_view<double> s;
    s.q = q, s.links = {1, &link}, s.result[0] = jacobian_;
    c.call(rows::jacobian, s);
    std::transform(jacobian_, jacobian_ + 6 * nv, jacobian_, [](double x) { return -x; });
  }
  return c.efforts_of_drives(jacobian_ + i * nv, efforts_);
}

/// The same for the wrenches that are asked for.
finding wrenches_on_links::set_reactions(closed_state &c, const double *q, int link, int i,
                                         const reaction_request &wanted, const double **found) {
  double unit[6] = {};
  unit[i] = 1;
  const external_wrenches<double> e = {1, &link, unit, expressed_in::frame};
  if (const finding fault = c.inverse_dynamics(q, nullptr, nullptr, e, efforts_))
    return fault;
  const double *const still = c.zeros_or(nullptr);
  c.set_reactions(q, still, still, e);
  *found = requested_.find(c, q, still, still, c.all_wrenches(e), wanted);
  return {};
}

finding wrenches_on_links::find(closed_state &c, const double *q, const link_list &links,
                                const reaction_request *wanted, const double **found) {
  asked_ = wanted ? nullptr : &links;
  rows_ = wanted ? 6 * wanted->n : m_->nv();
  const int columns = 6 * this->links();
  c.take_weight_off();
  for (int k = 0; k < columns; ++k) {
    const int on = link(k / 6);
    const double *column = efforts_;
    if (const finding fault = wanted ? set_reactions(c, q, on, k % 6, *wanted, &column) : set_efforts(c, q, on, k % 6))
      return fault;
    for (int i = 0; i < rows_; ++i)
      by_wrench_[std::ptrdiff_t(i) * columns + k] = column[i];
  }
  *found = by_wrench_;
  return {};
}

/// Poses, twists and accelerations of all links.
void wrenches_on_links::set_motions(const closed_state &c, const double *q, const double *v, const double *a) {
  for (int k = 0; k < all_; ++k)
    indices_[k] = k;
  state_view<double> s;
  s.q = q, s.v = c.zeros_or(v), s.a = c.zeros_or(a), s.links = {all_, indices_};
  s.frame.kind = acceleration_kind::classical;
  s.result[0] = poses_;
  c.call(rows::frame_poses, s);
  s.result[0] = twists_;
  c.call(rows::frame_velocities, s);
  s.result[0] = accelerations_;
  c.call(rows::frame_accelerations, s);
}

const double *wrenches_on_links::by_parameters(closed_state &c, const double *q, const double *v, const double *a) {
  set_motions(c, q, v, a);
  const std::ptrdiff_t n = links();
  const vec3<double> weight = m_->view().gravity;
  for (int k = 0; k < n; ++k) {
    const double *const D = poses_ + 16 * link(k), *const V = twists_ + 6 * link(k),
                        *const A = accelerations_ + 6 * link(k);
    const mat3x3<double> R = {D[0], D[4], D[8], D[1], D[5], D[9], D[2], D[6], D[10]};
    vec3<double> fall;
    algebra<double>::product_drinvv(&R, &weight, &fall);
    body_motion<double> motion;
    motion.angular_velocity = {V[3], V[4], V[5]};
    motion.angular_acceleration = {A[3], A[4], A[5]};
    motion.acceleration = {A[0] - fall.x, A[1] - fall.y, A[2] - fall.z};
    for (std::ptrdiff_t i = 0; i < rows_; ++i) {
      const double *const w =
          by_wrench_ + (i * n + k) * 6; // minus the twist on which the inertia's wrench has this power
      const screw<double> s = {{-w[0], -w[1], -w[2]}, {-w[3], -w[4], -w[5]}};
      wrench_form(s, motion, by_parameter_ + (i * n + k) * parameters_of_link);
    }
  }
  return by_parameter_;
}

} // namespace ksl::loops
