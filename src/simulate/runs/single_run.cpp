#include "simulate/runs/single_run.hpp"

#include "simulate/methods/dop853.hpp"
#include "simulate/runs/equal_step.hpp"
#include "simulate/runs/event_search.hpp"
#include "simulate/methods/methods.hpp"
#include "simulate/runs/law_events.hpp"
#include "simulate/runs/singular_positions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ksl::simulating {
namespace {

// The step after one with the error e is at most 10 and at least 0.2 times as long: 0.9 e^(−1/8) times (Hairer, Nørsett and Wanner,
// Solving Ordinary Differential Equations I, section II.4).
constexpr double safety = 0.9, shrinks_at_most = 0.2, grows_at_most = 10, order = 8;
/// A step turns no joint by more than this, rad: local coordinates end at 2π.
constexpr double most_turn = 3;
/// A step ends before a singular position that is near, by this share of itself, which is passed over from there along its polynomial; or
/// where by chance it ends at most this far before one.
constexpr double before_singular = 0.1, passed_over = 0.2;
/// Where that step is not exact enough, one of this share of the way to the singular position is tried, or a kept polynomial goes on that is
/// this many times as long as the way.
constexpr double less_near = 0.7, kept_enough = 2;
/// States are moved onto the loops before accelerations are computed where the last pivot is below this share of the largest: loops that
/// stages leave open change accelerations by as much divided by the pivot.
constexpr double closes_below = 0.5;
/// Tolerances of mechanisms with loops are no larger: velocities alone tell which of several ways a motion goes on behind a singular position.
constexpr double most_of_closed = 1e-8;
/// Relative errors of accelerations times the square of the last pivot, which divides those of closed positions, and of velocities there.
constexpr double rounding_by_pivot = 2e-13, most_rounding = 1e-8;
/// Events at one instant, for each coordinate, before the run is given up.
constexpr int most_at_once = 20;
/// Times that differ by less, relative to their size, are the same: no step lies between them.
constexpr double same_time = 10 * std::numeric_limits<double>::epsilon();
/// Of a run: less is nothing, even where times are so large that it is no more than their rounding.
constexpr double negligible = 1e-9;

/// So many steps that are tried one after the other have to lead on by more than that.
constexpr std::size_t watched_steps = 10'000;

// A run goes from one of its times to the next by steps, which end early where an event happens:
//
//     breaks     |─────────────────────────|──────────────|    corners of what drives it, brakes; with equal steps times of results
//     steps      |───────|─────────| |─────|───────|──────|    dop853: as long as the error allows; else equally long
//     events                       ↑                           the step is cut here; laws change the state, from which the next one begins
//     results    ·    ·    ·    ·    ·    ·    ·    ·    ·    along the polynomial of a step, or where one ends
//
// advance() tries one step.  An accepted one ends in finish(): is a singular position in it, then events, results, and its end, arrive().
// Where a singular position is ahead, steps end before it, and the polynomial of the last one leads over it (pass_over).
//
// What calls what; each returns how the run ends, or `complete` where it goes on:
//
//     advance ─┬─ no room before the break ── pass_time ────────────────────────────────────────────┐
//              ├─ dop853 ── try_step ─┬─ rejected: the next one is shorter                           │
//              │                      └─ accepted, or pass_over ─┐                                   ▼
//              └─ equal lengths ── take_equal_step ──────────────┴─ finish ─┬─ no event ────────▸ arrive ─┬─ a break: pass_break
//                                                                           └─ an event ── happen ──┘     └─ a time of results: store_here
//
// Near a singular position (singular_positions.hpp) steps of dop853 come to their limit, since accelerations lose their digits there.  A step that
// would lead over one is taken again, up to some way before; from there the run follows the polynomial of its last accepted step, without evaluations:
//
//     |───────── kept_ ─────────|── ahead_ ──×── ahead_ ──|
//       the last accepted step  t        singular         where dop853 goes on
//
// Accelerations are as wrong at one distance before × as at the same distance behind it, which is why it leads as far beyond.
class single_run {
public:
  single_run(const model &m, const simulation &task, const results &out, std::size_t run,
             std::vector<simulated_event> &events)
      : task_(task), out_(out), of_(m, task, 1), b_(of_, 1), functions_(of_, task), laws_(task, of_, b_),
        singular_(of_), events_(&events), breaks_(breaks_of(task)) {
    const double most = of_.closed() && task.project ? most_of_closed : std::numeric_limits<double>::infinity();
    if (task.method == stepping::dop853)
      step_ = &adaptive_.emplace(of_, run, std::fmin(task.relative, most), std::fmin(task.absolute, most));
    else
      step_ = &equal_.emplace(of_, task.method);
    b_.n = 1;
    be(run, events);
  }

