/* KSL: mechanisms in motion from C: forward dynamics over time, of trees and of mechanisms with loops, one run or many, without contact.

   ksl_simulate allocates: it is for programs that plan and test, not for control loops.  Arrays belong to the caller. */
#ifndef KSL_ENGINE_SIMULATE_H
#define KSL_ENGINE_SIMULATE_H

#include "ksl/engine_types.h"

KSL_BEGIN_C

/** How time is stepped; docs/simulation.md says what each costs and keeps. */
typedef enum ksl_stepping_t {
  KSL_SEMI_IMPLICIT_EULER, /**< order 1, in lanes: many runs at once */
  KSL_RK4,                 /**< order 4, in lanes */
  KSL_RKMK4,               /**< order 4, in lanes */
  KSL_DOP853,              /**< order 8, with error control */
  KSL_SDIRK4,              /**< order 4, implicit, for stiff springs and gains */
  KSL_VARIATIONAL          /**< order 2, whose energy has no trend */
} ksl_stepping_t;

/** Rows of numbers at some times, straight lines between them; with one row, it holds always.  n = 0: absent. */
typedef struct ksl_rows_over_time_t {
  size_t n;
  const double *times; /**< (n), increasing, s */
  const double *rows;  /**< (n, columns), or (runs, n, columns) */
  size_t run_stride;   /**< numbers between those of two runs; 0: all runs have the same */
} ksl_rows_over_time_t;

/** Efforts tau (n, nv) of n runs, of which `first` is the first, at time t and states q (n, nq) and v (n, nv).  false ends the runs. */
typedef bool (*ksl_effort_function_t)(void *context, size_t first, size_t n, double t, const double *q, const double *v,
                                      double *tau);

/** What drives the joints:

        tau = given + gravity + stiffness (q_d − q) + damping (v_d − v),          or, with computed torque,
        tau = given + ID(q, v, a_d + stiffness (q_d − q) + damping (v_d − v)),

    within ± limit.  Positions of the motion asked for are cubic between its times. */
typedef struct ksl_drive_law_t {
  ksl_rows_over_time_t given;                  /**< efforts (nv) */
  bool holds_gravity;                          /**< adds the efforts of gravity */
  bool computed_torque;                        /**< ID is inverse dynamics */
  ksl_rows_over_time_t position;               /**< q_d (nq) */
  ksl_rows_over_time_t velocity, acceleration; /**< v_d and a_d (nv) at the same times; absent: zero */
  const double *stiffness, *damping;           /**< (nv); NULL: zero.  They need positions, as computed torque does */
  const double *limit;                         /**< (nv); NULL: none */
  const bool *driven;                          /**< (nv) which coordinates have a drive; NULL: all */
  ksl_effort_function_t function; /**< instead of all this; may be called by several threads if threads is not 1 */
  void *context;
} ksl_drive_law_t;

/** What stops and holds joints exactly; not with KSL_VARIATIONAL. */
typedef struct ksl_exact_laws_t {
  /** (nv) v after an impact on a limit is −restitution v; negative: no limits.  NULL: no limits at all */
  const double *restitution;
  const double *lower, *upper; /**< (nv) the limits, may be infinite */
  const double *friction;      /**< (nv) dry friction that sticks and slips, N m or N; NULL: none */
  const double *brake;         /**< (nv) what brakes add to it from brake_at on; NULL: none */
  double brake_at;             /**< s */
  bool cut_efforts;            /**< are the drives without effort from then on */
} ksl_exact_laws_t;

/** Values (events_n) of functions at time t and q (nq), v (nv), whose zeros are events.  false ends the run. */
typedef bool (*ksl_event_function_t)(void *context, size_t run, double t, const double *q, const double *v,
                                     double *values);

/** One of these functions. */
typedef struct ksl_event_rule_t {
  int direction; /**< 1: only where it rises through zero; −1: only where it falls; 0: both */
  bool ends;     /**< does the run end there */
} ksl_event_rule_t;

/** Is told, after each step, the time that run `first`, or runs in lanes from it on, have reached.  false ends them. */
typedef bool (*ksl_step_function_t)(void *context, size_t first, double t);

