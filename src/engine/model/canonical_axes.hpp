// Chooses the direction of x in the canonical frames of a model (docs/decisions/0007-turns.md).
#pragma once

#include "ksl/engine/model/model.hpp"

#include <vector>

namespace ksl {

inline constexpr SE3<double> identity = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};

/// A rotation whose third column is the unit vector z.  Exact for the six coordinate directions.
mat3x3<double> frame_with_z(const vec3<double> &z);

/// Rotates every canonical frame about its z axis, and factors the placements of joints into rotations about coordinate axes.
/// The frames of the ground and of bodies with a coordinate along or about x or y are left as they are.
void choose_canonical_axes(std::vector<body<double>> &bodies, std::vector<link<double>> &links);

} // namespace ksl
