// KSL: the error of a call whose arguments are finite and whose result is not.
#pragma once

#include "ksl/config.h"

#include <cstddef>
#include <stdexcept>
#include <string>

namespace ksl {

/// Finite arguments have a result that is not finite: numbers are too large or too small for the precision, or a joint moves no mass, so that its
/// acceleration is not determined.  The message names the joint, or the first such number, and the state of a batch.  Results have been
/// written as they were computed; the states of a batch don't depend on each other.
class KSL_EXPORT result_error : public std::domain_error {
public:
  result_error(const std::string &sentence, std::size_t of_state, int of_joint)
      : std::domain_error(sentence), state(of_state), joint(of_joint) {}

  std::size_t state; ///< the first such state of a batch; 0 in calls for one state
  int joint;         ///< index into model::joints() of the joint that moves no mass, or −1
};

} // namespace ksl
