/* KSL: closed mechanisms from C.  Dynamics are the calls of all models (engine_calls.h), which mean the closed mechanism on a model with
   loops: here are its geometry, motions that keep it closed, and what its reactions leave open.

   Loops' joints are counted from 0, in the order of the description, and have no numbers in q and v.  In requests for reactions their
   numbers follow those of all joints: ksl_model_joints(model) + loop.  Rows are the equations of all loops, 6 − nv of the joint's kind for
   each: those of forces first, m and m/s, then those of moments, rad and rad/s.  No call here allocates, after the first in a thread. */
#ifndef KSL_ENGINE_LOOPS_H
#define KSL_ENGINE_LOOPS_H

#include "ksl/engine_types.h"

KSL_BEGIN_C

/** How many joints close loops, how many equations they have, and the name of one; NULL out of range. */
KSL_EXPORT int ksl_model_loops(const ksl_model_t *model);
KSL_EXPORT int ksl_model_loop_rows(const ksl_model_t *model);
KSL_EXPORT const char *ksl_model_loop_name(const ksl_model_t *model, int loop);

/** Errors (rows) of the equations for q (nq): zero where the loops are closed. */
KSL_EXPORT ksl_status_t ksl_loop_error(const ksl_model_t *model, ksl_data_t *data, const double *q, double *error);

/** Their Jacobian J (rows, nv), row-major: d(error) = J dv at closed positions, and J v = 0. */
KSL_EXPORT ksl_status_t ksl_loop_jacobian(const ksl_model_t *model, ksl_data_t *data, const double *q, double *J);

/** The rate (rows) of J v for q (nq), v (nv) and a (nv): zero for motions that keep the loops closed. */
KSL_EXPORT ksl_status_t ksl_loop_acceleration(const ksl_model_t *model, ksl_data_t *data, const double *q,
                                              const double *v, const double *a, double *acceleration);

typedef struct ksl_mobility_t {
  /** freedoms at the position, independent equations, equations that follow from them */
  int mobility, rank, redundant;
  double smallest; /**< the smallest singular value that counts, relative to the largest term of the equations */
  double next;     /**< the largest one that doesn't, below 1e-9 */
  double length;   /**< m: rows of moments were multiplied by it, coordinates that turn divided */
} ksl_mobility_t;

/** The freedoms at q (nq).  redundant_rows (rows) may be NULL: the equations that follow from the others, `redundant` in number. */
KSL_EXPORT ksl_status_t ksl_mobility(const ksl_model_t *model, ksl_data_t *data, const double *q,
                                     ksl_mobility_t *mobility, int *redundant_rows);

/** Indices (nv) into v of coordinates that the others follow from, ascending; *n gets their number. */
KSL_EXPORT ksl_status_t ksl_independent(const ksl_model_t *model, ksl_data_t *data, const double *q, int *indices,
                                        int *n);

/** The number of force elements of a model, between points of two links; the name of one, NULL if there is none. */
KSL_EXPORT int ksl_model_force_elements(const ksl_model_t *model);
KSL_EXPORT const char *ksl_model_force_element_name(const ksl_model_t *model, int element);
/** The length (m), its rate (m/s) and the tension (N, negative where it pushes) of each at q (nq) and v (nv), NULL for rest; whether the
    model's physics name them or not. */
KSL_EXPORT ksl_status_t ksl_force_element_states(const ksl_model_t *model, const double *q, const double *v,
                                                 double *length, double *rate, double *tension);

/** How a search for a closed position ended. */
typedef enum ksl_closing_t { KSL_CLOSED, KSL_NOT_FOUND, KSL_SINGULAR, KSL_AT_LIMITS, KSL_NOTHING_FREE } ksl_closing_t;

/** The closed position nearest to q (nq) into closed (nq), which may be q, with coordinates of v kept where hold (nv) is true; NULL keeps
    none.  limits: keep the limits of joints.  *end says how the search ended, which is no error; *error, which may be NULL, gets the
    largest component of the error left, m.  Where none is found, closed is the position that is least open. */
