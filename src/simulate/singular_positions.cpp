#include "simulate/singular_positions.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::simulating {

/// A step is looked at closely where the last pivot at one of its ends is below this share of the largest one so far.
constexpr double watched = 0.3;
/// A minimum of the pivot below this share of it is a zero that was passed.
constexpr double zero = 1e-5;
constexpr int parts = 8, refinements = 50;

double singular_positions::regularity(const double *q) {
  const double found = of_.closed()->regularity(q);
  usual_ = std::fmax(usual_, found);
  return found;
}

double singular_positions::at(continuous_step &step, double share) {
  double work;
  return step.at(share, q_.data(), v_.data(), &work) == outcome::done ? regularity(q_.data()) : usual_;
}

double singular_positions::find(continuous_step &step, const double *q) {
  const double first = before_, last = before_ = regularity(q);
  if (std::fmin(first, last) > watched * usual_ || !step.make_dense())
    return -1;
  double least = first, share = 0;
  for (int part = 1; part <= parts; ++part)
    if (const double found = at(step, static_cast<double>(part) / parts); found < least)
      least = found, share = static_cast<double>(part) / parts;
  double low = std::fmax(0, share - 1.0 / parts), high = std::fmin(1, share + 1.0 / parts);
  for (int k = 0; k < refinements; ++k) { // thirds: a pivot that passes zero falls and rises on straight lines
    const double one = low + (high - low) / 3, two = high - (high - low) / 3;
    (at(step, one) < at(step, two) ? high : low) = at(step, one) < at(step, two) ? two : one;
  }
  share = (low + high) / 2;
  const bool is_inside = share > 1e-9 && share < 1; // the end belongs to the next step
  return is_inside && at(step, share) < zero * usual_ ? share : -1;
}

} // namespace ksl::simulating
