// What wrenches on links do to a mechanism with loops, and so what inertial parameters do: results that are linear in either.
//
// A wrench on a link needs efforts of the drives, and goes through the joints.  The inertia of a link with the ten parameters φ is the wrench
// −B φ, with B (6, 10) of its motion (link_regressor.hpp).
#pragma once

#include "engine/loops/loop_reaction.hpp"

namespace ksl::loops {

class wrenches_on_links {
public:
  void lay_out(arena &memory, const model &m, room wanted);

  /// found: the efforts of the drives (nv, links, 6) for each component of a wrench on each of these links, or the wrenches (joints, 6,
  /// links, 6) that are asked for, of all links.  From here on c has no weight.
  finding find(closed_state &c, const double *q, const link_list &links, const reaction_request *wanted,
               const double **found);

  /// The results (…, links, 10) for each inertial parameter of the links, in a motion of the mechanism; a null v and a are zero.
  const double *by_parameters(closed_state &c, const double *q, const double *v, const double *a);

private:
  int links() const { return asked_ ? asked_->n : all_; }
  int link(int k) const { return asked_ ? asked_->index[k] : k; }
  finding set_efforts(closed_state &c, const double *q, int link, int i);
  finding set_reactions(closed_state &c, const double *q, int link, int i, const reaction_request &wanted,
                        const double **found);
  void set_motions(const closed_state &c, const double *q, const double *v, const double *a);

  const model *m_ = nullptr;
  const link_list *asked_ = nullptr;
  int all_ = 0, rows_ = 0;
  requested_reactions requested_;
  double *efforts_ = nullptr, *jacobian_ = nullptr, *by_wrench_ = nullptr, *by_parameter_ = nullptr;
  double *poses_ = nullptr, *twists_ = nullptr, *accelerations_ = nullptr; ///< of links
  int *indices_ = nullptr;
};

} // namespace ksl::loops
