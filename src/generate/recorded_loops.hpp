// Algorithms of closed mechanisms, recorded by the plan of their loops.
#pragma once

#include "generate/recorded_elements.hpp"

#include <string>

namespace ksl::generate {

/// Throws std::invalid_argument if a row isn't computed by the plan, or in single precision.
void refuse_loops(const algorithm_row &, const model &, bool single);

/// The row that is recorded: derivatives of closed mechanisms, which are along the mechanism, have private rows.
const algorithm_row &recorded_row(const algorithm_row &, const model &);

/// The row whose recording is differentiated to have a row of derivatives along a closed mechanism: of reactions, and of dynamics where force elements act.
/// Null for other rows, and for trees.
const char *differentiated_along(const algorithm_row &, const model &);
/// Throws std::invalid_argument if what is called `name` has no derivatives along a closed mechanism.  Trees have.
void refuse_along(const std::string &name, const model &, bool single);

/// NaN in place of n numbers where a sum of results is none.
void mark_missing(const recording &sum, recording *x, std::ptrdiff_t n);

/// Records one state of such a row.  The view has the plan.  Where it doesn't serve, all results are NaN.
void record_closed(const recorded_mechanism &, const algorithm_row &, const state_view<recording> &s);

/// How a motion varies with the independent coordinates of q, v and a, which are the drives; NaN in `fault` where the plan doesn't serve, else 0.
/// With v = G(q) y on the mechanism, y of the drives:  v_by_q = ∂(G y)/∂q G,  and a = G ẏ + Ġ y likewise by q and by v.
struct motion_along {
  int freedoms;
  recording fault;
  recordings G, v_by_q, a_by_q, a_by_v; ///< (nv, freedoms) each
};
motion_along motions_along(const recorded_mechanism &, const recording *q, const recording *v, const recording *a);

/// The size of each pivot at a position: those below least_pivot don't serve.
recordings sizes_of_pivots(const recorded_mechanism &, const recording *q);

} // namespace ksl::generate