  run_end go() {
    begin();
    const double last = task_.times[task_.times_n - 1];
    while (end_.how == ending::complete && stored_ < task_.times_n && b_.t < last)
      end_.how = advance();
    finish_record();
    return end_;
  }

  /// The beginning of a run in lanes.
  void start(const lone_state &state, std::vector<simulated_event> &events) {
    be(state.run, events);
    of_.set_brakes(false);
    std::fill_n(of_.held_modes(), of_.held_modes() ? of_.nv() : 0, held_joints::mode::free);
    place_ = {}, break_ = stored_ = 0, b_.work[0] = 0, end_ = {};
    begin();
    leave(state);
  }

  /// A step of one in lanes.
  void step(const step_place &place, const lone_state &state, std::vector<simulated_event> &events) {
    be(state.run, events);
    place_ = place, break_ = place.next_break, stored_ = place.stored, end_ = *state.end;
    b_.t = place.t, b_.work[0] = *state.work, at_once_ = 0;
    last_event_ = std::numeric_limits<double>::lowest();
    std::copy_n(state.q, of_.nq(), b_.q.data());
    std::copy_n(state.v, of_.nv(), b_.v.data());
    if (of_.held()) {
      of_.set_brakes(task_.laws.brake && task_.laws.brake_at <= b_.t);
      std::copy_n(state.modes, of_.nv(), of_.held_modes());
    }
    const std::size_t before = of_.evaluations();
    end_.how = step_->begin(b_.t, b_.q.data(), b_.v.data(), b_.work[0]) ? ending::complete : ending::stopped;
    // an event cuts the step, and leaves a rest of it (is_within_), which others may cut
    do {
      end_.how = end_.how == ending::complete ? advance() : end_.how;
    } while (end_.how == ending::complete && is_within_);
    end_.evaluations += of_.evaluations() - before;
    leave(state);
  }

private:
  void be(std::size_t run, std::vector<simulated_event> &events) {
    run_ = b_.first = run, events_ = &events, is_within_ = false;
    functions_.begin_elsewhere(), of_.forget_elements();
    functions_.set_run(run);
    if (equal_)
      equal_->set_run(run);
  }

  void begin() {
    b_.t = task_.times[0];
    std::copy_n(task_.q + run_ * of_.nq(), of_.nq(), b_.q.data());
    std::copy_n(task_.v + run_ * of_.nv(), of_.nv(), b_.v.data());
    end_.how = start();
    if (end_.how == ending::stopped && stored_ == 0) { // the state is known, what drives it isn't
      std::fill(b_.a.begin(), b_.a.end(), std::numeric_limits<double>::quiet_NaN());
      out_.store(of_, stored_++, b_, &closure_);
    }
  }

  void finish_record() {
    if (end_.how != ending::complete)
      out_.erase(of_, run_, stored_);
    end_.time = b_.t, end_.evaluations = of_.evaluations();
    name_element();
  }

  /// A step that shrinks without end may come ever nearer to where a force element has no force.
  void name_element() {
    if (end_.how == ending::not_finite || end_.how == ending::step_underflow)
      end_.element = of_.element(0);
  }

  /// The run goes back to the lanes.
  void leave(const lone_state &state) {
    double power;
    if (end_.how == ending::complete &&
        !of_.accelerate(b_.t, run_, 1, b_.q.data(), b_.v.data(), state.a, state.power ? state.power : &power))
      end_.how = ending::stopped;
    if (end_.how != ending::complete)
      out_.erase(of_, run_, stored_);
    end_.time = b_.t;
    name_element();
    std::copy_n(b_.q.data(), of_.nq(), state.q);
    std::copy_n(b_.v.data(), of_.nv(), state.v);
    *state.work = b_.work[0], *state.end = end_;
    if (of_.held())
      std::copy_n(of_.held_modes(), of_.nv(), state.modes);
  }

