// The derivative of a recorded algorithm, as a recording of its own.
#pragma once

#include "generate/record.hpp"

namespace ksl::generate {

enum class derivative {
  rates,           ///< of results, for rates of the inputs
  weights,         ///< of inputs, for weights of the results
  matrix,          ///< of each number of the results by each number of the inputs
  adjoint,         ///< weights, by the numbers of q
  adjoints_matrix, ///< of each number of the adjoint by each number of its inputs
};

/// Inputs are those of record(), and then a rate of each (NAME_dot), or a weight for each number of the results (NAME_bar).  Results are the rates of
/// the results of record() (NAME_dot), or the weights of its inputs (NAME_bar).  Positions change along joint velocities, q ⊕ δ: their rates and
/// weights are nv numbers.  Those of a closed mechanism, and of its v and a, are by the drives (moving_inputs.hpp).
/// The last three, which CasADi asks for, are derivatives of what the steps compute for any numbers, by those of q as they are, of quaternions, too.
/// The matrix has the inputs of record(), and for each pair a result jac_RESULT_INPUT (numbers of the result, numbers of the input), row-major.  The
/// adjoint takes the inputs, and weights adj_RESULT; its results are adj_INPUT.
/// Throws what record() throws, and std::invalid_argument.
recorded record_derivative(const model &, const request &, derivative);

/// record(), or where the engine has derivatives along a closed mechanism that it doesn't compute by its plan, those of what is recorded
/// (differentiated_along).
recorded record_or_differentiate(const model &, const request &);

} // namespace ksl::generate
