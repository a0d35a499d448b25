// One run with error control, or with events.
#pragma once

#include "simulate/runs/results.hpp"

namespace ksl::simulating {

/// Is each run computed alone: by dop853; under exact laws or with events but for those that runs_under_laws computes in lanes.
inline bool is_single(const simulation &task) {
  return task.method == stepping::dop853 || task.laws.any() || task.events_n > 0;
}

/// Times at which steps end: those at which what drives a run has no derivatives; with steps of equal length those of results, so that an
/// event that doesn't happen changes no step.
std::vector<double> breaks_of(const simulation &task);

/// Where a run is among the steps of equal length between two breaks.
///
///      break           taken = 2                 next break, `until`
///        |───────|───────|───────|─ … ─|───────|     whole steps of length / whole each
///      begin             t       end(until)
///
/// Ends are computed from `begin`, not by adding up, so that no rounding accumulates and the last step ends at the break exactly.
struct step_place {
  double t; ///< now
  /// the first break, the time to the next, and how many of how many steps are taken
  double begin, length, taken, whole;
  std::size_t next_break, stored; ///< which break ends them; rows of results that are stored

  /// Of the next step, `until` being the break that ends them all.
  double end(double until) const { return taken + 1 == whole ? until : begin + length * ((taken + 1) / whole); }
};

/// A run in lanes, which leaves them for a step in which something may happen to it, and comes back: its state and how it ended.
struct lone_state {
  std::size_t run;
  double *q, *v, *work, *a, *power; ///< a and power: set to those of the state that is left
  held_joints::mode *modes;         ///< null without exact laws
  run_end *end;
};
class lone_run {
public:
  virtual ~lone_run() = default;
  lone_run(const lone_run &) = delete;
  lone_run &operator=(const lone_run &) = delete;

  /// The beginning of the run, its row of results included.
  virtual void start(const lone_state &state, std::vector<simulated_event> &events) = 0;
  /// One step, with its row of results where it ends at a time of them.
  virtual void step(const step_place &place, const lone_state &state, std::vector<simulated_event> &events) = 0;

protected:
  lone_run() = default;
};
std::unique_ptr<lone_run> make_lone_run(const model &m, const simulation &task, const results &out);

run_end run_single(const model &m, const simulation &task, const results &out, std::size_t run,
                   std::vector<simulated_event> &events);

} // namespace ksl::simulating
