// What exact laws do to a run at their events: impacts on limits, and friction that begins to hold a joint or lets it go.
#pragma once

#include "simulate/runs/event_search.hpp"

#include <functional>
#include <vector>

namespace ksl::simulating {

class law_events {
public:
  /// b is the state of the run, with its number as b.first.
  law_events(const simulation &task, system &of, block &b) : task_(task), of_(of), b_(b) {}

  /// Changes the state as the law of f does at its event, and reports what happened.  onto_loops() takes the state back onto the loops.
  /// Is false where nothing satisfies the laws, or numbers are not finite.
  bool obey(const event_functions::function &f, std::vector<simulated_event> &events,
            const std::function<bool()> &onto_loops);
  /// Decides which joints are held, after something has changed; `slides` is a coordinate that was let go.
  bool settle(int slides = -1);

private:
  /// An impact of coordinate k, and of those that reach a limit at the same time.
  bool strike(int k, bool lower, std::vector<simulated_event> &events);
  /// Does coordinate k fly after its impact, or does it rest on its limit.
  bool bounce(int k, std::vector<simulated_event> &events);
  double kinetic();

  const simulation &task_;
  system &of_;
  block &b_;
};

} // namespace ksl::simulating
