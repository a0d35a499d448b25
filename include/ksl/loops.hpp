// KSL: mechanisms with loops: whether they are closed, which freedoms they have, and motions that keep them closed.
//
// Dynamics are those of all models (dynamics.hpp): on a model with loops they mean the closed mechanism.  Here, too, an argument that is
// not closed, or not finite, is an error of the caller; calls in C and Python check it.  Numbers are in double precision.  Rows are the
// equations of all loops, 6 − nv of the joint's kind for each, in the order of model::loops(): those of forces first, m and m/s, then
// those of moments, rad and rad/s.  No call allocates, unless it says so.
#pragma once

#include "ksl/engine/steps/external_wrenches.hpp"
#include "ksl/model.hpp"

#include <vector>

namespace ksl {

/// How many equations the loops have.
KSL_EXPORT int loop_rows(const model &m);

/// error (rows): zero where the loops are closed.  Of what the joints' best positions leave of the displacement between the two frames of
/// each joint, the components that the joint resists.
KSL_EXPORT void loop_error(const model &m, data &d, const double *q, double *error);

/// J (rows, nv): d(error) = J dv at closed positions.
KSL_EXPORT void loop_jacobian(const model &m, data &d, const double *q, double *J);

/// acceleration (rows): the rate of J v, J a + J̇ v: zero for motions that keep the loops closed.
KSL_EXPORT void loop_acceleration(const model &m, data &d, const double *q, const double *v, const double *a,
                                  double *acceleration);

/// What the singular values of J say, with rows of moments multiplied and coordinates that turn divided by `length`, so that all are
/// lengths.  A value counts as zero below 1e-9 of the largest term that enters J before terms cancel.
struct loop_mobility {
  int mobility;    ///< freedoms at the position, nv − rank
  int rank;        ///< independent equations
  int redundant;   ///< rows − rank
  double smallest; ///< the smallest singular value that counts, relative to that term; 0 for rank 0
  double next;     ///< the largest one that doesn't; 0 if there is none
  double length;   ///< m
};
/// redundant_rows (rows), may be null: the equations that follow from the others, `redundant` in number.
KSL_EXPORT loop_mobility mobility(const model &m, data &d, const double *q, int *redundant_rows = nullptr);

/// Indices into v of coordinates that the others follow from, ascending; returns how many they are.  Those of the drives where they are as
/// many as the freedoms and determine the motion, else those with the largest pivots left over.
KSL_EXPORT int independent(const model &m, data &d, const double *q, int *indices);

/// How a completed motion was found.
enum class completion {
  unique,       ///< the given coordinates determine it
  nearest,      ///< they leave freedoms: it is the one nearest to what was passed, in the sum of squares of SI numbers
  contradictory ///< no motion of the closed mechanism has these coordinates
};
/// out (nv): velocities that keep the loops closed, with the coordinates that are given (nv flags) as they are in v.
KSL_EXPORT completion consistent_velocity(const model &m, data &d, const double *q, const double *v,
                                          const unsigned char *given, double *out);
/// out (nv): accelerations that keep the loops closed, likewise, at velocities v that do.
KSL_EXPORT completion consistent_acceleration(const model &m, data &d, const double *q, const double *v,
                                              const double *a, const unsigned char *given, double *out);

/// How a search for a closed position ended.
enum class closing {
  closed,
  not_found,   ///< searches from all starts ended where the error is not zero: there may be a closed position or none
  singular,    ///< the search ended where the equations lose rank
  limits,      ///< it ended at limits of joints
  nothing_free ///< the joints to hold leave nothing that can move
};
struct close_options {
  bool limits = false;  ///< keep the limits of joints
  int iterations = 100; ///< at most, from each start
  /// at most: q, and where the search from it ends open others, the same in every call; 1: closed positions near q alone
  int starts = 32;
};
/// For motions, which may not change over to another way of assembly.
inline constexpr close_options nearby = {.starts = 1};
/// out (nq): a closed position near q, with the joints' coordinates that are to be held (nv flags) kept: one where Σ (difference)² is
/// stationary, converged to 1e-12 of the mechanism's length, or to the rounding of larger numbers, up to 1e-9.  error: the largest
/// component left, in m, angles times the length.  Where none is found, out is the position with the smallest error.  Gauss–Newton steps with a line search, then steps along the closed positions.
KSL_EXPORT closing close(const model &m, data &d, const double *q, const unsigned char *hold,
                         const close_options &options, double *out, double *error);

/// A link that turns alone about a line that is fixed in it, while the drives and all other bodies stand still.  If its mass is the same all round the line,
/// is_even, it is idle, as a rod with balls at both ends is: it needs no drive.
struct lone_body {
  int link;               ///< index into model::links()
  vec3<double> direction; ///< of the line, in the link's axes; a unit vector
  bool is_even;
};
/// The lone bodies of a model whose drives are known, found when it was made.
KSL_EXPORT std::vector<lone_body> lone_bodies(const model &m);

/// patterns: wrenches that may be added to those of all joints without a change that can be observed, orthonormal over all joints in N and
/// N m, each at its frame on the side called child: (redundant, joints().size() + loops().size(), 6).  Components
/// that no combination of them reaches with open_component(m) are zero in all: they are determined.  Returns their number.
KSL_EXPORT int reaction_patterns(const model &m, data &d, const double *q, double *patterns);
/// Elements of patterns, expressed in whatever axes, from which on a component counts as open: 1e-9, or ten times the digits of a file's joints.
KSL_EXPORT double open_component(const model &m);

/// Derivatives of inverse dynamics along the mechanism, (nv, freedoms) each: by the coordinates that independent() lists in q, in v and in
/// a, one at a time, while the others follow.  Rows of joints without a motor are zero.  External wrenches are held in their axes.  Returns the
/// number of freedoms.  Throws result_error, which allocates, for a state that is not closed, and unless there are as many drives as freedoms.
KSL_EXPORT int closed_inverse_dynamics_derivatives(const model &m, data &d, const double *q, const double *v,
                                                   const double *a, const external_wrenches<double> &external,
                                                   double *by_q, double *by_v, double *by_a);

/// Derivatives of forward dynamics along the mechanism: by_q and by_v (nv, freedoms), by_tau (nv, nv).
KSL_EXPORT int closed_forward_dynamics_derivatives(const model &m, data &d, const double *q, const double *v,
                                                   const double *tau, const external_wrenches<double> &external,
                                                   double *by_q, double *by_v, double *by_tau);

/// How the motion and the wrenches of joints that close loops vary along the mechanism, from which derivatives of all reactions follow.  For
/// each coordinate of independent(), in q, in v and in a: motions (3, freedoms, 3, nv) are dq, dv and da; on_links (3, freedoms, loops, 2, 6)
/// what the joint exerts on its successor and on its predecessor, at their origins in their axes; at_joints (3, freedoms, loops, 6) what its
/// predecessor exerts on its successor, at its frame there.  wrenches (loops, 2, 6) are those on links themselves.  Of redundant equations some
/// multipliers are zero, and only what rigid bodies determine has a meaning.  Throws as closed_inverse_dynamics_derivatives.
KSL_EXPORT void closed_reaction_variations(const model &m, data &d, const double *q, const double *v, const double *a,
                                           const external_wrenches<double> &external, double *motions, double *on_links,
                                           double *at_joints, double *wrenches);

/// Gains of a correction of constraint errors e: ë + 2 α ė + β² e = 0 (Baumgarte, Computer Methods in Applied Mechanics and Engineering 1,
/// 1972, p. 1).  α = β is critically damped: errors decay with e^(−α t).
struct stabilisation {
  double alpha, beta; ///< 1/s, not negative
};
/// Accelerations a (nv) under efforts tau (nv), of states whose positions and velocities keep the loops closed up to 1e-2 of the mechanism's
/// length, or of the terms of their equation.  They correct these errors, with the independent coordinates free to move as the efforts want.
/// Without errors they are those of forward_dynamics.  Throws result_error, which allocates, for larger errors.
KSL_EXPORT void stabilised_forward_dynamics(const model &m, data &d, const double *q, const double *v,
                                            const double *tau, const external_wrenches<double> &external,
                                            const stabilisation &gains, double *a);

} // namespace ksl
