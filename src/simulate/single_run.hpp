// One run with error control, or with events.
#pragma once

#include "simulate/results.hpp"

namespace ksl::simulating {

/// Is each run computed alone: by dop853, under exact laws, with events.
inline bool is_single(const simulation &task) {
  return task.method == stepping::dop853 || task.laws.any() || task.events_n > 0;
}

run_end run_single(const model &m, const simulation &task, const results &out, std::size_t run,
                   std::vector<simulated_event> &events);

} // namespace ksl::simulating
