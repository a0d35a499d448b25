// The numbers of URDF elements as poses, inertias and axes.
#pragma once

#include "load/element.hpp"

#include "ksl/algebra.hpp"

namespace ksl::load {

/// The pose in the <origin> of `parent`, identity if there is none.  `minor` is the URDF version 1.minor: from 1.1 on a
/// quaternion may be given instead of the angles.
SE3<double> origin_in(const element &parent, int minor);

/// An <inertial> about the link's origin in the link's axes: R I Rᵀ + m (c·c 1 − c cᵀ).
spatial_inertia<double> inertia_in(const element &inertial, int minor);

/// The unit vector in the <axis> of a joint, (1, 0, 0) if there is none.
vec3<double> axis_in(const element &joint);

/// The unit vector in the <axis2> of a universal joint, which must be there.
vec3<double> axis2_in(const element &joint);

/// The pitch of a helical joint in m/rad, from <screw_thread_pitch value="metres per revolution"/>; positive is right-handed.
/// The element is that of SDF 1.10.  `tag` may be <drake:screw_thread_pitch> instead, as Drake has it.
double pitch_in(const element &joint, const char *tag);

} // namespace ksl::load
