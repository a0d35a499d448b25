// KSL: A = L D Lᵀ of small symmetric positive definite matrices, over any scalar and without branches.
#pragma once

#include "ksl/engine/lanes/scalar.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// The size of a matrix: N if that is positive, so that loops can be unrolled, or else n.
template <int N> struct matrix_size {
  int n = N;
  KSL_LANES constexpr operator int() const { return N > 0 ? N : n; }
};

/// Factorises A (n, n), row-major, in place, from its lower triangle: L below the diagonal, D⁻¹ on it.  Golub, Van Loan, Matrix
/// Computations (2013), algorithm 4.1.2.
template <int N, class T> KSL_LANES void factorise(T *A, matrix_size<N> n) {
  for (int j = 0; j < n; ++j) {
    T *const row = A + j * n;
    T d = row[j];
    for (int k = 0; k < j; ++k) { // row j holds L D until here
      const T x = row[k];
      row[k] = x * A[k * n + k];
      d = d - x * row[k];
    }
    row[j] = T(1) / d;
    for (int i = j + 1; i < n; ++i) { // column j of L D: the product with D⁻¹ comes when row i is complete
      T x = A[i * n + j];
      for (int k = 0; k < j; ++k)
        x = x - A[i * n + k] * row[k];
      A[i * n + j] = x;
    }
  }
}

/// Solves L D Lᵀ x = b in place.
template <int N, class T> KSL_LANES void solve_factorised(const T *A, T *b, matrix_size<N> n) {
  for (int i = 1; i < n; ++i)
    for (int k = 0; k < i; ++k)
      b[i] = b[i] - A[i * n + k] * b[k];
  for (int i = n - 1; i >= 0; --i) {
    b[i] = b[i] * A[i * n + i];
    for (int k = i + 1; k < n; ++k)
      b[i] = b[i] - A[k * n + i] * b[k];
  }
}

} // namespace KSL_ISA
} // namespace ksl
