#include "simulate/runs/fixed_steps.hpp"

#include "simulate/methods/methods.hpp"
#include "simulate/runs/runs_under_laws.hpp"
#include "simulate/runs/single_run.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::simulating {
namespace {

/// States and stages of runs in lanes lie in a fast cache.
constexpr std::size_t bytes_of_runs = 48 * 1024, stages_kept = 8, most_at_once = 256, lanes_at_most = 8;

// Runs [first, first + n) in lock step, a state in each lane.  A run that ends early stays in its lane, where it computes on what nobody reads;
// its rows of results are NaN from then on, and alive_ tells.
//
// After each step: drop what isn't solved or finite, move onto the loops, then accelerations at the new state, which the next step begins with
// and a row of results shows.
//
//     lane       0  1  2  3
//     alive_     1  1  0  1        run first + 2 has ended before row i: its rows from i on are NaN, and its lane goes on with whatever it has
class fixed_runs {
public:
  fixed_runs(const model &m, const simulation &task, const results &out, std::size_t first, std::size_t n,
             run_end *ends)
      : task_(task), out_(out), of_(m, task, n), b_(of_, n), method_(make_method(task.method, of_, n)), ends_(ends),
        alive_(n, 1), closure_(n, 0) {
    b_.first = first, b_.n = n, b_.t = last_ = task.times[0];
    std::copy_n(task.q + first * of_.nq(), n * of_.nq(), b_.q.data());
    std::copy_n(task.v + first * of_.nv(), n * of_.nv(), b_.v.data());
  }

  void run() {
    method_->begin(b_);
    if (!evaluate()) {
      std::fill(b_.a.begin(), b_.a.end(), std::numeric_limits<double>::quiet_NaN());
      out_.store(of_, 0, b_, closure_.data());
      return end_all(1, ending::stopped);
    }
    if (!store(0))
      return;
    for (std::size_t i = 1; i < task_.times_n; ++i) {
      const ending how = go_to(i);
      if (how != ending::complete)
        return end_all(i, how);
      if (!store(i))
        return;
    }
    for (std::size_t k = 0; k < b_.n; ++k)
      if (alive_[k])
        end(k, task_.times_n, ending::complete, -1);
  }

private:
  bool evaluate() {
    return of_.accelerate(b_.t, b_.first, b_.n, b_.q.data(), b_.v.data(), b_.a.data(), b_.power.data());
  }

  ending go_to(std::size_t i) {
    const double start = task_.times[i - 1], length = task_.times[i] - start;
    const double whole = equal_steps(start, task_.times[i], task_.step);
    if (whole > static_cast<double>(task_.most_steps - steps_))
      return ending::too_many_steps;
    const std::size_t steps = static_cast<std::size_t>(whole);
    for (std::size_t s = 1; s <= steps; ++s) {
      // implicit methods say which runs they could not solve; explicit ones can only leave numbers that aren't finite
      const outcome found = method_->step(of_, b_, length / whole);
      if (found == outcome::not_solved || found == outcome::not_finite)
        drop_not_solved(i, found);
      if (!all_finite())
        drop_not_finite(i);
      if (std::none_of(alive_.begin(), alive_.end(), [](unsigned char lives) { return lives != 0; }))
        return ending::complete;
      ++steps_;
      // s / whole of the way, not sums of h: no rounding accumulates, and the last one ends at times[i] exactly
      b_.t = s == steps ? task_.times[i] : start + length * (static_cast<double>(s) / whole);
      if (found == outcome::stopped)
        return ending::stopped;
      if (of_.closed())
        project();
      if (!evaluate() || (task_.after_step && !task_.after_step(task_.step_context, b_.first, b_.t)))
        return ending::stopped;
      last_ = b_.t;
    }
    return ending::complete;
  }

