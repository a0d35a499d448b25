// Rows of results.
#pragma once

#include "simulate/methods/steps.hpp"

namespace ksl::simulating {

class results {
public:
  results(const simulation &task, const simulation_results &out) : task_(task), out_(out) {}

  /// Row i of runs that have reached times[i].  closure (n): the largest opening on the way; replaced by zeros.
  void store(system &of, std::size_t i, const block &b, double *closure) const;

  /// NaN in the rows of a run from i on.
  void erase(const system &of, std::size_t run, std::size_t i) const;

private:
  const simulation &task_;
  const simulation_results out_;
};

/// The energies (n) of runs; each may be null.
void energies(const system &of, const block &b, double *kinetic, double *potential, std::ptrdiff_t stride = 1);

/// The first coordinate of run k of a block whose numbers are not finite; −1: none.
int not_finite(const system &of, const block &b, std::size_t k);
/// The first coordinate whose speed is not finite, which is the first to be so.
int not_finite_speed(const system &of, const block &b, std::size_t k);

} // namespace ksl::simulating
