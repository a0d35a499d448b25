#include "simulate/runs/runs_under_laws.hpp"

#include "simulate/runs/event_search.hpp"
#include "simulate/methods/methods.hpp"
#include "simulate/runs/single_run.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::simulating {
namespace {

/// All runs take a step in lanes.  A run in which something may have happened takes it again alone, from where it was, with what a single
/// run does about events; the others have the step that a single run would have accepted.
///
///     lanes       0    1    2    3
///     start_      ·    ·    ·    ·
///                 │    │    │    │      method_->step, accelerate: for all
///     end_        ·    ·    ?    ·      something_happens(2)
///                           ↑
///                 start_ of lane 2 is copied back over its end_, and lone_ takes the step with its events: go_alone(2)
///
/// A test that is true too often costs time; one that is false where an event lies loses it: in doubt a run goes alone.  Bits don't depend on
/// that, since the method computes each lane as it does a single run.
class runs_under_laws {
public:
  runs_under_laws(const model &m, const simulation &task, const results &out, std::size_t first, std::size_t n,
                  run_end *ends, std::vector<simulated_event> *events)
      : task_(task), out_(out), of_(m, task, n), start_(of_, n), end_(of_, n),
        method_(make_method(task.method, of_, n)), lone_(make_lone_run(m, task, out)), ends_(ends), events_(events),
        alive_(n, 1), closure_(n, 0), users_(n * static_cast<std::size_t>(task.events_n)), users_at_end_(users_.size()),
        breaks_(breaks_of(task)) {
    for (block *b : {&start_, &end_})
      b->first = first, b->n = n, b->t = task.times[0];
    for (int k = 0; task.laws.restitution && k < m.nv(); ++k)
      if (task.laws.restitution[k] >= 0 && of_.space().number_in_q(k) >= 0)
        limited_.push_back(k);
  }

  void run() {
    for (std::size_t k = 0; k < start_.n; ++k) {
      lone_->start(state_of(k, start_), events_[k]);
      note_end(k, start_);
      alive_[k] = alive_[k] && set_users(k, start_, users_);
    }
    of_.set_brakes(task_.laws.brake && task_.laws.brake_at <= task_.times[0]);
    step_place place = {task_.times[0], 0, 0, 0, 0, 0, 1};
    for (const double until : breaks_) {
      place.begin = place.t, place.length = until - place.t, place.taken = 0;
      place.whole = until > place.t ? equal_steps(place.t, until, task_.step) : 0;
      while (place.taken < place.whole) {
        if (!step(place, until))
          return;
        ++place.taken;
      }
      ++place.next_break;
    }
  }

private:
  lone_state state_of(std::size_t k, block &b) {
    const std::size_t nq = of_.nq(), nv = of_.nv();
    return {b.first + k,
            b.q.data() + k * nq,
            b.v.data() + k * nv,
            b.work.data() + k,
            b.a.data() + k * nv,
            b.power.data() + k,
            of_.held() ? of_.held()->modes(k) : nullptr,
            ends_ + k};
  }

  /// False if no run goes on.
  /// start_ stays as it is until all runs are at the end: those that go alone begin there.
  /// Of each run one of three: the user's function has stopped all; something may have happened, also that brakes engage or that its steps are used
  /// up, and it goes alone; or the step in lanes is its own.
  bool step(step_place &place, double until) {
    const double end = place.end(until);
    const bool is_stored = place.stored < task_.times_n && task_.times[place.stored] == end;
    const bool brakes = task_.laws.brake && task_.laws.brake_at == end;
    end_.q = start_.q, end_.v = start_.v, end_.work = start_.work, end_.a = start_.a, end_.power = start_.power;
    end_.t = start_.t;
    const std::size_t before = of_.evaluations();
    h_ = place.length / place.whole;
    method_->step(of_, end_, h_);
    end_.t = end;
    of_.accelerate(end, end_.first, end_.n, end_.q.data(), end_.v.data(), end_.a.data(), end_.power.data());
    const std::size_t each = (of_.evaluations() - before) / end_.n;
    const bool goes_on = !task_.after_step || task_.after_step(task_.step_context, end_.first, end);
    bool any = false, all_in_lanes = true;
    for (std::size_t k = 0; k < end_.n; ++k) {
      if (!alive_[k])
        continue;
      if (!goes_on)
        stop(k, place);
      else if (brakes || place.whole - place.taken > static_cast<double>(task_.most_steps - ends_[k].steps) ||
               something_happens(k))
        go_alone(k, place), all_in_lanes = false;
      else
        ++ends_[k].steps, ends_[k].time = end, ends_[k].evaluations += each;
      any |= alive_[k] != 0;
    }
    // after the runs that went alone, which engage their brakes themselves
    if (brakes)
      of_.set_brakes(true);
    if (is_stored)
      store(place.stored++, all_in_lanes);
    std::swap(start_, end_), std::swap(users_, users_at_end_);
    place.t = end;
    return any;
  }

  void go_alone(std::size_t k, const step_place &place) {
    const std::size_t nq = of_.nq(), nv = of_.nv();
    std::copy_n(start_.q.data() + k * nq, nq, end_.q.data() + k * nq);
    std::copy_n(start_.v.data() + k * nv, nv, end_.v.data() + k * nv);
    end_.work[k] = start_.work[k];
    lone_->step(place, state_of(k, end_), events_[k]);
    note_end(k, end_);
    alive_[k] = alive_[k] && set_users(k, end_, users_at_end_);
  }

