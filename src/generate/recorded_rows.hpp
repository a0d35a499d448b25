// Every row of api/algorithms/ over recordings.
#pragma once

#include "engine/kernels/algorithm_rows.hpp"
#include "generate/recording.hpp"

namespace ksl::generate {

using record_row = void (*)(const model_view<recording> &, const state_view<recording> &);

/// Records one state of an algorithm.  Where reactions are a result beside others, they are the last one, of the joints of the state.
/// Null for rows that are private.
record_row recorder_of(const char *row);

} // namespace ksl::generate
