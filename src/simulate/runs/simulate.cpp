// Runs on threads (ksl/simulate.hpp).
#include "ksl/simulate.hpp"

#include "batch/threads.hpp"
#include "simulate/runs/fixed_steps.hpp"
#include "simulate/runs/runs_under_laws.hpp"
#include "simulate/runs/single_run.hpp"
#include "text/rounding.hpp"

#include <cmath>
#include <exception>
#include <mutex>
#include <optional>
#include <stdexcept>

namespace ksl {
namespace {

using namespace simulating;

void require(bool holds, const char *sentence) {
  if (!holds)
    throw std::invalid_argument(sentence);
}

/// What no run could be computed with, before any of them begins.
void require_possible(const simulation &task) {
  const bool adaptive = task.method == stepping::dop853;
  require(task.times_n > 0, "no times: a simulation needs that of its beginning at least");
  for (std::size_t i = 0; i < task.times_n; ++i)
    require(std::isfinite(task.times[i]) && (i == 0 || task.times[i] > task.times[i - 1]),
            "the times of a simulation must be finite and increase");
  require(adaptive || task.times_n == 1 || task.step > 0,
          "this method has steps of the same length; give a step above zero");
  require(!adaptive || (task.relative >= 0 && task.absolute >= 0 && task.relative + task.absolute > 0),
          "dop853 needs a relative or an absolute error above zero");
  const drive_law &law = task.drives;
  require(law.function || law.position || !(law.stiffness || law.damping || law.computed_torque),
          "stiffness, damping and computed torque need positions of the motion asked for");
  require(
      !task.laws.any() || task.method != stepping::variational,
      "limits, exact dry friction and brakes take energy, whose trend the method variational is there to avoid; take "
      "another method, or leave them out");
}

/// Dry friction that sticks is an exact law of the run, not a part of forward dynamics.
/// The model that is simulated has none, and the laws have all of it.
struct with_exact_friction {
  std::optional<model> smooth;
  std::vector<double> friction;

  with_exact_friction(const model &m, simulation &task) {
    if (!m.exact_friction())
      return;
    require(m.followers() == 0,
            "exact dry friction of mimic joints can't be simulated; take the smooth law, exact_friction off");
    const coordinate_physics<double> *const physics = m.view().physics;
    for (int k = 0; physics && k < m.nv(); ++k)
      friction.push_back(physics[k].friction + (task.laws.friction ? task.laws.friction[k] : 0));
    robot_description description = m.description();
    description.physics.friction = description.physics.exact_friction = false;
    smooth.emplace(std::move(description));
    task.laws.friction = friction.data();
  }
};

/// Runs on threads, whose errors are those of the call.
class all_runs {
public:
  all_runs(const model &m, const simulation &task, const simulation_results &out)
      : m_(m), task_(task), out_(task, out), events_(task.runs) {
    record_.ends.resize(task.runs);
  }

  // Parts are whole blocks of `each` runs, whatever the number of threads: the same runs share a block always, and results don't depend on threads.
  // Each run writes rows, an end and events of its own; the error of a call is the first that a thread throws.
  simulation_record compute() {
    const std::size_t each = runs_at_once(m_, task_);
    on_threads(partition(task_.runs, each, each, task_.threads), [&](std::size_t first, std::size_t end, std::size_t) {
      try {
        const nearest_rounding rounding;
        for (std::size_t k = first; k < end; k += each)
          compute(k, std::min(each, end - k));
      } catch (...) {
        const std::lock_guard<std::mutex> guard(lock_);
        if (!error_)
          error_ = std::current_exception();
      }
    });
    if (error_)
      std::rethrow_exception(error_);
    for (const std::vector<simulated_event> &of_run : events_)
      record_.events.insert(record_.events.end(), of_run.begin(), of_run.end());
    return std::move(record_);
  }

private:
  /// Which of three, for runs [first, first + n):
  ///
  ///     run_fixed_steps    no laws and no events, steps of equal length: in lanes, step by step
  ///     run_under_laws     laws or events, and an explicit method for a tree: in lanes, and alone where something may happen
  ///     run_single         dop853, and all others with laws or events: n = 1
  void compute(std::size_t first, std::size_t n) {
    if (go_in_lanes_under_laws(m_, task_))
      run_under_laws(m_, task_, out_, first, n, record_.ends.data() + first, events_.data() + first);
    else if (is_single(task_))
      record_.ends[first] = run_single(m_, task_, out_, first, events_[first]);
    else
      run_fixed_steps(m_, task_, out_, first, n, record_.ends.data() + first);
  }

  const model &m_;
  const simulation &task_;
  const results out_;
  simulation_record record_;
  std::vector<std::vector<simulated_event>> events_;
  std::mutex lock_;
  std::exception_ptr error_;
};

} // namespace

simulation_record simulate(const model &m, const simulation &given, const simulation_results &out) {
  simulation task = given;
  const with_exact_friction friction(m, task);
  require_possible(task);
  return all_runs(friction.smooth ? *friction.smooth : m, task, out).compute();
}

} // namespace ksl
