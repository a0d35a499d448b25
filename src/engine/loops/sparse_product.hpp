// Products of small matrices most of whose elements are zero.
#pragma once

#include <type_traits>

namespace ksl::loops {

/// use(n), n as a constant where it is a usual number of freedoms: short loops of a known length take half the time.
template <class Use> void with_width(int n, Use use) {
  switch (n) {
  case 1: return use(std::integral_constant<int, 1>());
  case 2: return use(std::integral_constant<int, 2>());
  case 3: return use(std::integral_constant<int, 3>());
  case 6: return use(std::integral_constant<int, 6>());
  default: return use(n);
  }
}

/// out (rows, n) += sign · matrix (rows, inner) x (inner, n).
inline void add_product(double sign, const double *matrix, int rows, int inner, const double *x, int n, double *out) {
  with_width(n, [=](auto width) {
    for (int i = 0; i < rows; ++i)
      for (int k = 0; k < inner; ++k)
        if (const double factor = sign * matrix[i * inner + k]; factor != 0)
          for (int j = 0; j < width; ++j)
            out[i * width + j] += factor * x[k * width + j];
  });
}

/// out (columns, n) += matrixᵀ x, of matrix (rows, columns) and x (rows, n).
inline void add_transposed_product(const double *matrix, int rows, int columns, const double *x, int n, double *out) {
  with_width(n, [=](auto width) {
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns; ++j)
        if (const double factor = matrix[i * columns + j]; factor != 0)
          for (int k = 0; k < width; ++k)
            out[j * width + k] += factor * x[i * width + k];
  });
}

} // namespace ksl::loops
