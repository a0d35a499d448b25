// Singular values of a small matrix, by one-sided Jacobi rotations (Golub and Van Loan, Matrix Computations, 8.6.3).
#pragma once

#include <algorithm>
#include <cmath>

namespace ksl::loops {

/// A has n rows of m numbers, whose products with each other are made zero; they are overwritten.  Sets the lengths (n) of the rows,
/// descending: the singular values, of which at most min(m, n) differ from zero by more than rounding.
inline void singular_values(double *A, int n, int m, double *values) {
  const auto dot = [m](const double *x, const double *y) {
    double sum = 0;
    for (int k = 0; k < m; ++k)
      sum += x[k] * y[k];
    return sum;
  };
  for (int sweep = 0; sweep < 60; ++sweep) {
    bool turned = false;
    for (int i = 0; i < n; ++i)
      for (int j = i + 1; j < n; ++j) {
        double *const x = A + i * m, *const y = A + j * m;
        const double xx = dot(x, x), yy = dot(y, y), xy = dot(x, y);
        if (!(std::fabs(xy) > 1e-16 * std::sqrt(xx * yy)))
          continue;
        turned = true;
        // x' = c x − s y and y' = s x + c y are orthogonal where t = s / c has t² + 2 ζ t − 1 = 0; the smaller root turns by at most 45°
        const double zeta = (yy - xx) / (2 * xy),
                     t = std::copysign(1.0, zeta) / (std::fabs(zeta) + std::hypot(1.0, zeta)),
                     c = 1 / std::hypot(1.0, t), s = c * t;
        for (int k = 0; k < m; ++k) {
          const double old = x[k];
          x[k] = c * old - s * y[k], y[k] = s * old + c * y[k];
        }
      }
    if (!turned)
      break;
  }
  for (int i = 0; i < n; ++i)
    values[i] = std::sqrt(dot(A + i * m, A + i * m));
  std::sort(values, values + n, [](double a, double b) { return a > b; });
}

} // namespace ksl::loops
