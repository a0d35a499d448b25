// Parses the values in SDF files that need more than a number: poses, inertias, flags.
#pragma once

#include "text/element.hpp"

#include "ksl/engine/model/description.hpp"

namespace ksl::readers::sdf {

using text::element;

/// A <pose> as it stands in the file.
struct given_pose {
  SE3<double> pose{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  given_rotation rotation;
  std::string relative_to; ///< empty: not given
};

/// The <pose> of an element, the identity if there is none: x y z roll pitch yaw; degrees="true" and rotation_format="quat_xyzw"
/// came with SDF 1.9.
given_pose pose_in(const element &parent);

/// The text of a child element; empty if there is none.
std::string text_in(const element &parent, const char *tag);

/// A child element with true, false, 1 or 0; `otherwise` if there is none.
bool flag_in(const element &parent, const char *tag, bool otherwise);

/// The number in a child element; empty if there is none.  SDF writes inf where there is no bound, which is empty, too.
optional_number number_in(const element &parent, const char *tag);

/// An <inertial>.  What it leaves out is appended to `missing`; SDF has a mass of 1 kg and moments of 1 kg m² for it.
given_inertia inertia_in(const element &inertial, std::vector<std::string> &missing);

} // namespace ksl::readers::sdf
