// KSL: dynamics for C++ users: the library's kernels, compiled for several instruction sets and chosen once at run time.
// (The templates in ksl/engine/ are the same algorithms for any scalar, compiled by you.)
#pragma once

#include "ksl/dynamics_calls.hpp"

namespace ksl {

/// Reads a URDF file.  Throws description_error with file, line, link or joint, fault and mend: also where links move and none
/// of them has a mass, unless masses_optional.  strict makes errors of the warnings about inertias and masses.
KSL_EXPORT model load(const std::string &urdf_path, const model_options &options = {}, bool mimic_independent = false,
                      bool strict = false, bool masses_optional = false);

/// Reactions of the requested joints into out (request.n, 6), right after inverse_dynamics with the same external
/// wrenches: other calls write to the workspace.
template <class S>
KSL_EXPORT void reactions(const model &m, data &d, const reaction_request &request, S *out,
                          const external_wrenches<S> &external = {});

/// Pose of a link's frame in the world for q (nq).
KSL_EXPORT SE3<double> frame_pose(const model &m, data &d, const double *q, int link);

/// Name of the instruction set whose kernels run: x86-64-v2, x86-64-v3, x86-64-v4, neon or generic.  KSL_ISA in the
/// environment forces one; throws std::runtime_error where it names none that is known and runs here.
KSL_EXPORT const char *instruction_set();

} // namespace ksl
