// Parses the values in SDF files that need more than a number: poses, inertias, flags.
#pragma once

#include "text/element.hpp"

#include "ksl/engine/model/description.hpp"

namespace ksl::readers::sdf {

using text::element;

/// SDF 1.minor, and what was other in it than in 1.10: http://sdformat.org/tutorials?tut=pose_frame_semantics_proposal lists what 1.7
/// changed, the notes on migration of libsdformat the rest.
struct version {
  int minor = 10;

  /// Before 1.7 a frame is named by frame= and by <use_parent_model_frame>; links and joints may have the same name, and any name
  /// is allowed but world.
  bool has_old_frames() const { return minor < 7; }
  /// In 1.4 axes are in the model's frame; from 1.5 on in the joint's, unless <use_parent_model_frame> is true.
  bool has_axes_in_model() const { return minor < 5; }
  /// Before 1.6 <gravity> is in <physics>.
  bool has_gravity_in_physics() const { return minor < 6; }
};

/// A <pose> as it stands in the file.
struct given_pose {
  SE3<double> pose{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  given_rotation rotation;
  std::string relative_to; ///< empty: not given
};

/// The <pose> of an element, the identity if there is none: x y z roll pitch yaw; degrees="true" and rotation_format="quat_xyzw"
/// came with SDF 1.9.  Before SDF 1.7 relative_to is called frame.
given_pose pose_in(const element &parent, version of_file);

/// The text of a child element; empty if there is none.
std::string text_in(const element &parent, const char *tag);

/// A child element with true, false, 1 or 0; `otherwise` if there is none.
bool flag_in(const element &parent, const char *tag, bool otherwise);

/// The number in a child element, which is finite; empty if there is none.
optional_number number_in(const element &parent, const char *tag);

/// A limit in a child element: SDF writes inf where there is no bound, which is empty, too.
optional_number limit_in(const element &parent, const char *tag);

/// An <inertial>.  What it leaves out is appended to `missing`; SDF has a mass of 1 kg and moments of 1 kg m² for it.
given_inertia inertia_in(const element &inertial, version of_file, std::vector<std::string> &missing);

} // namespace ksl::readers::sdf
