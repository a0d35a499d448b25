// KSL: dynamics for C++ users: the library's kernels, compiled for several instruction sets and chosen once at run time.
// (The templates in ksl/engine/ are the same algorithms for any scalar, compiled by you.)
#pragma once

#include "ksl/engine/reactions.hpp"
#include "ksl/model.hpp"

namespace ksl {

/// Reads a URDF file.  Throws description_error with file, line, link or joint, fault and mend: also where links move and none
/// of them has a mass, unless masses_optional.  strict makes errors of the warnings about inertias and masses.
KSL_EXPORT model load(const std::string &urdf_path, const model_options &options = {}, bool mimic_independent = false,
           bool strict = false, bool masses_optional = false);

/// Joint efforts tau (nv) for q (nq), v (nv), a (nv), under gravity and external wrenches.  No allocation.
KSL_EXPORT void inverse_dynamics(const model &m, data &d, const double *q, const double *v, const double *a, double *tau,
                      const external_wrenches<double> &external = {});

/// Reactions of the requested joints into out (request.n, 6), right after inverse_dynamics with the same external
/// wrenches: other calls write to the workspace.
KSL_EXPORT void reactions(const model &m, data &d, const reaction_request &request, double *out,
               const external_wrenches<double> &external = {});

/// Both at once, which costs less: the reactions of moving joints, in their own frames and in the joints' order, are written
/// as inverse dynamics finds them.
KSL_EXPORT void inverse_dynamics_with_reactions(const model &m, data &d, const double *q, const double *v, const double *a,
                      double *tau, const reaction_request &request, double *out,
                      const external_wrenches<double> &external = {});

/// Accelerations a (nv) for q (nq), v (nv) and joint efforts tau (nv), under gravity and external wrenches, by the
/// articulated-body algorithm.  No allocation.
KSL_EXPORT void forward_dynamics(const model &m, data &d, const double *q, const double *v, const double *tau, double *a,
                      const external_wrenches<double> &external = {});

/// Mass matrix M (nv, nv), row-major, both triangles, for q (nq), by the composite-rigid-body algorithm.
KSL_EXPORT void mass_matrix(const model &m, data &d, const double *q, double *M);

/// Efforts (nv) that hold velocities v (nv) without acceleration: M a + bias = tau without external wrenches.
KSL_EXPORT void bias(const model &m, data &d, const double *q, const double *v, double *tau,
          const external_wrenches<double> &external = {});

/// Efforts (nv) that hold the mechanism at rest at q (nq).
KSL_EXPORT void gravity_torque(const model &m, data &d, const double *q, double *tau, const external_wrenches<double> &external = {});

/// Pose of a link's frame in the world for q (nq).
KSL_EXPORT SE3<double> frame_pose(const model &m, data &d, const double *q, int link);

/// Poses of n links in the world into out (n, 4, 4), each row-major, for q (nq).  No allocation.
KSL_EXPORT void frame_poses(const model &m, data &d, const double *q, int n, const int *links, double *out);

/// Kinetic and potential energy, J; the latter zero with every centroid at the world's origin.
KSL_EXPORT void energy(const model &m, data &d, const double *q, const double *v, double *kinetic, double *potential);

/// Σ f · v of the links on which the environment exerts wrenches, W.
KSL_EXPORT double external_power(const model &m, data &d, const double *q, const double *v,
                      const external_wrenches<double> &external);

/// Name of the instruction set whose kernels run: x86-64-v2, x86-64-v3, x86-64-v4, neon or generic.  KSL_ISA in the
/// environment forces one; throws std::runtime_error where it names none that is known and runs here.
KSL_EXPORT const char *instruction_set();

} // namespace ksl
