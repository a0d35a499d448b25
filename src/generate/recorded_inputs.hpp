// Inputs of a recording as steps, in the order of calls.
#pragma once

#include "generate/recorded.hpp"
#include "generate/recording.hpp"

#include <list>
#include <string>

namespace ksl::generate {

class recorded_inputs {
public:
  explicit recorded_inputs(recorded &of) : of_(of) {}
  /// The next input; good as long as this is.
  const recordings &take(const std::string &name, int numbers) {
    of_.inputs.push_back({name, numbers});
    recordings &x = arrays_.emplace_back();
    for (int i = 0; i < numbers; ++i)
      x.push_back(recording::step_of(of_.steps.input(next_++)));
    return x;
  }
  const recordings &zeros(int numbers) {
    return arrays_.emplace_back(static_cast<std::size_t>(numbers), recording(0.0));
  }

private:
  recorded &of_;
  std::list<recordings> arrays_;
  int next_ = 0;
};

} // namespace ksl::generate
