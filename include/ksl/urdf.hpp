// KSL: robots as URDF text.
#pragma once

#include "ksl/engine/model/description.hpp"

namespace ksl {

/// The robot as URDF.  Numbers have the fewest digits that give the same double; what was read from a URDF file is
/// written as it was read, so that the model of the text has the same bits.  Kinds that URDF doesn't have are written
/// under their names, which KSL reads. Not written: what KSL doesn't read (geometry, transmissions, …; a comment lists
/// it), gravity, and whether the base floats.
KSL_EXPORT std::string urdf_text(const robot_description &robot);

/// Writes that to a file, in whose place it appears complete or not at all.  It is written beside it first, under a
/// name that no other file has.  Throws description_error if that fails.
KSL_EXPORT void write_urdf(const robot_description &robot, const std::string &path);

} // namespace ksl
