// Products of small matrices most of whose elements are zero.
#pragma once

namespace ksl::loops {

/// out (rows, n) += sign · matrix (rows, inner) x (inner, n).
inline void add_product(double sign, const double *matrix, int rows, int inner, const double *x, int n, double *out) {
  for (int i = 0; i < rows; ++i)
    for (int k = 0; k < inner; ++k)
      if (const double factor = sign * matrix[i * inner + k]; factor != 0)
        for (int j = 0; j < n; ++j)
          out[i * n + j] += factor * x[k * n + j];
}

/// out (columns, n) += matrixᵀ x, of matrix (rows, columns) and x (rows, n).
inline void add_transposed_product(const double *matrix, int rows, int columns, const double *x, int n, double *out) {
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j)
      if (const double factor = matrix[i * columns + j]; factor != 0)
        for (int k = 0; k < n; ++k)
          out[j * n + k] += factor * x[i * n + k];
}

} // namespace ksl::loops