  bool all_finite() const {
    // 0 x is NaN for NaN and infinities, and 0 for all others
    constexpr std::size_t chains = 16; // of additions that don't wait for each other
    double sums[chains] = {};
    const std::size_t n = b_.v.size(), whole = n - n % chains;
    for (std::size_t i = 0; i < whole; i += chains)
      for (std::size_t j = 0; j < chains; ++j)
        sums[j] += 0 * b_.v[i + j];
    for (std::size_t i = whole; i < n; ++i)
      sums[0] += 0 * b_.v[i];
    return std::all_of(sums, sums + chains, [](double sum) { return sum == 0; });
  }
  void drop_not_finite(std::size_t i) {
    for (std::size_t k = 0; k < b_.n; ++k)
      if (const int coordinate = not_finite_speed(of_, b_, k); alive_[k] && coordinate >= 0)
        end(k, i, ending::not_finite, coordinate);
  }
  void drop_not_solved(std::size_t i, outcome of_block) {
    for (std::size_t k = 0; k < b_.n; ++k)
      if (const outcome how = method_->of_run(k, of_block); alive_[k] && how != outcome::done)
        end(k, i, how == outcome::not_finite ? ending::not_finite : ending::not_solved, -1);
  }

  /// What `closure` says of a row of results is the most that loops have opened since the row before.
  void project() {
    for (std::size_t k = 0; k < b_.n; ++k) {
      double *const q = b_.q.data() + k * of_.nq();
      if (!alive_[k])
        continue;
      double opened = 0;
      if (!task_.project)
        opened = of_.closed()->error(q);
      else if (!of_.closed()->project(q, b_.v.data() + k * of_.nv(), opened))
        end(k, reached_ + 1, ending::not_closed, -1);
      closure_[k] = std::fmax(closure_[k], opened);
    }
    method_->begin(b_);
  }

  /// Row i; false if no run goes on.
  bool store(std::size_t i) {
    out_.store(of_, i, b_, closure_.data());
    reached_ = i;
    bool any = false;
    for (std::size_t k = 0; k < b_.n; ++k) {
      if (!alive_[k])
        out_.erase(of_, b_.first + k, i);
      else if (const int coordinate = not_finite(of_, b_, k); coordinate >= 0)
        end(k, i, ending::not_finite, coordinate);
      any |= alive_[k] != 0;
    }
    return any;
  }

  /// Run k ends; its rows from i on have no results.
  /// What ends at a state has the time of that; what came to no state, that of the last one before.
  void end(std::size_t k, std::size_t i, ending how, int coordinate) {
    alive_[k] = 0;
    run_end &e = ends_[k];
    e.how = how, e.steps = steps_, e.evaluations = of_.evaluations() / b_.n, e.coordinate = coordinate;
    e.element = how == ending::not_finite ? of_.element(k) : -1;
    e.time = how == ending::complete || how == ending::stopped || how == ending::too_many_steps ? b_.t : last_;
    out_.erase(of_, b_.first + k, i);
  }
  void end_all(std::size_t i, ending how) {
    for (std::size_t k = 0; k < b_.n; ++k)
      if (alive_[k])
        end(k, i, how, how == ending::not_finite ? not_finite(of_, b_, k) : -1);
  }

  const simulation &task_;
  const results &out_;
  system of_;
  block b_;
  std::unique_ptr<method> method_;
  run_end *ends_;
  std::vector<unsigned char> alive_;
  std::vector<double> closure_;
  std::size_t steps_ = 0, reached_ = 0;
  double last_; ///< time of the last state that was reached
};

} // namespace

/// 1 for what goes run by run: dop853, laws and events but for those in lanes, sdirk4, and variational of closed mechanisms or with efforts by a
/// function.
std::size_t runs_at_once(const model &m, const simulation &task) {
  if ((is_single(task) && !go_in_lanes_under_laws(m, task)) || task.method == stepping::sdirk4)
    return 1;
  if (task.method == stepping::variational && (!m.loops().empty() || task.drives.function))
    return 1;
  if (task.drives.function) // which then is called with all runs
    return std::max<std::size_t>(task.runs, 1);
  // the numbers of a run in one stage, q, v, a and the work, times stages: as many runs as fit, in whole registers of lanes
  const std::size_t of_run = sizeof(double) * stages_kept * static_cast<std::size_t>(m.nq() + 2 * m.nv() + 1);
  // seven joints: 48 KiB / (8 · 8 · 22) = 34 runs, of which 32 are whole registers
  const std::size_t n = bytes_of_runs / of_run / lanes_at_most * lanes_at_most;
  return std::min(most_at_once, std::max(lanes_at_most, n));
}

void run_fixed_steps(const model &m, const simulation &task, const results &out, std::size_t first, std::size_t n,
                     run_end *ends) {
  fixed_runs(m, task, out, first, n, ends).run();
}

} // namespace ksl::simulating
