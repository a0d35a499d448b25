// Rows of numbers over time.
//
//     rows    run 0: [row at times[0]] [row at times[1]] … [row at times[n − 1]]
//             run 1:  run_stride numbers further; with run_stride = 0 all runs have the same
//
// Numbers go straight between two times, and stay as they are before the first and behind the last.
#pragma once

#include "ksl/simulate.hpp"

#include <algorithm>

namespace ksl::simulating {

/// Where t lies between times: the row before it, and the share of the way to the next.
struct instant {
  std::size_t before = 0;
  double share = 0, length = 0; ///< length of the interval, s; 0 outside
};
inline instant find(const rows_over_time &rows, double t) {
  if (rows.n < 2 || t <= rows.times[0])
    return {};
  if (t >= rows.times[rows.n - 1])
    return {rows.n - 1, 0, 0};
  const std::size_t after = static_cast<std::size_t>(std::upper_bound(rows.times, rows.times + rows.n, t) - rows.times);
  const double length = rows.times[after] - rows.times[after - 1];
  return {after - 1, (t - rows.times[after - 1]) / length, length};
}

inline const double *row_of(const rows_over_time &rows, std::size_t run, std::size_t k, std::size_t columns) {
  return rows.rows + run * rows.run_stride + k * columns;
}

/// Adds the numbers of a run at an instant to out (columns).
inline void add_at(const rows_over_time &rows, const instant &at, std::size_t run, std::size_t columns, double *out) {
  const double *const x = row_of(rows, run, at.before, columns);
  if (at.share <= 0) {
    for (std::size_t c = 0; c < columns; ++c)
      out[c] += x[c];
    return;
  }
  for (std::size_t c = 0; c < columns; ++c)
    out[c] += x[c] + at.share * (x[columns + c] - x[c]);
}

} // namespace ksl::simulating
