// The wrench through a joint that closes a loop, as a request wants it.
#pragma once

#include "engine/loops/geometry.hpp"

namespace ksl::loops {

/// Sets out (6) from wrenches (loops, 6), those of predecessors on successors at the joints' frames on the successors, after the geometry
/// has the position q.  All of it is constraint.
void set_loop_reaction(const geometry &g, const double *q, const reaction_request &wanted, int loop,
                       const double *wrenches, double *out);

} // namespace ksl::loops
