// Algorithms recorded for models with mimic joints, as engine/mimic computes them.
#pragma once

#include "engine/kernels/algorithm_rows.hpp"
#include "generate/recording.hpp"
#include "ksl/model.hpp"

namespace ksl::generate {

/// Can the row be recorded for a model with mimic joints?
bool has_recording_with_followers(const algorithm_row &);

/// Records one state of a row with kernels of its own, in the numbers of users.  view: of the expanded mechanism.  single: constants are those of the model in
/// single precision.
void record_with_followers(const algorithm_row &, const model &, bool single, const model_view<recording> &view,
                           const state_view<recording> &);

} // namespace ksl::generate
