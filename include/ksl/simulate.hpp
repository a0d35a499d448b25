// KSL: mechanisms in motion: forward dynamics over time, of trees and of mechanisms with loops, one run or many, without contact.
//
// The state of a run is (q, v).  Positions move along the joints' manifolds: a step is a joint velocity u, and q = q₀ ⊕ u
// (engine/algorithms/manifold/manifold.hpp).  Every run says how much energy, momentum and closure it lost.
//
//     ksl::simulation task;
//     task.q = q, task.v = v, task.times_n = 101, task.times = times;
//     ksl::simulation_results out;
//     out.q = positions;
//     const auto record = ksl::simulate(m, task, out);
//
// Numbers are in double precision.  Arguments are not checked, except where a sentence says so; calls in C and Python check them.
#pragma once

#include "ksl/engine/steps/frame_options.hpp"
#include "ksl/model.hpp"

#include <string>
#include <vector>

namespace ksl {

/// How time is stepped; docs/simulation.md has a table of what each costs and keeps.
enum class stepping {
  semi_implicit_euler, ///< order 1, one evaluation a step: velocities first, then positions
  rk4,                 ///< order 4, four evaluations, commutator-free: only ⊕ is needed
  rkmk4,               ///< order 4, four evaluations: Runge–Kutta–Munthe-Kaas
  dop853,              ///< order 8 with error control and dense output, by Dormand and Prince
  sdirk4,              ///< order 4, implicit and L-stable, for stiff springs, dampers and gains
  variational          ///< order 2, symplectic: energy has no trend, momenta are kept
};

/// Rows of numbers at some times, straight lines between them, the first and the last row before and after.  Without rows: absent.
struct rows_over_time {
  std::size_t n = 0;             ///< times; with one row, it holds always
  const double *times = nullptr; ///< (n), increasing
  const double *rows = nullptr;  ///< (n, columns), or (runs, n, columns)
  std::size_t run_stride = 0;    ///< numbers between those of two runs; 0: all runs have the same

  explicit operator bool() const { return n > 0; }
};

/// Efforts (n, nv) of n runs, of which `first` is the first, at time t and states q (n, nq) and v (n, nv).  Returns false to end the runs.
using effort_function = bool (*)(void *context, std::size_t first, std::size_t n, double t, const double *q,
                                 const double *v, double *tau);

/// What drives the joints:
///
///     tau = given + gravity + stiffness (q_d ⊖ q) + damping (v_d − v),          or, with computed torque,
///     tau = given + ID(q, v, a_d + stiffness (q_d ⊖ q) + damping (v_d − v)),
///
/// kept within ± limit, and zero at coordinates that are not driven.  The motion asked for has cubic positions between its times,
/// with its velocities at both ends, and accelerations on straight lines.
struct drive_law {
  rows_over_time given = {};        ///< (nv)
  bool holds_gravity = false;       ///< adds gravity_torque(q)
  bool computed_torque = false;     ///< ID is inverse dynamics of the model, of the closed mechanism where it has loops
  rows_over_time position = {};     ///< q_d (nq)
  rows_over_time velocity = {};     ///< v_d (nv) at the times of the positions; absent: zero
  rows_over_time acceleration = {}; ///< a_d (nv), likewise
  /// (nv); null: zero.  They need positions, as computed torque does
  const double *stiffness = nullptr, *damping = nullptr;
  const double *limit = nullptr;         ///< (nv), may be infinite; null: none
  const unsigned char *driven = nullptr; ///< (nv) flags; null: all
  effort_function function = nullptr;    ///< instead of all this
  void *context = nullptr;
};

/// Wrenches on a link, as external_rows, over time.
struct wrench_over_time {
  int link = 0;
  rows_over_time wrench; ///< (6)
};

/// Values (count) of a user's functions at (t, q, v), whose zeros are events.  Returns false to end the run.
using event_function = bool (*)(void *context, std::size_t run, double t, const double *q, const double *v,
                                double *values);

/// Is told, after each step, the time that a run, or runs in lanes, have reached; false ends them.  Called by all threads.
using step_function = bool (*)(void *context, std::size_t run, double t);

/// A function whose zeros are events.
struct event_rule {
  int direction = 0; ///< 1: only where it rises through zero; −1: only where it falls; 0: both
  bool ends = false; ///< does the run end there
};

/// What stops and holds joints exactly, without stiff springs; not with the variational method.  Coordinates with one number in q.
struct exact_laws {
  /// (nv) v after an impact on a limit of the joint is −restitution v; negative: this coordinate has no limits.  Null: no limits.
  const double *restitution = nullptr;
  const double *lower = nullptr, *upper = nullptr; ///< (nv) the limits; ± infinity where there is none
  const double *friction = nullptr; ///< (nv) dry friction, N m or N: it sticks up to this effort.  Null: none
  const double *brake = nullptr;    ///< (nv) what brakes add to it from `brake_at` on.  Null: none
  double brake_at = 0;              ///< s
  bool cut_efforts = false;         ///< are the drives without effort from then on