KSL_EXPORT ksl_status_t ksl_close(const ksl_model_t *model, ksl_data_t *data, const double *q, const bool *hold,
                                  bool limits, double *closed, ksl_closing_t *end, double *error);

/** Velocities (nv) into out, which may be v, that keep the loops closed at q, with the coordinates where given (nv) is true as in v.  Where
    they leave freedoms, it is the one nearest to v.  KSL_BAD_ARGUMENT: no motion of the mechanism has these coordinates. */
KSL_EXPORT ksl_status_t ksl_consistent_velocity(const ksl_model_t *model, ksl_data_t *data, const double *q,
                                                const double *v, const bool *given, double *out);
/** Accelerations (nv) into out, which may be a, that keep the loops closed at velocities v that do, likewise. */
KSL_EXPORT ksl_status_t ksl_consistent_acceleration(const ksl_model_t *model, ksl_data_t *data, const double *q,
                                                    const double *v, const double *a, const bool *given, double *out);

/** Wrenches that may be added to those of all joints without a change that can be observed, orthonormal over all joints: (*n, joints + loops,
    6) into patterns, which must have room for rows (joints + loops) 6 numbers.  Components that are rounding, or due to few digits of a
    file, are zero in all: they are determined. */
KSL_EXPORT ksl_status_t ksl_reaction_patterns(const ksl_model_t *model, ksl_data_t *data, const double *q,
                                              double *patterns, int *n);

/** Derivatives of inverse dynamics along the mechanism, (nv, freedoms) each, row-major: by the coordinates that ksl_independent lists in q, in
    v and in a, one at a time, while the others follow.  external may be NULL; wrenches are held in their axes. */
KSL_EXPORT ksl_status_t ksl_closed_inverse_dynamics_derivatives(const ksl_model_t *model, ksl_data_t *data,
                                                                const double *q, const double *v, const double *a,
                                                                const ksl_external_t *external, double *by_q,
                                                                double *by_v, double *by_a);
/** Derivatives of forward dynamics along the mechanism: by_q and by_v (nv, freedoms), by_tau (nv, nv). */
KSL_EXPORT ksl_status_t ksl_closed_forward_dynamics_derivatives(const ksl_model_t *model, ksl_data_t *data,
                                                                const double *q, const double *v, const double *tau,
                                                                const ksl_external_t *external, double *by_q,
                                                                double *by_v, double *by_tau);

/** How the motion and the wrenches of joints that close loops vary along the mechanism, from which derivatives of all reactions follow, by
    ksl_reactions_derivatives and ksl_reactions_external_derivatives of the mechanism without loops.  For each coordinate of ksl_independent, in
    q, in v and in a: motions (3, freedoms, 3, nv) are dq, dv and da; on_links (3, freedoms, loops, 2, 6) what the joint exerts on its successor
    and on its predecessor, at their origins in their axes; at_joints (3, freedoms, loops, 6) what its predecessor exerts on its successor, at
    its frame there.  wrenches (loops, 2, 6) are those on links themselves.  Of redundant equations some multipliers are zero, and only what
    rigid bodies determine has a meaning.  external may be NULL; wrenches are held in their axes. */
KSL_EXPORT ksl_status_t ksl_closed_reaction_variations(const ksl_model_t *model, ksl_data_t *data, const double *q,
                                                       const double *v, const double *a, const ksl_external_t *external,
                                                       double *motions, double *on_links, double *at_joints,
                                                       double *wrenches);

/** Accelerations a (nv) under efforts tau (nv), which correct errors e of the loops by ë + 2 alpha ė + beta² e = 0 (Baumgarte); gains in 1/s.
    Positions and velocities may be off by 1e-2 of the mechanism's length, or of the terms of their equation.  external may be NULL. */
KSL_EXPORT ksl_status_t ksl_stabilised_forward_dynamics(const ksl_model_t *model, ksl_data_t *data, const double *q,
                                                        const double *v, const double *tau,
                                                        const ksl_external_t *external, double alpha, double beta,
                                                        double *a);

KSL_END_C

#endif
