// Runs under exact laws, or with events, in lanes.
#pragma once

#include "simulate/runs/results.hpp"

namespace ksl::simulating {

/// Runs with laws or events, of trees, under steps of equal length, with drives that are no functions: those are called with all runs or with one.
bool go_in_lanes_under_laws(const model &m, const simulation &task);

/// The runs [first, first + n), how they end, and their events.  Bits are those of single runs.
void run_under_laws(const model &m, const simulation &task, const results &out, std::size_t first, std::size_t n,
                    run_end *ends, std::vector<simulated_event> *events);

} // namespace ksl::simulating
