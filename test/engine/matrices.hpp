// Products of matrices of any size, row-major, for tests of what algorithms should give.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace matrices {

using numbers = std::vector<double>;

/// The largest difference, for numbers of about the size 1 or of that of the largest expected one; infinite for what is not finite.
inline double difference(const numbers &found, const numbers &expected) {
  double worst = found.size() == expected.size() ? 0 : HUGE_VAL, size = 1;
  for (std::size_t i = 0; i < found.size() && i < expected.size(); ++i) {
    size = std::fmax(size, std::fabs(expected[i]));
    const double here = std::fabs(found[i] - expected[i]);
    worst = std::isfinite(here) ? std::fmax(worst, here) : HUGE_VAL;
  }
  return worst / size;
}

/// a (…, inner) times b (inner, …).
inline numbers product(const numbers &a, const numbers &b, std::size_t inner) {
  const std::size_t rows = a.size() / inner, columns = b.size() / inner;
  numbers c(rows * columns);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t k = 0; k < inner; ++k)
      for (std::size_t j = 0; j < columns; ++j)
        c[i * columns + j] += a[i * inner + k] * b[k * columns + j];
  return c;
}

inline numbers transposed(const numbers &a, std::size_t rows) {
  const std::size_t columns = a.size() / rows;
  numbers t(a.size());
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < columns; ++j)
      t[j * rows + i] = a[i * columns + j];
  return t;
}

inline numbers identity(std::size_t n) {
  numbers unit(n * n);
  for (std::size_t i = 0; i < n; ++i)
    unit[i * (n + 1)] = 1;
  return unit;
}

} // namespace matrices
