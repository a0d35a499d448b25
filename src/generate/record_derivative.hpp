// The derivative of a recorded algorithm, as a recording of its own.
#pragma once

#include "generate/record.hpp"

namespace ksl::generate {

/// Of results, their rates for rates of the inputs; or of inputs, their weights for weights of the results.
enum class derivative { rates, weights };

/// Inputs are those of record(), and then a rate of each (NAME_dot), or a weight for each number of the results (NAME_bar).  Results are the rates of
/// the results of record() (NAME_dot), or the weights of its inputs (NAME_bar).  Positions change along joint velocities, q ⊕ δ: their rates and
/// weights are nv numbers.  Throws what record() throws, and std::invalid_argument.
recorded record_derivative(const model &, const request &, derivative);

} // namespace ksl::generate
