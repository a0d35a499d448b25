// Algorithms recorded for models with mimic joints, as engine/mimic computes them.
//
// The expanded mechanism, ^, has a coordinate for each joint.  With q̂_f = multiplier q_leader + offset where f follows, and q̂ = q elsewhere,
//
//     v̂ = G v,   â = G a,   τ = Gᵀ τ̂,   M = Gᵀ M̂ G.
//
// Either an algorithm is recorded over the expanded mechanism and its results are reduced (projection), or it solves a system with M (systems).
#pragma once

#include "engine/kernels/algorithm_rows.hpp"
#include "generate/recording.hpp"
#include "ksl/model.hpp"

#include <vector>

namespace ksl::generate {

/// A user's position in the expanded mechanism; the same where no joint follows another.
recordings expanded_position(const model &, bool single, const recording *q);

/// A user's velocity or acceleration in the expanded mechanism.
recordings expanded_motion(const model &, bool single, const recording *v);
/// Where a user's velocities are in those of the expanded mechanism.
std::vector<int> own_coordinates(const model &);

/// Records one state of a row with kernels of its own, in the numbers of users.  view: of the expanded mechanism.  single: constants are those of the model in
/// single precision.
void record_with_followers(const algorithm_row &, const model &, bool single, const model_view<recording> &view,
                           const state_view<recording> &);

} // namespace ksl::generate
