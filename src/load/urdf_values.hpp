// The numbers of URDF elements as poses, inertias and axes, and as they are given (given.hpp).
#pragma once

#include "text/element.hpp"

#include "ksl/engine/model/description.hpp"

namespace ksl::readers {

using text::element;

/// The pose in the <origin> of `parent`, identity if there is none; `rotation` is then how its rotation is given.  `minor` is the
/// URDF version 1.minor: from 1.1 on a quaternion may be given instead of the angles.
SE3<double> origin_in(const element &parent, int minor, given_rotation &rotation);

/// The pose in the attributes xyz and rpy, or quat_xyzw, of an element.
SE3<double> pose_in(const element &origin, int minor, given_rotation &rotation);

/// An <inertial>.
given_inertia inertia_in(const element &inertial, int minor);

/// The vector in the xyz of an axis, which is not zero.
vec3<double> direction_in(const element &axis);

/// The vector in the <axis> of a joint, which is not zero; (1, 0, 0) if there is none.
vec3<double> axis_in(const element &joint);

/// The vector in the <axis2> of a universal joint, which must be there and is not zero.
vec3<double> axis2_in(const element &joint);

/// The pitch of a helical joint in metres a revolution, from <screw_thread_pitch value="..."/>; positive is right-handed.
/// The element is that of SDF 1.10.  `tag` may be <drake:screw_thread_pitch> instead, as Drake has it.
double pitch_in(const element &joint, const char *tag);

} // namespace ksl::readers
