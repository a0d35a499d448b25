// Simulation from C.
//
// A task holds pointers into arrays of the caller's and into vectors of this call, where C and C++ differ: flags of driven joints, rules of events,
// and wrenches, which are constant here, rows over time with one row.
#include "ksl/engine_simulate.h"

#include "c_api/calls.hpp"
#include "ksl/dynamics.hpp"
#include "ksl/loops.hpp"
#include "ksl/simulate.hpp"
#include "simulate/system/manifold.hpp"

#include <algorithm>
#include <limits>

namespace ksl::c_api {
namespace {

/// rows[run · run_stride + k · columns + c], number c at times[k]; a stride of 0 has the same rows for all runs, which are then checked once.
rows_over_time rows_of(const ksl_rows_over_time_t &given, std::ptrdiff_t columns, std::size_t runs, const char *name) {
  if (given.n == 0)
    return {};
  require(given.times && given.rows, "times and rows of numbers over time must not be null");
  for (std::size_t k = 0; k < given.n; ++k)
    require(std::isfinite(given.times[k]) && (k == 0 || given.times[k] > given.times[k - 1]),
            "times of numbers over time must be finite and increase");
  const std::size_t each = given.n * static_cast<std::size_t>(columns);
  for (std::size_t run = 0; run < (given.run_stride ? runs : 1); ++run)
    require_finite(given.rows + run * given.run_stride, static_cast<int>(each), name);
  return {given.n, given.times, given.rows, given.run_stride};
}

constexpr double largest = std::numeric_limits<double>::max(), infinite = std::numeric_limits<double>::infinity();

/// x (n) may be null.
void require_between(const double *x, int n, double least, double most, const char *sentence) {
  for (int k = 0; x && k < n; ++k)
    require(x[k] >= least && x[k] <= most, sentence);
}

/// Starts lie within the limits at which joints throw back.
void require_within_limits(const model &m, const simulation &task) {
  const exact_laws &laws = task.laws;
  const simulating::manifold space(m);
  for (int k = 0; laws.restitution && k < m.nv(); ++k) {
    const int number = space.number_in_q(k);
    if (number < 0 || laws.restitution[k] < 0)
      continue;
    require(laws.lower[k] <= laws.upper[k], "lower limits of joints must not be above upper ones");
    for (std::size_t run = 0; run < task.runs; ++run) {
      const double q = task.q[run * static_cast<std::size_t>(m.nq()) + static_cast<std::size_t>(number)];
      require(q >= laws.lower[k] && q <= laws.upper[k], "q must begin within the limits at which joints throw back");
    }
  }
}

/// A negative restitution is a coordinate without limits; null arrays are laws that the run doesn't have.
void set_laws(const model &m, const ksl_exact_laws_t &given, exact_laws &laws) {
  const int nv = m.nv();
  require(!given.restitution || (given.lower && given.upper),
          "limits of joints must not be null where they throw back");
  require_between(given.restitution, nv, -largest, 1,
                  "restitution must be from 0 to 1, or negative where there is no limit");
  require_between(given.lower, nv, -infinite, infinite, "limits of joints must be numbers");
  require_between(given.upper, nv, -infinite, infinite, "limits of joints must be numbers");
  require_between(given.friction, nv, 0, largest, "dry friction must be finite and 0 or more");
  require_between(given.brake, nv, 0, largest, "brakes must be finite and 0 or more");
  require(!given.brake || std::isfinite(given.brake_at), "brake_at must be finite");
  laws = {given.restitution, given.lower, given.upper, given.friction, given.brake, given.brake_at, given.cut_efforts};
}

/// Controllers need positions, which may have velocities and accelerations at the same times; a function takes the place of all of this.
void set_drives(const model &m, const ksl_simulation_t &given, drive_law &law, std::vector<unsigned char> &driven) {
  const ksl_drive_law_t &d = given.drives;
  law.given = rows_of(d.given, m.nv(), given.runs, "drives.given");
  law.position = rows_of(d.position, m.nq(), given.runs, "drives.position");
  law.velocity = rows_of(d.velocity, m.nv(), given.runs, "drives.velocity");
  law.acceleration = rows_of(d.acceleration, m.nv(), given.runs, "drives.acceleration");
  require((!law.velocity || law.velocity.n == law.position.n) &&
              (!law.acceleration || law.acceleration.n == law.position.n),
          "velocities and accelerations of the motion asked for must have the times of its positions");
  law.holds_gravity = d.holds_gravity, law.computed_torque = d.computed_torque;
  law.stiffness = d.stiffness, law.damping = d.damping, law.limit = d.limit;
  require_between(d.stiffness, m.nv(), -largest, largest, "stiffness must be finite");
  require_between(d.damping, m.nv(), -largest, largest, "damping must be finite");
  require_between(d.limit, m.nv(), 0, infinite, "limits of efforts must not be negative");
  law.function = d.function, law.context = d.context;
  if (d.driven) {
    driven.assign(d.driven, d.driven + m.nv());
    law.driven = driven.data();
  }
}

void set_events(const ksl_simulation_t &given, simulation &task, std::vector<event_rule> &rules) {
  require(given.events_n == 0 || (given.events_n > 0 && given.events && given.event_values),
          "events need their rules, and the function of their values");
  for (int k = 0; k < given.events_n; ++k)
    rules.push_back({given.events[k].direction, given.events[k].ends});
  task.events_n = given.events_n, task.events = rules.data();
  task.event_values = given.event_values, task.event_context = given.event_context;
}

// Forward dynamics refuses a start that isn't closed, before any run begins.
// The accelerations themselves are dropped: what counts is that there are some at each start, with efforts of zero.
void require_closed(const model &m, const simulation &task) {
  data d(m);
  std::vector<double> a(static_cast<std::size_t>(m.nv()));
  for (std::size_t k = 0; k < task.runs && !m.loops().empty(); ++k)
    forward_dynamics(m, d, task.q + k * static_cast<std::size_t>(m.nq()), task.v + k * a.size(), d.zero<double>(),
                     a.data());
}

// A caller can't know how many events there are: those that have room are written, and events_n says how much room a second call needs.
void put_events(const simulation_record &record, ksl_simulation_results_t &out) {
  out.events_n = record.events.size();
  for (std::size_t k = 0; out.events && k < std::min(out.events_n, out.events_room); ++k) {
    const simulated_event &e = record.events[k];
    out.events[k] = {e.run, e.time, static_cast<ksl_happening_t>(e.what), e.number, e.speed};
  }
  for (std::size_t k = 0; out.ends && k < record.ends.size(); ++k) {
    const run_end &e = record.ends[k];
    out.ends[k] = {
        static_cast<ksl_ending_t>(e.how), e.time, e.steps, e.rejected, e.evaluations, e.coordinate, e.element};
  }
}

} // namespace
} // namespace ksl::c_api

