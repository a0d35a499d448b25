// Which way x points in the canonical frames of a model (docs/decisions/0007-turns.md).
#pragma once

#include "ksl/engine/model.hpp"

#include <vector>

namespace ksl {

inline constexpr SE3<double> identity = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};

/// Does the joint move along or about an axis?
bool has_axis(joint_kind kind);

/// Turns every canonical frame about its z axis, and takes the placements of joints apart into turns.  The frames of the ground
/// and of what floats stay.
void choose_canonical_axes(std::vector<body<double>> &bodies, std::vector<link<double>> &links);

} // namespace ksl
