#include "simulate/event_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ksl::simulating {

/// The width, as a share of the step, to which a zero is located.
constexpr double resolution = 1e-14;
/// Of a step, before a function that begins at zero is taken to have had none above it: 2⁻⁴⁶ is that width.
constexpr int most_halvings = 46;

event_functions::event_functions(system &of, const simulation &task)
    : of_(of), task_(task), q_(of.nq()), v_(of.nv()), a_(of.nv()) {}

void event_functions::list() {
  list_.clear();
  const held_joints *const held = of_.held();
  if (!held)
    return;
  using mode = held_joints::mode;
  for (int k = 0; k < static_cast<int>(of_.nv()); ++k) {
    const mode now = held->at(k);
    if (held->holds(k))
      list_.push_back({kind::lets_go, k});
    if (now == mode::slides_down || now == mode::slides_up)
      list_.push_back({kind::stops, k});
    const exact_laws &laws = held->laws();
    if (laws.restitution && laws.restitution[k] >= 0 && !held->holds(k)) {
      if (std::isfinite(laws.lower[k]))
        list_.push_back({kind::lower, k});
      if (std::isfinite(laws.upper[k]))
        list_.push_back({kind::upper, k});
    }
  }
}

event_functions::function event_functions::operator[](std::size_t i) const {
  return i < list_.size() ? list_[i] : function{kind::user, static_cast<int>(i - list_.size())};
}

int event_functions::direction(std::size_t i) const {
  return i < list_.size() ? -1 : task_.events[i - list_.size()].direction;
}

outcome event_functions::values(continuous_step &step, double share, double *out) {
  double work, power;
  if (const outcome how = step.at(share, q_.data(), v_.data(), &work); how != outcome::done)
    return how;
  double opened;
  if (of_.closed() && task_.project && share > 0) // where the run would be, were this the event
    of_.project(q_.data(), v_.data(), opened);
  const double t = step.t() + share * step.h();
  bool needs_holding = false;
  for (const function &f : list_)
    needs_holding |= f.what == kind::lets_go;
  if (needs_holding && !of_.accelerate(t, run_, 1, q_.data(), v_.data(), a_.data(), &power))
    return outcome::stopped;
  for (std::size_t i = 0; i < list_.size(); ++i) {
    const int k = list_[i].number;
    const held_joints &held = *of_.held();
    const std::size_t at_k = static_cast<std::size_t>(k), number = static_cast<std::size_t>(of_.space().number_in_q(k));
    switch (list_[i].what) {
    case kind::lower: out[i] = q_[number] - held.laws().lower[at_k]; break;
    case kind::upper: out[i] = held.laws().upper[at_k] - q_[number]; break;
    case kind::stops: out[i] = held.at(k) == held_joints::mode::slides_up ? v_[at_k] : -v_[at_k]; break;
    case kind::lets_go: out[i] = held.margin(k); break;
    case kind::user: break;
    }
  }
  if (task_.events_n == 0)
    return outcome::done;
  double *const users = out + list_.size();
  if (!task_.event_values(task_.event_context, run_, t, q_.data(), v_.data(), users))
    return outcome::stopped;
  const auto finite = [](double x) { return std::isfinite(x); };
  return std::all_of(users, users + task_.events_n, finite) ? outcome::done : outcome::not_finite;
}

namespace {

bool passes(double before, double after, int direction) {
  return (direction <= 0 && before > 0 && after <= 0) || (direction >= 0 && before < 0 && after >= 0);
}

/// The zero of one function between two shares with values of different signs: regula falsi, halving the value that stays (Illinois).
outcome locate(event_functions &functions, continuous_step &step, std::size_t i, double low, double of_low, double high,
               double of_high, std::vector<double> &values, double &share) {
  int side = 0;
  while (high - low > resolution) {
    double middle = (low * of_high - high * of_low) / (of_high - of_low);
    if (!(middle > low && middle < high))
      middle = 0.5 * (low + high);
    if (const outcome how = functions.values(step, middle, values.data()); how != outcome::done)
      return how;
    const double x = values[i];
    if (x == 0) {
      high = middle;
      break;
    }
    if ((x > 0) == (of_low > 0)) {
      of_high = side == -1 ? of_high / 2 : of_high;
      low = middle, of_low = x, side = -1;
    } else {
      of_low = side == 1 ? of_low / 2 : of_low;
      high = middle, of_high = x, side = 1;
    }
  }
  share = high; // beyond the zero, so that it has been passed
  return outcome::done;
}

/// A function of an exact law that begins at zero and ends below it: it may have risen in between, as after an impact.  A share at which
/// it is positive, or zero if there is none.
outcome risen(event_functions &functions, continuous_step &step, std::size_t i, double end, std::vector<double> &values,
              double &share) {
  for (int halvings = 1; halvings < most_halvings; ++halvings) {
    share = std::ldexp(end, -halvings);
    if (const outcome how = functions.values(step, share, values.data()); how != outcome::done || values[i] > 0)
      return how;
  }
  share = 0;
  return outcome::done;
}

} // namespace

found_event first_event(event_functions &functions, continuous_step &step) {
  const std::size_t n = functions.size();
  std::vector<double> before(n), after(n), values(n);
  found_event found;
  if ((found.search = functions.values(step, 0, before.data())) != outcome::done)
    return found;
  const int parts = step.parts();
  for (int part = 1; part <= parts && found.share > 1; ++part) {
    const double low = static_cast<double>(part - 1) / parts, high = static_cast<double>(part) / parts;
    if ((found.search = functions.values(step, high, after.data())) != outcome::done)
      return found;
    for (std::size_t i = 0; i < n; ++i) {
      double from = low, of_from = before[i], share = 2;
      const bool of_law = functions[i].what != event_functions::kind::user;
      if (of_law && part == 1 && before[i] <= 0 && after[i] < 0) {
        if ((found.search = risen(functions, step, i, high, values, from)) != outcome::done)
          return found;
        of_from = values[i];
        if (from == 0)
          share = 0; // it holds at once, or lets go at once
      }
      if (share != 0 && !passes(of_from, after[i], functions.direction(i)))
        continue;
      if (share != 0)
        found.search = locate(functions, step, i, from, of_from, high, after[i], values, share);
      if (found.search != outcome::done)
        return found;
      if (share < found.share)
        found.share = share, found.index = i;
    }
    before = after;
  }
  return found;
}

} // namespace ksl::simulating
