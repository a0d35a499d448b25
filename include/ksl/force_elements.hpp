// KSL: what springs, dampers and cylinders between points of two links do at a state.
#pragma once

#include "ksl/model.hpp"

namespace ksl {

/// The length (m), its rate (m/s) and the tension (N, negative where it pushes) of each of the model's force elements, whether physics_options
/// name them or not, each (m.force_elements().size()); v null is rest.  Throws result_error, which allocates, where an element has no
/// force: its points coincide, or its length is beyond a limit without a stop.
KSL_EXPORT void force_element_states(const model &m, const double *q, const double *v, double *length, double *rate,
                                     double *tension);

} // namespace ksl