  ending start() {
    if (task_.laws.brake && task_.laws.brake_at <= b_.t) {
      of_.set_brakes(true);
      events_->push_back({run_, b_.t, happening::brakes, -1, 0});
    }
    if (of_.held() && !laws_.settle())
      return ending::stopped;
    if (!step_->begin(b_.t, b_.q.data(), b_.v.data(), 0))
      return ending::stopped;
    if (of_.closed())
      singular_.begin(b_.q.data());
    if (!store_here())
      return not_finite(of_, b_, 0) >= 0 ? ending::not_finite : ending::stopped;
    if (adaptive_ && !adaptive_->guess_step(breaks_.front() - b_.t, next_))
      return ending::stopped;
    return ending::complete;
  }

  /// One step, or a part of it that ends at an event.
  /// Between two calls b_ and *step_ have the same state, at b_.t; break_ is the next break, stored_ the next row of results, and next_ the length
  /// that dop853 would like.
  ending advance() {
    if (end_.steps + end_.rejected >= task_.most_steps)
      return ending::too_many_steps;
    if (adaptive_ && stands_still())
      return end_.coordinate = adaptive_->worst(), ending::step_underflow;
    const double until = breaks_[break_], room = until - b_.t;
    if (!(room > same_time * std::fabs(until)) && room < negligible * (breaks_.back() - task_.times[0]))
      return pass_time(until);
    return adaptive_ ? try_step(until, room) : take_equal_step(until, room);
  }

  /// Have the last steps that were tried, many, led to nearly nowhere.
  /// Rejected steps count, too: steps that shrink towards a point in time where no state is finite lead nowhere, each a little less.
  bool stands_still() {
    const std::size_t tried = end_.steps + end_.rejected;
    if (tried < judged_ + watched_steps)
      return false;
    const double way = b_.t - judged_at_;
    judged_ = tried, judged_at_ = b_.t;
    return way < negligible * (breaks_.back() - task_.times[0]);
  }

  /// To a time that is no step away.
  ending pass_time(double t) {
    return step_->begin(t, b_.q.data(), b_.v.data(), b_.work[0]) ? arrive(t) : ending::stopped;
  }

  /// The next of the steps of equal length that lead to a time, or what an event has left of it.
  /// Events don't move the ends of steps: after one at × the run takes the rest of its step.
  ///
  ///     |───────────|──────×────|───────────|
  ///                  part   rest
  ending take_equal_step(double until, double room) {
    step_place &p = place_;
    if (p.taken == p.whole)
      p.begin = b_.t, p.length = room, p.taken = 0, p.whole = equal_steps(b_.t, until, task_.step);
    if (p.whole - p.taken > static_cast<double>(task_.most_steps - end_.steps))
      return ending::too_many_steps;
    const double end = p.end(until), h = is_within_ ? end - b_.t : p.length / p.whole;
    if (is_within_ && !(h > same_time * std::fabs(end))) {
      end_step();
      return pass_time(end);
    }
    const outcome found = step_->attempt(h);
    if (found != outcome::done)
      return why(found);
    if ((end_.coordinate = equal_->not_finite_at_end()) >= 0)
      return ending::not_finite;
    ++end_.steps;
    if (task_.after_step && !task_.after_step(task_.step_context, run_, end))
      return ending::stopped;
    return finish(end);
  }

  void end_step() { ++place_.taken, is_within_ = false; }

  ending why(outcome how) const {
    if (how == outcome::stopped)
      return ending::stopped;
    return how == outcome::not_finite ? ending::not_finite : ending::not_solved;
  }

