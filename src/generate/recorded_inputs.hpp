// Inputs of a recording as steps, in the order of calls.
#pragma once

#include "generate/recorded.hpp"
#include "generate/recording.hpp"

#include <list>
#include <string>
#include <vector>

namespace ksl::generate {

class recorded_inputs {
public:
  explicit recorded_inputs(recorded &of) : of_(of) {}
  /// The next input; good as long as this is.
  const std::vector<recording> &take(const std::string &name, int numbers) {
    of_.inputs.push_back({name, numbers});
    std::vector<recording> &x = arrays_.emplace_back();
    for (int i = 0; i < numbers; ++i)
      x.push_back(recording::step_of(of_.steps.input(next_++)));
    return x;
  }
  const std::vector<recording> &zeros(int numbers) {
    return arrays_.emplace_back(static_cast<std::size_t>(numbers), recording(0.0));
  }

private:
  recorded &of_;
  std::list<std::vector<recording>> arrays_;
  int next_ = 0;
};

} // namespace ksl::generate