  bool any() const { return restitution || friction || brake; }
};

/// What is simulated.
struct simulation {
  std::size_t runs = 1;
  const double *q = nullptr, *v = nullptr; ///< (runs, nq), (runs, nv): at times[0]
  std::size_t times_n = 0;
  const double *times = nullptr; ///< (times_n), increasing: when results are wanted
  stepping method = stepping::dop853;
  /// s, at most; of methods without error control.  Each interval of times has a whole number of steps
  double step = 0;
  /// error of a step of dop853, of each number of u and v: absolute + relative |number|; with loops both are at most 1e-8
  double relative = 1e-9, absolute = 1e-9;
  std::size_t most_steps = 10'000'000; ///< of a run
  drive_law drives = {};
  int external_n = 0;
  const wrench_over_time *external = nullptr;
  expressed_in external_axes = expressed_in::frame;
  exact_laws laws = {};
  int events_n = 0;
  const event_rule *events = nullptr;
  event_function event_values = nullptr;
  void *event_context = nullptr;
  /// Are positions and velocities of mechanisms with loops moved back onto the closed ones after each step: to the nearest ones, in
  /// the norms of close() and consistent_velocity().
  bool project = true;
  step_function after_step = nullptr;
  void *step_context = nullptr;
  int threads = 1; ///< 0: all cores.  Functions of the user are then called by several threads
};

/// Where results are written; each may be null.  Rows behind the end of a run are NaN.
struct simulation_results {
  double *q = nullptr, *v = nullptr, *a = nullptr, *tau = nullptr; ///< (runs, times, nq or nv)
  double *kinetic = nullptr, *potential = nullptr;                 ///< (runs, times) J
  double *work = nullptr; ///< (runs, times) J that drives, external wrenches and dissipation have put in since times[0]
  double *momentum = nullptr; ///< (runs, times, 6) about the centre of mass, world axes, linear first
  /// (runs, times) the largest equation of the loops that was open, at this time or before a projection since the time before: m, angles
  /// times the length of the mechanism.
  double *closure = nullptr;
};

/// What happened at an instant.
enum class happening {
  lower_limit,
  upper_limit, ///< an impact; `speed` after it
  rest,        ///< impacts came ever faster: the joint lies on its limit from now on
  lifts,       ///< it leaves the limit
  sticks,
  slips,    ///< dry friction, or a brake
  brakes,   ///< brakes engage
  singular, ///< the loops pass a position at which their equations lose rank
  function  ///< a zero of a user's function
};
struct simulated_event {
  std::size_t run;
  double time;
  happening what;
  int number;   ///< coordinate in v, or the number of the function
  double speed; ///< of the coordinate after it
};

/// How a run ended.
enum class ending {
  complete,
  event,
  stopped, ///< at the last time; by an event; by a function that returned false
  step_underflow, ///< the step that the error allows is too small to change the time, or 10,000 of them by a billionth of the run
  too_many_steps,
  not_finite,    ///< numbers overflow, or a function gave NaN
  not_solved,    ///< implicit equations of a step have no solution nearby
  not_closed,    ///< no closed position was found from where a step ended
  endless_events ///< events follow each other at one instant without end
};
struct run_end {
  ending how = ending::complete;
  double time = 0;       ///< until here
  std::size_t steps = 0; ///< accepted
  std::size_t rejected = 0;
  std::size_t evaluations = 0; ///< of forward dynamics
  int coordinate = -1;         ///< which had the largest error, or was the first that wasn't finite
  int element = -1;            ///< the force element that had no force where numbers were not finite
};

struct simulation_record {
  std::vector<run_end> ends;           ///< (runs)
  std::vector<simulated_event> events; ///< of each run in order of time, the runs in order
};

/// Simulates.  Runs don't depend on each other, on their number or on threads: the same bits.  Methods with fixed steps compute runs in
/// lanes, trees also under exact laws and with events; dop853 and sdirk4 compute them one by one.  Allocates.  Throws std::invalid_argument for what a method can't do, std::bad_alloc and std::runtime_error (KSL_ISA).
KSL_EXPORT simulation_record simulate(const model &m, const simulation &task, const simulation_results &out);

} // namespace ksl
