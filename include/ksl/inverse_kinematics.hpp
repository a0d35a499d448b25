// KSL: inverse kinematics for C++ users, by the library's kernels.
#pragma once

#include "ksl/engine/algorithms/kinematics/inverse_kinematics.hpp"
#include "ksl/model.hpp"

namespace ksl {

/// Finds positions at which frames have the poses of each target of a batch, by damped least squares within the joints' limits.
/// Targets are in the lanes of registers, ranges of them on at most `threads` threads (0: all cores; ksl/batch.hpp); results don't depend on
/// either.  Joints that don't carry the frames keep the start's positions, or zero.  Followers (mimic joints) move with their
/// leaders, and keep their limits.  Arguments are not checked: a target that is not a pose is not reached.  Throws std::bad_alloc, and
/// std::runtime_error for an unusable KSL_ISA; nothing else.
///
/// A target takes about 15 iterations.  Each is O(depth), and solves at most six equations for each frame.
template <class S> KSL_EXPORT void inverse_kinematics(const model &m, const inverse_kinematics_options &options,
                                                      const inverse_kinematics_batch<S> &batch, int threads = 0);

} // namespace ksl