/** What is simulated.  Initialise it with ksl_simulation(), which sets all but the first five members. */
typedef struct ksl_simulation_t {
  size_t runs;
  const double *q, *v; /**< (runs, nq), (runs, nv) at times[0] */
  size_t times_n;
  const double *times; /**< (times_n), increasing: when results are wanted, s */
  ksl_stepping_t method;
  double step; /**< s, at most; of methods without error control */
  /** error of a step of KSL_DOP853: absolute + relative |number|; with loops both are at most 1e-8 */
  double relative, absolute;
  size_t most_steps; /**< of a run */
  ksl_drive_law_t drives;
  bool project;                      /**< are mechanisms with loops moved to the nearest closed state after each step */
  int threads;                       /**< 0: all cores that the process may use */
  int events_n;                      /**< the functions may be called by several threads if threads is not 1 */
  const ksl_event_rule_t *events;    /**< (events_n) */
  ksl_event_function_t event_values; /**< of all of them */
  void *event_context;
  ksl_step_function_t after_step; /**< may be called by several threads if threads is not 1; NULL: none */
  void *step_context;
} ksl_simulation_t;
KSL_EXPORT ksl_simulation_t ksl_simulation(void);

/** How a run ended. */
typedef enum ksl_ending_t {
  KSL_COMPLETE,
  KSL_ENDED_BY_EVENT,
  KSL_STOPPED, /**< by a function that returned false */
  KSL_STEP_UNDERFLOW, /**< the step that the error allows is too small to change the time, or 10,000 of them by a billionth of the run */
  KSL_TOO_MANY_STEPS,
  KSL_RUN_NOT_FINITE, /**< numbers overflow, or a function gave NaN */
  KSL_NOT_SOLVED,     /**< implicit equations of a step have no solution nearby */
  KSL_NOT_CLOSED,     /**< no closed position was found from where a step ended */
  KSL_ENDLESS_EVENTS  /**< events follow each other at one instant without end */
} ksl_ending_t;
typedef struct ksl_run_end_t {
  ksl_ending_t how;
  double time;                         /**< until here, s */
  size_t steps, rejected, evaluations; /**< evaluations: of forward dynamics */
  int coordinate;                      /**< with the largest error, or the first number that isn't finite; −1 */
  int element;                         /**< the force element that had no force where numbers were not finite; −1 */
} ksl_run_end_t;

/** What happened at an instant: KSL_AT_LOWER_LIMIT and KSL_AT_UPPER_LIMIT are impacts; KSL_RESTS: the joint lies on its limit from now on. */
typedef enum ksl_happening_t {
  KSL_AT_LOWER_LIMIT,
  KSL_AT_UPPER_LIMIT,
  KSL_RESTS,
  KSL_LIFTS,
  KSL_STICKS,
  KSL_SLIPS,
  KSL_BRAKES,
  KSL_AT_SINGULAR, /**< the loops pass a position at which their equations lose rank */
  KSL_AT_EVENT     /**< a function passes zero */
} ksl_happening_t;
typedef struct ksl_simulated_event_t {
  size_t run;
  double time;
  ksl_happening_t what;
  int coordinate; /**< in v, or the number of the function; −1: of brakes and singular positions */
  double speed;   /**< of the coordinate after it */
} ksl_simulated_event_t;

/** Where results are written; each may be NULL.  Rows after the end of a run are NaN. */
typedef struct ksl_simulation_results_t {
  double *q, *v, *a, *tau;     /**< (runs, times, nq or nv) */
  double *kinetic, *potential; /**< (runs, times) J */
  double *work;                /**< (runs, times) J that efforts, external wrenches and dissipation have put in */
  double *momentum;            /**< (runs, times, 6) about the centre of mass, world axes, linear first */
  double *closure; /**< (runs, times) the largest opening of a loop since the time before, ahead of its projection, m */
  ksl_run_end_t *ends;           /**< (runs) */
  ksl_simulated_event_t *events; /**< (events_room) of each run in order of time, the runs in order */
  size_t events_room;
  size_t events_n; /**< set to how many there were, which may be more than there is room for */
} ksl_simulation_results_t;

/** Simulates.  laws may be NULL: none; external may be NULL: constant wrenches, the same for all runs.  Runs don't depend on each other nor
    on threads: the same bits.  A run that ends early is no error: ends says why.  Starts of mechanisms with loops must be closed. */
KSL_EXPORT ksl_status_t ksl_simulate(const ksl_model_t *model, const ksl_simulation_t *task,
                                     const ksl_exact_laws_t *laws, const ksl_external_t *external,
                                     ksl_simulation_results_t *results);

KSL_END_C

#endif
