// The plan of a model's elimination (ksl/engine/model/loop_view.hpp).
#pragma once

#include "ksl/engine/model/loop_plan.hpp"

#include <memory>

namespace ksl {
class model;
}

namespace ksl::loops {

/// A plan made at a closed position near the neutral one; null if there is none.  States of such models are computed without one.
std::shared_ptr<const loop_plan<double>> make_plan(const model &m);

/// The same in single precision.
std::shared_ptr<const loop_plan<float>> rounded(const loop_plan<double> &plan);

} // namespace ksl::loops
