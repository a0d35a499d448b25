// A method by its name, and how many of its steps lie between two times.
#pragma once

#include "ksl/simulate.hpp"
#include "simulate/methods/steps.hpp"

namespace ksl::simulating {

/// A method without error control, for at most `most` runs at once.
std::unique_ptr<method> make_method(stepping how, const system &of, std::size_t most);

/// Into how many steps of at most `step` the time from begin to end is cut, but for rounding of these times and of the quotient.
double equal_steps(double begin, double end, double step);

} // namespace ksl::simulating
