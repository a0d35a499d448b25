// Component i of a wrench w on a link does w_i J_i v on a motion v, J_i row i of the link's Jacobian, so that the tree's efforts lose w_i J_iᵀ and
// those of the drives follow as in inverse dynamics: Gᵀ E τ_d = −Gᵀ J_iᵀ.  Reactions are computed for a unit of each component.
#include "engine/loops/wrenches_on_links.hpp"

#include "engine/loops/link_parameters.hpp"

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
    // a wrench w takes Jᵀ w off the efforts of the tree: a unit of component i takes row i of J
    std::transform(jacobian_, jacobian_ + 6 * nv, jacobian_, [](double x) { return -x; });
  }
  return c.efforts_of_drives(jacobian_ + i * nv, efforts_);
}

/// Reactions for such a unit, those that are asked for.
/// At rest and without weight: what is found is linear in the wrench, and has no other part.
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
  if (!c.of().idle.empty()) // wrenches one at a time turn idle bodies
    return {finding::kind::no_column, c.of().idle[0].coordinate, 0, 0, c.solved().freedoms()};
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
      // by_wrench_ (rows, links, 6): a column of it at a time
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
  for (int k = 0; k < n; ++k) {
    const std::ptrdiff_t on = link(k);
    const body_motion<double> motion =
        resisted_motion(poses_ + 16 * on, twists_ + 6 * on, accelerations_ + 6 * on, m_->view().gravity);
    set_by_parameters(motion, rows_, n, k, by_wrench_, by_parameter_);
  }
  return by_parameter_;
}

} // namespace ksl::loops
