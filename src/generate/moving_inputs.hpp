// How the numbers of an algorithm's inputs vary with rates that are asked for: positions along joint velocities, q ⊕ δ; motions of closed mechanisms with the
// independent coordinates of q, v and a, one of which varies while the others stay.
#pragma once

#include "generate/differentiate.hpp"
#include "generate/record.hpp"

#include <memory>
#include <string>
#include <vector>

namespace ksl::generate {

class moving_inputs {
public:
  /// given: the numbers of the inputs of `of`, a recording of an algorithm whose first input is q, in their order, on the graph in force.
  moving_inputs(const model &, const recorded &of, const recordings &given, bool single);
  ~moving_inputs();
  moving_inputs(const moving_inputs &) = delete;
  moving_inputs &operator=(const moving_inputs &) = delete;

  /// How many numbers the rate of each input has.
  const std::vector<int> &sizes() const { return sizes_; }
  /// The rates of all numbers of all inputs, for a rate of each input.
  recordings rates(std::vector<recordings> of_inputs) const;
  /// The weights that rates have by weights of all numbers of all inputs.
  std::vector<recordings> weights(const recordings &of_numbers) const;
  /// NaN where the mechanism isn't closed, or its plan doesn't serve; else 0.
  recording fault() const;

private:
  class positions;
  struct along;

  std::vector<int> sizes_, numbers_;
  int v_ = -1, a_ = -1; ///< which inputs are velocities and accelerations of a closed mechanism
  std::unique_ptr<const positions> positions_;
  std::unique_ptr<const along> along_;
};

} // namespace ksl::generate
