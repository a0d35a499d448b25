// Wrenches through joints, those of the tree and those that close loops, as a request wants them.
#pragma once

#include "engine/loops/closed_state.hpp"

namespace ksl::loops {

/// Sets out (6) from wrenches (loops, 6), those of predecessors on successors at the joints' frames on the successors, after the geometry
/// has the position q.  All of it is constraint.
void set_loop_reaction(const geometry &g, const double *q, const reaction_request &wanted, int loop,
                       const double *wrenches, double *out);

class requested_reactions {
public:
  /// most: how many joints a request may name.
  void lay_out(arena &memory, const model &m, int most);

  /// The wrenches (joints, 6) of a motion, with the multipliers of c; all: those of closed_state::all_wrenches.
  const double *find(const closed_state &c, const double *q, const double *v, const double *a,
                     const external_wrenches<double> &all, const reaction_request &wanted);

private:
  int *links_ = nullptr, links_of_model_ = 0;
  double *found_ = nullptr, *efforts_ = nullptr;
};

} // namespace ksl::loops