  ending try_step(double until, double room) {
    // How long the step may be, in this order: it ends before a singular position by before_singular of itself; at the break, if it reaches it; and
    // where two steps lead to the break, each is half of the way.
    dop853_step &step = *adaptive_;
    if (ahead_ <= passed_over * kept_)
      return pass_over(until, room);
    if (next_ > ahead_ / (1 + before_singular))
      next_ = ahead_ / (1 + before_singular);
    const bool ends_at_break = next_ >= room * (1 - 1e-9);
    // no scrap is left: what is longer than one step and shorter than two is halved
    const double h = ends_at_break ? room : std::fmin(next_, room / 2 > next_ ? next_ : room / 2);
    if (!(h > same_time * std::fabs(b_.t)) || !(h > 0))
      return end_.coordinate = step.worst(), std::isfinite(step.error()) ? ending::step_underflow : ending::not_finite;
    if (of_.closed()) {
      step.set_rounding(rounding_at_end(h));
      of_.close_first(task_.project && singular_.pivot() < closes_below);
    }
    if (step.attempt(h) != outcome::done)
      return ending::stopped;
    if (step.error() > 1 || step.largest_turn() > most_turn) {
      ++end_.rejected;
      // at most 0.7 times: it may be too long for its error or for its rotation, of which err says nothing
      const double wanted = std::isfinite(step.error()) ? safety * std::pow(step.error(), -1 / order) : shrinks_at_most;
      next_ = h > less_near * ahead_ ? less_near * ahead_ : h * std::fmin(0.7, std::fmax(shrinks_at_most, wanted));
      was_rejected_ = true;
      if (kept_enough * ahead_ <= kept_)
        return pass_over(until, room);
      return ending::complete;
    }
    ++end_.steps;
    if (task_.after_step && !task_.after_step(task_.step_context, run_, b_.t + h))
      return ending::stopped;
    const double wanted = step.error() > 0 ? safety * std::pow(step.error(), -1 / order) : grows_at_most;
    // h_next = h · min(10, max(0.2, 0.9 err^(−1/8))); it doesn't grow after a rejected step (Hairer, Nørsett and Wanner, II.4, (4.13)).  A step
    // that is short since a break ends it doesn't shorten the next one.
    const double factor = std::fmin(was_rejected_ ? 1 : grows_at_most, std::fmax(shrinks_at_most, wanted));
    next_ = ends_at_break && factor > 1 ? std::fmax(next_, h * factor) : h * factor;
    was_rejected_ = false;
    return finish(ends_at_break ? until : step.t() + h);
  }

  /// Relative rounding of accelerations near a singular position that is ahead of a step, or behind: no error can be told from it.
  double rounding_at_end(double h) const {
    // the last pivot falls to zero there, about linearly; accelerations go as 1 / pivot, and differences of them as 1 / pivot²
    const double pivot = singular_.pivot() * (1 - h / ahead_);
    return std::fmin(rounding_by_pivot / (pivot * pivot), most_rounding);
  }

  /// Goes on as the last step did, over a singular position and as far beyond it, where accelerations are but rounding: velocities don't
  /// jump there, so that of several ways on it is the one with the velocity that the mechanism has.
  ending pass_over(double until, double room) {
    const bool ends_at_break = 2 * ahead_ >= room;
    const double h = ends_at_break ? room : 2 * ahead_;
    adaptive_->go_on(h);
    ++end_.steps;
    if (task_.after_step && !task_.after_step(task_.step_context, run_, b_.t + h))
      return ending::stopped;
    return finish(ends_at_break ? until : b_.t + h);
  }

  /// An accepted step: the events in it, the results at times in it, and its end, at time last.
  ending finish(double last) {
    // 1. A singular position in the step: dop853 takes it again up to some way before, unless it is on the way over it already
    const double singular = of_.closed() ? singular_.find(*step_, step_->end_position(b_.q.data()), passes_over()) : -1;
    if (singular > 0 && adaptive_ && task_.project && !passes_over() && is_before_singular(singular))
      return ending::complete;
    // Which functions there are depends on the modes at the start: what is held may let go, what slides may stop, what is free may strike
    functions_.list();
    found_event event;
    // 2. Events: the first zero of all functions cuts the step there
    // dop853's polynomial costs three evaluations: only where functions or results look into the step
    const bool has_times = stored_ < task_.times_n && task_.times[stored_] < last;
    if (functions_.size() > 0 || has_times)
      if (!step_->make_dense())
        return ending::stopped;
    if (functions_.size() > 0)
      event = first_event(functions_, *step_);
    if (event.search != outcome::done)
      return why(event.search);
    const bool happens = event.share <= 1;
    const double end = happens ? step_->t() + event.share * step_->h() : last;
    // 3. Results at times within the step, up to its end or the event
    if (const ending how = store_until(end, happens); how != ending::complete)
      return how;
    if (happens) {
      // an event before the singular position: it has not been passed
      if (singular >= event.share)
        singular_.take_back();
      return happen(event, end);
    }
    // 4. The step's end.  A singular position that was passed is told; whether one is near ahead is asked before the polynomial of the step is gone.
    if (singular >= 0)
      events_->push_back({run_, step_->t() + singular * step_->h(), happening::singular, -1, 0});
    if (of_.closed() && !look_ahead())
      return ending::stopped;
    // the end of the step is the state of the run; loops that it has opened are closed there
    step_->accept(end);
    functions_.begin_elsewhere();
    b_.t = end, end_step();
    read_state();
    if (of_.closed())
      if (const ending how = project(); how != ending::complete)
        return how;
    return arrive(end);
  }

