// What the numbers of a file or a program mean: rotations, inertias, axes, pitches.  Readers, the builder and the
// writer compute them by these functions, hence with the same bits.
#pragma once

#include "ksl/engine/model/description.hpp"

namespace ksl::given {

/// The rotation matrix; the identity if nothing is given.  Angles are about fixed axes, x first: Rz(yaw) Ry(pitch)
/// Rx(roll). A quaternion is divided by its length.
mat3x3<double> rotation_of(const given_rotation &rotation);

/// About the link's origin in the link's axes: R I Rᵀ + m (c·c 1 − c cᵀ).
spatial_inertia<double> inertia_of(const given_inertia &inertia);

/// The unit vector in the direction of one that is not zero, also where squares would overflow or underflow.
vec3<double> direction_of(const vec3<double> &axis);

/// In m/rad, from metres a revolution.
double pitch_of(double metres_a_revolution);

} // namespace ksl::given
