// Runs with steps of the same length between two times.
#pragma once

#include "simulate/results.hpp"

namespace ksl::simulating {

/// A method without error control, for at most `most` runs at once.
std::unique_ptr<method> make_method(stepping how, const system &of, std::size_t most);

/// Into how many steps of at most `step` the time from begin to end is cut, but for rounding of these times and of the quotient.
double equal_steps(double begin, double end, double step);

/// How many runs are computed at once: with one state in each lane, or, where states are computed one by one, one.
std::size_t runs_at_once(const model &m, const simulation &task);

/// The runs [first, first + n), and how they end.
void run_fixed_steps(const model &m, const simulation &task, const results &out, std::size_t first, std::size_t n,
                     run_end *ends);

} // namespace ksl::simulating