  /// The run has reached time t: what happens then, and its results.
  ending arrive(double t) {
    b_.t = t;
    if (t == breaks_[break_])
      // also where no step has led here: the break may have been no more than rounding away
      place_.taken = place_.whole, is_within_ = false;
    if (t == breaks_[break_] && break_ + 1 < breaks_.size()) {
      ++break_;
      if (!pass_break())
        return ending::stopped;
    }
    if (stored_ < task_.times_n && task_.times[stored_] == b_.t && !store_here())
      return not_finite(of_, b_, 0) >= 0 ? ending::not_finite : ending::stopped;
    return ending::complete;
  }

  bool passes_over() const { return adaptive_ && adaptive_->goes_on(); }

  /// A step over a singular position, to be taken again up to some way before; false where it begins there.
  bool is_before_singular(double share) {
    const double before = share * step_->h() / (1 + before_singular);
    if (!(before > same_time * std::fabs(b_.t)))
      return false;
    singular_.take_back();
    --end_.steps, ++end_.rejected;
    next_ = before, was_rejected_ = true;
    ahead_ = share * step_->h();
    return true;
  }

  /// Is there a singular position near after the step: then its polynomial is kept.
  bool look_ahead() {
    kept_ = 0;
    ahead_ = adaptive_ && task_.project ? singular_.ahead() * step_->h() : std::numeric_limits<double>::infinity();
    if (!std::isfinite(ahead_))
      return true;
    if (!step_->make_dense())
      return false;
    adaptive_->keep_polynomial();
    kept_ = step_->h();
    return true;
  }

  void read_state() {
    std::copy_n(step_->q(), of_.nq(), b_.q.data());
    std::copy_n(step_->v(), of_.nv(), b_.v.data());
    b_.work[0] = step_->work();
  }

  bool onto_loops() {
    double opened = 0;
    const bool found = of_.project(b_.q.data(), b_.v.data(), opened);
    closure_ = std::fmax(closure_, opened);
    return found;
  }

  ending project() {
    if (!task_.project) {
      closure_ = std::fmax(closure_, of_.closed()->error(b_.q.data()));
      return ending::complete;
    }
    if (!onto_loops())
      return ending::not_closed;
    return step_->begin(b_.t, b_.q.data(), b_.v.data(), b_.work[0]) ? ending::complete : ending::stopped;
  }

  /// At a time where a line of efforts has a corner, or brakes engage.
  /// Drives are continuous there, so that a step which ends at a corner hands its last rates on to the next one; only brakes change them.
  bool pass_break() {
    if (task_.laws.brake && b_.t == task_.laws.brake_at) {
      of_.set_brakes(true);
      events_->push_back({run_, b_.t, happening::brakes, -1, 0});
      if (!laws_.settle())
        return false;
    } else
      return true;
    return step_->begin(b_.t, b_.q.data(), b_.v.data(), b_.work[0]);
  }

  /// Results at the times within the step, up to its end; at the end itself only if something happens there.
  ending store_until(double end, bool including) {
    while (stored_ < task_.times_n && (task_.times[stored_] < end || (including && task_.times[stored_] == end))) {
      const double t = task_.times[stored_];
      const outcome found = step_->at((t - step_->t()) / step_->h(), b_.q.data(), b_.v.data(), b_.work.data());
      if (found != outcome::done)
        return why(found);
      b_.t = t;
      if (of_.closed() && task_.project && !onto_loops())
        return ending::not_closed;
      if (!store_here())
        return not_finite(of_, b_, 0) >= 0 ? ending::not_finite : ending::stopped;
    }
    return ending::complete;
  }

  bool store_here() {
    if (!of_.accelerate(b_.t, run_, 1, b_.q.data(), b_.v.data(), b_.a.data(), b_.power.data()))
      return false;
    if ((end_.coordinate = not_finite(of_, b_, 0)) >= 0)
      return false;
    out_.store(of_, stored_, b_, &closure_);
    ++stored_;
    return true;
  }

