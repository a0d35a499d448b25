// Derivatives of what a graph computes: its steps are recorded again, and beside each of them the step's rate or its weight.
//
//     y = x₀ x₁        rate    y'  = x₀' x₁ + x₀ x₁'                     (forward)
//                      weight  x̄₀ += ȳ x₁,  x̄₁ += ȳ x₀                  (backward)
//
// Both have the Jacobian of the outputs y by the inputs x: for all rates x' and weights ȳ, Σ ȳ_k y'_k = Σ x̄_i x'_i.  rates() is y' = J x', weights()
// is x̄ = Jᵀ ȳ, each for a small multiple of the steps' own cost.
//
// Where a step has no derivative the rule is applied all the same, as by dual numbers (ksl/dual.hpp).
// Source: Griewank and Walther, Evaluating Derivatives (2008), sections 3.1 and 3.2.
#pragma once

#include "generate/recording.hpp"

namespace ksl::generate {

/// The numbers x, and then y.
recordings joined(recordings x, const recordings &y);

class differentiation {
public:
  /// Computes the steps again, on the graph in force.  inputs: what its inputs are there; constants decide what they can.
  differentiation(const graph &of, const recordings &inputs);

  /// The outputs, of which some may be of no step.
  recordings results() const;
  /// The rate of each output for the rates of the inputs; of no step for outputs that aren't written.
  recordings rates(const recordings &of_inputs) const;
  /// The weight of each input: the sum of the weights of outputs times their derivatives by it.
  recordings weights(const recordings &of_outputs) const;

private:
  recording value(int step) const { return values_[static_cast<std::size_t>(step)]; }

  const graph &of_;
  recordings values_;
  std::size_t inputs_;
};

} // namespace ksl::generate
