// KSL: dynamics for C++ users: the library's kernels, compiled for several instruction sets, one of which is chosen at run time.
// (The templates in ksl/engine/ are the same algorithms for any scalar, compiled as part of the user's program.)
#pragma once

#include "ksl/dynamics_calls.hpp"

namespace ksl {

/// How a robot file is read and judged: load("arm.urdf", {}, {.strict = true}).
struct load_options {
  /// A mimic joint follows its leader and has no numbers in q and v; if this is set, it has numbers of its own.
  bool mimic_independent = false;
  bool strict = false;          ///< warnings about inertias and masses are errors
  bool masses_optional = false; ///< moving links of which none has a mass are no error
  std::string model = {};       ///< which model of an SDF file with several
  bool cut_loops = false;       ///< joints that close loops are left out: the tree, which is another machine
};

/// Reads a URDF or an SDF file; its root element says which.  Throws description_error, whose message names file, line, link or joint,
/// what is wrong and how to mend it.  options.gravity, if it is not given, is that of the world in an SDF file.  The root of an SDF
/// model is a link `world`; links that no joint carries float on it.
KSL_EXPORT model load(const std::string &path, const model_options &options = {}, const load_options &how = {});

/// Reads the contents of such a file from memory.  `name` stands for the file in messages and in
/// robot_description::file.
KSL_EXPORT model load_text(const std::string &text, const model_options &options = {}, const load_options &how = {},
                           const std::string &name = "<string>");

/// Reactions of the requested joints into out (request.n, 6).  Call it right after inverse_dynamics with the same external
/// wrenches: other calls overwrite the workspace.
template <class S>
KSL_EXPORT void reactions(const model &m, data &d, const reaction_request &request, S *out,
                          const external_wrenches<S> &external = {});

/// Pose of a link's frame in the world for q (nq).
KSL_EXPORT SE3<double> frame_pose(const model &m, data &d, const double *q, int link);

/// The neutral position into q (nq): zeros, and quaternions of no rotation.  Limits of joints may exclude it.
template <class S> KSL_EXPORT void neutral(const model &m, S *q);

/// A random position into q (nq), from nq independent numbers, each uniform in [0, 1): uniform in m.position_ranges(), the lower end
/// excluded, and quaternions uniform on the sphere (Shoemake, Uniform random rotations, Graphics Gems III (1992), p. 124).
template <class S> KSL_EXPORT void random_position(const model &m, const S *uniform, S *q);

/// Name of the instruction set in use: x86-64-v2, x86-64-v3, x86-64-v4, neon or generic.  The environment variable KSL_ISA
/// selects one.  Throws std::runtime_error if it names a set that is unknown or doesn't run here.
KSL_EXPORT const char *instruction_set();

} // namespace ksl
