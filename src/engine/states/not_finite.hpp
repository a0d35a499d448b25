// Numbers that are not finite, and the errors about them.
#pragma once

#include "engine/states/ordinary_results.hpp"
#include "ksl/result_error.hpp"

#include <cmath>
#include <string>

namespace ksl {

/// The first number of the results that is not finite; if all are finite, the first that is large; if none is, name is null.
struct found_number {
  const char *name = nullptr;
  std::ptrdiff_t index = 0;
  double value = 0;
  bool finite = true;
};

template <class S> void look(const char *name, const S *x, std::ptrdiff_t from, std::ptrdiff_t n, found_number &found) {
  for (std::ptrdiff_t i = from; x && i < from + n && found.finite; ++i) {
    const double value = static_cast<double>(x[i]);
    if (!(std::fabs(value) <= large_result) && (!found.name || !std::isfinite(value)))
      found = {name, i, value, std::isfinite(value)};
  }
}

/// The beginning of a message.  Called for errors only, since it allocates.
std::string beginning_of_error(const char *call, std::size_t state, bool of_batch);

/// The error of a number that isn't finite.
template <class S>
result_error not_finite(const char *call, const found_number &found, std::size_t state, bool of_batch);

/// Throws result_error if one of n numbers isn't finite, for results of calls that have no row.  The message begins
/// with the names of the call and the result.  Allocates for an error only.
template <class S>
void examine_numbers(const char *call, const char *result, const S *x, std::ptrdiff_t n, std::size_t state = 0,
                     bool of_batch = false);

} // namespace ksl
