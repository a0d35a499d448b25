// The plan of a model's elimination (ksl/engine/model/loop_view.hpp).
#pragma once

#include "ksl/engine/model/loop_plan.hpp"

#include <memory>
#include <vector>

namespace ksl {
class model;
}

namespace ksl::loops {

/// Of closed positions near the neutral one and some others, one with the highest rank, at which coordinates that are kept and are as many as the
/// freedoms determine the motion, if there is one: the first that isn't nearly singular, else that with the largest last pivot; empty if none is closed.
std::vector<double> regular_position(const model &m);

/// A plan made at a regular position; null if there is none.  States of such models are computed without one.
std::shared_ptr<const loop_plan<double>> make_plan(const model &m, const std::vector<double> &q);

/// The plan in single precision.
std::shared_ptr<const loop_plan<float>> rounded(const loop_plan<double> &plan);

} // namespace ksl::loops
