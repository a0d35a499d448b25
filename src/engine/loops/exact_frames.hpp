// Frames of loop joints that let a mechanism move but for the digits of a file.
//
// A loop with redundant equations moves only if its frames fit exactly: the axes of a planar linkage are parallel, those of a spherical one meet.
// Files have π/2 as 1.5707963, and the equations that should follow from the others are then independent of them by 27 nrad: as numbers stand, the
// mechanism is a rigid structure.  Nobody means that.  Here equations that depend on the others but for `few_digits` are left out, and the mechanism
// is moved.  If it moves, and these equations stay closed up to `few_digits`, the frames of the loops' joints are changed by the least that closes
// them at all positions.  This needs to know no kind of joint or linkage.
#pragma once

#include "engine/loops/tables.hpp"

#include <string>
#include <vector>

namespace ksl::loops {

struct frame_fit {
  bool is_changed = false;        ///< frames of the description have been made exact
  double digits = 0;              ///< tables::digits, where that is not possible
  std::vector<std::string> notes; ///< what has been changed, or what is wrong
};

/// Looks at the loops of a model whose arrays are there, and makes the frames in its description exact.
frame_fit fit_frames(const model &m, tables t, robot_description &robot);

} // namespace ksl::loops
