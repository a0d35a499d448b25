//     event          velocities                              modes
//     lower, upper   impact: of all that strike              at a limit, if the flight would take no time; else as they were
//     stops          v_k = 0                                 sticks, if its friction holds it
//     lets_go        as they are                             slides, or free
//
#include "simulate/runs/law_events.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::simulating {
namespace {

/// A bounce whose flight takes less than this share of the run is the last one.
constexpr double shortest_flight = 1e-9;
/// Coordinates whose distance to a limit, relative to its size, is less hit it together.
constexpr double together = 1e-12;

} // namespace

// Each event changes v or a mode, and ends in settle(), which decides about all coordinates at rest: what one of them does may let others go.
bool law_events::settle(int slides) {
  return of_.held()->settle(of_, b_.t, b_.first, b_.q.data(), b_.v.data(), b_.a.data(), b_.power.data(), slides);
}

bool law_events::obey(const event_functions::function &f, std::vector<simulated_event> &events,
                      const std::function<bool()> &onto_loops) {
  held_joints &held = *of_.held();
  const int k = f.number;
  double &v = b_.v[static_cast<std::size_t>(k)];
  switch (f.what) {
  case event_functions::kind::lower:
  case event_functions::kind::upper: return strike(k, f.what == event_functions::kind::lower, events);
  case event_functions::kind::stops: {
    v = 0;
    held.at(k) = held_joints::mode::sticks;
    if (!onto_loops()) // what moves with it alone stands, too
      return false;
    if (!settle())
      return false;
    const bool stands =
        held.holds(k) || b_.a[static_cast<std::size_t>(k)] == 0; // others hold it where its friction is not enough
    events.push_back({b_.first, b_.t, stands ? happening::sticks : happening::slips, k, 0});
    return true;
  }
  case event_functions::kind::lets_go: {
    const bool sticks = held.at(k) == held_joints::mode::sticks;
    held.let_go(k);
    events.push_back({b_.first, b_.t, sticks ? happening::slips : happening::lifts, k, 0});
    return settle(k);
  }
  case event_functions::kind::user: break;
  }
  return true;
}

bool law_events::strike(int k, bool lower, std::vector<simulated_event> &events) {
  held_joints &held = *of_.held();
  const std::size_t nv = of_.nv(), at_k = static_cast<std::size_t>(k);
  // impact() asks for responses, which follow an acceleration at the same q
  if (!of_.accelerate(b_.t, b_.first, 1, b_.q.data(), b_.v.data(), b_.a.data(), b_.power.data()))
    return false;
  // all that is at a limit and moves into it is hit at once: one after the other would depend on the order of coordinates
  std::vector<unsigned char> hits(nv, 0);
  for (std::size_t i = 0; i < nv; ++i) {
    const int number = of_.space().number_in_q(static_cast<int>(i));
    if (number < 0 || task_.laws.restitution[i] < 0 || held.holds(static_cast<int>(i)))
      continue;
    double &q = b_.q[static_cast<std::size_t>(number)];
    const double low = task_.laws.lower[i], high = task_.laws.upper[i], near = together * std::fmax(1, std::fabs(q));
    if ((i == at_k && lower) || (q <= low + near && b_.v[i] < 0))
      hits[i] = 1, q = low;
    else if ((i == at_k && !lower) || (q >= high - near && b_.v[i] > 0))
      hits[i] = 1, q = high;
  }
  // an impact takes energy at once: with it in the work, kinetic and potential energy less the work stay what they were
  const double before = kinetic();
  held.impact(of_, b_.q.data(), hits.data(), b_.v.data());
  b_.work[0] += kinetic() - before; // what the impact took
  for (std::size_t i = 0; i < nv; ++i)
    if (hits[i] && !bounce(static_cast<int>(i), events))
      return false;
  return settle();
}

bool law_events::bounce(int k, std::vector<simulated_event> &events) {
  held_joints &held = *of_.held();
  const std::size_t at_k = static_cast<std::size_t>(k);
  const bool lower = b_.q[static_cast<std::size_t>(of_.space().number_in_q(k))] == task_.laws.lower[at_k];
  if (!of_.accelerate(b_.t, b_.first, 1, b_.q.data(), b_.v.data(), b_.a.data(), b_.power.data()))
    return false;
  // thrown back with speed v under an acceleration a towards the limit, it comes back after 2 v / a; where that is no time, it rests there
  const double away = lower ? b_.v[at_k] : -b_.v[at_k], towards = lower ? -b_.a[at_k] : b_.a[at_k];
  const double whole = task_.times[task_.times_n - 1] - task_.times[0];
  const bool rests = towards > 0 && 2 * away <= shortest_flight * whole * towards;
  if (rests) {
    b_.v[at_k] = 0;
    held.at(k) = lower ? held_joints::mode::at_lower : held_joints::mode::at_upper;
  }
  events.push_back({b_.first, b_.t,
                    rests   ? happening::rest
                    : lower ? happening::lower_limit
                            : happening::upper_limit,
                    k, b_.v[at_k]});
  return true;
}

double law_events::kinetic() {
  double kinetic = 0;
  energies(of_, b_, &kinetic, nullptr);
  return kinetic;
}

} // namespace ksl::simulating
