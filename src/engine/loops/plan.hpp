// The plan of a model's elimination (ksl/engine/model/loop_view.hpp).
#pragma once

#include "engine/loops/tables.hpp"
#include "ksl/engine/model/loop_plan.hpp"

namespace ksl::loops {

/// A plan made at a closed position near the neutral one.  Empty if there is none, and for what plans don't know: joints that follow others.
/// Such models are computed without one.
loop_plan<double> make_plan(const model &m);

/// The same in single precision.
loop_plan<float> rounded(const loop_plan<double> &plan);

} // namespace ksl::loops