  /// The run goes on from the state in which an event left it.
  ending happen(const found_event &event, double t) {
    // The state at the event, on the loops; then the user's functions that are zero there, which may end the run; then laws, which change velocities
    // or modes and leave the loops closed; then the run goes on from that state as from a new beginning.
    const event_functions::function f = functions_[event.index];
    if (const outcome found = step_->at(event.share, b_.q.data(), b_.v.data(), b_.work.data()); found != outcome::done)
      return why(found);
    if (of_.closed() && task_.project && !onto_loops())
      return ending::not_closed;
    is_within_ = true;
    // events without time between them: laws that undo each other would never end
    at_once_ = t > b_.t || t > last_event_ ? 0 : at_once_ + 1;
    b_.t = last_event_ = t;
    if (at_once_ > most_at_once * static_cast<int>(of_.nv()))
      return end_.coordinate = f.what == event_functions::kind::user ? -1 : f.number, ending::endless_events;
    bool ends = false;
    functions_.begin_elsewhere();
    for (std::size_t i = 0; i < event.users.size(); ++i) {
      const int number = event.users[i];
      events_->push_back({run_, t, happening::function, number, 0});
      functions_.begin_at_zero(number, f.what == event_functions::kind::user ? event.sides[i] : 0);
      ends |= task_.events[number].ends;
    }
    if (ends)
      return ending::event;
    if (f.what != event_functions::kind::user) {
      if (!laws_.obey(f, *events_, [this] { return !of_.closed() || !task_.project || onto_loops(); }))
        return ending::stopped;
      if (of_.closed() && task_.project && !onto_loops())
        return ending::not_closed;
    }
    if (of_.closed())
      // velocities may have jumped: what the last step said of the way ahead doesn't hold any more
      singular_.begin(b_.q.data()), ahead_ = std::numeric_limits<double>::infinity();
    return step_->begin(t, b_.q.data(), b_.v.data(), b_.work[0]) ? arrive(t) : ending::stopped;
  }

  const simulation &task_;
  const results &out_;
  std::size_t run_;
  system of_;
  block b_;
  std::optional<dop853_step> adaptive_;
  std::optional<equal_step> equal_;
  continuous_step *step_; ///< one of both
  event_functions functions_;
  law_events laws_;
  singular_positions singular_;
  std::vector<simulated_event> *events_;
  std::vector<double> breaks_;
  std::size_t break_ = 0, stored_ = 0;
  step_place place_ = {};
  bool is_within_ = false; ///< has an event ended the step of equal length before its end
  /// a singular position, s; the step whose polynomial is kept, s
  double ahead_ = std::numeric_limits<double>::infinity(), kept_ = 0;
  double next_ = 0, closure_ = 0, last_event_ = std::numeric_limits<double>::lowest();
  std::size_t judged_ = 0; ///< steps tried when the run was last seen to go on, at
  double judged_at_ = task_.times[0];
  int at_once_ = 0;
  bool was_rejected_ = false;
  run_end end_;
};

// One object serves all runs of a block: be() and what follows it replace all that it holds of the run before.
class one_of_lanes final : public lone_run {
public:
  one_of_lanes(const model &m, const simulation &task, const results &out) : run_(m, task, out, 0, none_) {}

  void start(const lone_state &state, std::vector<simulated_event> &events) override { run_.start(state, events); }
  void step(const step_place &place, const lone_state &state, std::vector<simulated_event> &events) override {
    run_.step(place, state, events);
  }

private:
  std::vector<simulated_event> none_;
  single_run run_;
};

} // namespace

std::vector<double> breaks_of(const simulation &task) {
  const double begin = task.times[0], last = task.times[task.times_n - 1];
  std::vector<double> breaks;
  const auto add = [&](const rows_over_time &rows) {
    for (std::size_t i = 0; rows.n > 1 && i < rows.n; ++i)
      if (rows.times[i] > begin && rows.times[i] < last)
        breaks.push_back(rows.times[i]);
  };
  // steps of equal length end at times of results, whatever drives the run; dop853's end where its derivatives jump
  if (task.method != stepping::dop853)
    add({task.times_n, task.times, nullptr, 0});
  else {
    add(task.drives.given), add(task.drives.position);
    for (int e = 0; e < task.external_n; ++e)
      add(task.external[e].wrench);
  }
  if (task.laws.brake && task.laws.brake_at > begin && task.laws.brake_at < last)
    breaks.push_back(task.laws.brake_at);
  breaks.push_back(last);
  std::sort(breaks.begin(), breaks.end());
  breaks.erase(std::unique(breaks.begin(), breaks.end()), breaks.end());
  return breaks;
}

run_end run_single(const model &m, const simulation &task, const results &out, std::size_t run,
                   std::vector<simulated_event> &events) {
  return single_run(m, task, out, run, events).go();
}

std::unique_ptr<lone_run> make_lone_run(const model &m, const simulation &task, const results &out) {
  return std::make_unique<one_of_lanes>(m, task, out);
}

} // namespace ksl::simulating
