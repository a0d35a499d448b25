// One run with error control, and its events.
#pragma once

#include "simulate/results.hpp"

namespace ksl::simulating {

run_end run_adaptive(const model &m, const simulation &task, const results &out, std::size_t run,
                     std::vector<simulated_event> &events);

} // namespace ksl::simulating
