// Runs with steps of the same length between two times.
#pragma once

#include "simulate/runs/results.hpp"

namespace ksl::simulating {

/// How many runs are computed at once: with one state in each lane, or, where states are computed one by one, one.
std::size_t runs_at_once(const model &m, const simulation &task);

/// The runs [first, first + n), and how they end.
void run_fixed_steps(const model &m, const simulation &task, const results &out, std::size_t first, std::size_t n,
                     run_end *ends);

} // namespace ksl::simulating
