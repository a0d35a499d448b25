// What has been recorded: steps, and what their inputs and outputs are.
#pragma once

#include "generate/graph.hpp"

#include <string>
#include <vector>

namespace ksl::generate {

/// Inputs in the order of calls.
struct recorded_input {
  std::string name;
  int numbers;
};
struct recorded_result {
  std::string name;
  std::vector<int> shape;
};

struct recorded {
  graph steps; ///< with an output for each number of the results, one result after the other
  std::vector<recorded_input> inputs;
  std::vector<recorded_result> results;
};

} // namespace ksl::generate