using namespace ksl::c_api;

extern "C" {

ksl_simulation_t ksl_simulation(void) {
  const ksl::simulation usual;
  ksl_simulation_t task = {};
  task.method = static_cast<ksl_stepping_t>(usual.method);
  task.relative = usual.relative, task.absolute = usual.absolute, task.most_steps = usual.most_steps;
  task.project = usual.project, task.threads = usual.threads;
  return task;
}

ksl_status_t ksl_simulate(const ksl_model_t *m, const ksl_simulation_t *given, const ksl_exact_laws_t *laws,
                          const ksl_external_t *external, ksl_simulation_results_t *results) {
  return guarded([&] {
    last_warning()[0] = '\0';
    require(m && given && results, "model, task and results must not be null");
    require(given->q && given->v && given->times && given->times_n > 0,
            "q, v and times must not be null, and there must be a time");
    require(given->method >= KSL_SEMI_IMPLICIT_EULER && given->method <= KSL_VARIATIONAL,
            "the method is none of ksl_stepping_t");
    require(given->threads >= 0, "threads must not be negative; 0 is all cores that the process may use");
    // The task points to arrays of the caller's, and to those of this function, which live until simulate() has returned.  Functions of the caller's are
    // called on the library's threads.
    const ksl::model &model = m->model;
    ksl::simulation task;
    task.runs = given->runs, task.q = given->q, task.v = given->v;
    for (std::size_t k = 0; k < task.runs; ++k) {
      require_position(model, task.q + k * static_cast<std::size_t>(model.nq()), "q");
      require_finite(task.v + k * static_cast<std::size_t>(model.nv()), model.nv(), "v");
    }
    task.times_n = given->times_n, task.times = given->times;
    task.method = static_cast<ksl::stepping>(given->method), task.step = given->step;
    task.relative = given->relative, task.absolute = given->absolute, task.most_steps = given->most_steps;
    task.project = given->project, task.threads = given->threads;
    std::vector<unsigned char> driven;
    set_drives(model, *given, task.drives, driven);
    std::vector<ksl::wrench_over_time> wrenches;
    const double zero = 0;
    const ksl::external_wrenches<double> acting = external_of<double>(m, external);
    for (int e = 0; e < acting.n; ++e)
      wrenches.push_back({acting.link[e], {1, &zero, acting.wrench + 6 * e, 0}});
    task.external_axes = acting.axes;
    task.external_n = static_cast<int>(wrenches.size()), task.external = wrenches.data();
    if (laws)
      set_laws(model, *laws, task.laws), require_within_limits(model, task);
    std::vector<ksl::event_rule> rules;
    set_events(*given, task, rules);
    task.after_step = given->after_step, task.step_context = given->step_context;
    require_closed(model, task);
    // what simulate() refuses is the caller's argument, too
    try {
      put_events(ksl::simulate(model, task,
                               {results->q, results->v, results->a, results->tau, results->kinetic, results->potential,
                                results->work, results->momentum, results->closure}),
                 *results);
    } catch (const std::invalid_argument &e) {
      throw bad_argument(e.what());
    }
  });
}

} // extern "C"
