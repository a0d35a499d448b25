#include "simulate/runs/singular_positions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ksl::simulating {

/// A step is looked at closely where the last pivot at one of its ends is below this share of the largest one so far.
constexpr double watched = 0.3;
/// A minimum of the pivot below this share of it is a zero that was passed.
constexpr double zero = 1e-5;
constexpr int parts = 8, refinements = 50;
/// A singular position has been left, and may come again, where the last pivot is above this share of the largest one: rounding makes many
/// minima near one.
constexpr double left = 1e-3;
/// A minimum closer to an end of the step, as a share of it, is at the end.
constexpr double at_end = 1e-6;

double singular_positions::regularity(const double *q) {
  const double found = of_.closed()->regularity(q);
  usual_ = std::fmax(usual_, found);
  return found;
}

double singular_positions::at(continuous_step &step, double share) {
  double work;
  return step.at(share, q_.data(), v_.data(), &work) == outcome::done ? regularity(q_.data()) : usual_;
}

double singular_positions::find(continuous_step &step, const double *q, bool passes_one) {
  const double first = first_ = before_, last = before_ = regularity(q);
  const bool fell = fell_ = falls_;
  was_near_ = is_near_;
  falls_ = false;
  if (std::fmax(first, last) > left * usual_)
    is_near_ = false;
  if (is_near_ || std::fmin(first, last) > watched * usual_ || !step.make_dense())
    return -1;
  const double share = least_share(step, first);
  if (share > 1 - at_end) { // it may be at the end, or beyond: the next step says
    falls_ = true;
    return -1;
  }
  // a minimum at the common end of two steps belongs to the second, if the pivot fell in the first and rises in this one
  const bool rises = share < at_end; // from the beginning
  if ((rises && !fell) || !((rises ? first : at(step, share)) < (passes_one ? left : zero) * usual_))
    return -1;
  is_near_ = true;
  return rises ? 0 : share;
}

double singular_positions::ahead() const {
  // on the straight line through the pivots at both ends of the last step
  // p(s) = before − (first − before) s, s in lengths of that step from its end on
  const bool is_near = before_ < first_ && before_ < watched * usual_;
  return is_near ? before_ / (first_ - before_) : std::numeric_limits<double>::infinity();
}

/// Where in a step the pivot is least; first: its value at the beginning.
double singular_positions::least_share(continuous_step &step, double first) {
  double least = first, share = 0;
  for (int part = 1; part <= parts; ++part)
    if (const double found = at(step, static_cast<double>(part) / parts); found < least)
      least = found, share = static_cast<double>(part) / parts;
  // the least sample and its neighbours: the minimum lies between them, if there is one only; (2/3)⁵⁰ of that is 2e-9
  double low = std::fmax(0, share - 1.0 / parts), high = std::fmin(1, share + 1.0 / parts);
  for (int k = 0; k < refinements; ++k) { // thirds: a pivot that passes zero falls and rises on straight lines
    const double one = low + (high - low) / 3, two = high - (high - low) / 3;
    (at(step, one) < at(step, two) ? high : low) = at(step, one) < at(step, two) ? two : one;
  }
  return (low + high) / 2;
}

} // namespace ksl::simulating