  /// Runs that have ended lie still in their lanes.
  void note_end(std::size_t k, block &b) {
    if (ends_[k].how == ending::complete)
      return;
    alive_[k] = 0;
    std::fill_n(b.v.data() + k * of_.nv(), of_.nv(), 0.0);
    if (of_.held())
      std::fill_n(of_.held()->modes(k), of_.nv(), held_joints::mode::free);
  }

  void stop(std::size_t k, const step_place &place) {
    ends_[k].how = ending::stopped, ends_[k].time = place.end(breaks_[place.next_break]);
    out_.erase(of_, end_.first + k, place.stored);
    note_end(k, end_);
  }

  /// May an event lie in the step that run k has taken: more than those that do.
  bool something_happens(std::size_t k) {
    const std::size_t nq = of_.nq(), nv = of_.nv();
    const double *const q = end_.q.data() + k * nq, *const v = end_.v.data() + k * nv;
    if (not_finite_speed(of_, end_, k) >= 0)
      return true;
    if (held_joints *const held = of_.held()) {
      using mode = held_joints::mode;
      if (held->lets_go(k))
        return true;
      const mode *const modes = held->modes(k);
      const double *const v0 = start_.v.data() + k * nv, *const a0 = start_.a.data() + k * nv,
                          *const a1 = end_.a.data() + k * nv, h = h_;
      for (std::size_t i = 0; i < nv; ++i) {
        const double sign = modes[i] == mode::slides_up ? 1 : modes[i] == mode::slides_down ? -1 : 0;
        // the speed of what slides, in the direction in which it does: zero where it stops
        if (sign != 0 && is_passed(sign * v0[i], sign * a0[i] * h, sign * v[i], sign * a1[i] * h))
          return true;
      }
      for (const int i : limited_) {
        const std::ptrdiff_t number = of_.space().number_in_q(i);
        const double x0 = start_.q[k * nq + static_cast<std::size_t>(number)], x1 = q[number], r0 = v0[i] * h,
                     r1 = v[i] * h;
        if (modes[i] < mode::sticks && (is_passed(x0 - task_.laws.lower[i], r0, x1 - task_.laws.lower[i], r1) ||
                                        is_passed(task_.laws.upper[i] - x0, -r0, task_.laws.upper[i] - x1, -r1)))
          return true;
      }
    }
    return !set_users(k, end_, users_at_end_) || a_user_sees(k);
  }

  /// May a function be zero in the step that has these values and rates at its ends; it falls at events.
  static bool is_passed(double f0, double r0, double f1, double r1) { return !(f1 > 0) || may_dip(f0, r0, f1, r1); }

  /// The values of the user's functions for run k; false if there are none.
  bool set_users(std::size_t k, const block &b, std::vector<double> &values) {
    return task_.events_n == 0 ||
           task_.event_values(task_.event_context, b.first + k, b.t, b.q.data() + k * of_.nq(),
                              b.v.data() + k * of_.nv(), values.data() + k * static_cast<std::size_t>(task_.events_n));
  }
  /// May a function of the user's have an event: it isn't of one sign, and off zero, at both ends.  Rates of these functions aren't known, so that
  /// with steps of equal length single runs look for no dips between the ends either.
  bool a_user_sees(std::size_t k) const {
    const std::size_t n = static_cast<std::size_t>(task_.events_n);
    for (std::size_t i = k * n; i < (k + 1) * n; ++i)
      if (!((users_[i] < 0 && users_at_end_[i] < 0) || (users_[i] > 0 && users_at_end_[i] > 0)))
        return true;
    return false;
  }

  void store(std::size_t i, bool all_in_lanes) {
    if (!all_in_lanes) // the efforts of the drives are those of all runs at this time
      of_.accelerate(end_.t, end_.first, end_.n, end_.q.data(), end_.v.data(), end_.a.data(), end_.power.data());
    out_.store(of_, i, end_, closure_.data());
    for (std::size_t k = 0; k < end_.n; ++k)
      if (!alive_[k])
        out_.erase(of_, end_.first + k, i);
  }

  const simulation &task_;
  const results &out_;
  system of_;
  block start_, end_;
  std::unique_ptr<method> method_;
  std::unique_ptr<lone_run> lone_;
  run_end *ends_;
  std::vector<simulated_event> *events_;
  std::vector<unsigned char> alive_;
  std::vector<double> closure_, users_, users_at_end_, breaks_;
  std::vector<int> limited_;
  double h_ = 0; ///< of the step
};

} // namespace

bool go_in_lanes_under_laws(const model &m, const simulation &task) {
  const bool in_lanes =
      task.method == stepping::semi_implicit_euler || task.method == stepping::rk4 || task.method == stepping::rkmk4;
  const bool may_happen = task.laws.any() || task.events_n > 0;
  return may_happen && in_lanes && m.loops().empty() && !task.drives.function && task.runs > 1;
}

void run_under_laws(const model &m, const simulation &task, const results &out, std::size_t first, std::size_t n,
                    run_end *ends, std::vector<simulated_event> *events) {
  runs_under_laws(m, task, out, first, n, ends, events).run();
}

} // namespace ksl::simulating
