// Factors and inverses of symmetric positive definite matrices over recordings: the steps of ksl/detail/linalg.inc, of which none is chosen by a number.
#pragma once

#include "generate/recording.hpp"

#include <cstddef>

namespace ksl::generate {

/// Element (i, j) of a matrix (n, n).
inline recording &element(recording *A, int n, int i, int j) { return A[static_cast<std::ptrdiff_t>(i) * n + j]; }
inline recording element(const recording *A, int n, int i, int j) { return A[static_cast<std::ptrdiff_t>(i) * n + j]; }

// A = L D Lᵀ (Golub, Van Loan, Matrix Computations (2013), section 4.1).  Step k takes column k off what is left, A_ij −= l_ik (d_k l_jk).  The products
// d_k l_jk lie above the diagonal meanwhile; then L is mirrored there:
//
//     in step 0  [ d₀   d₀l₁₀  d₀l₂₀ ]       in the end  [ d₀   l₁₀  l₂₀ ]
//                [ l₁₀    ·      ·   ]                   [ l₁₀  d₁   l₂₁ ]
//                [ l₂₀    ·      ·   ]                   [ l₂₀  l₂₁  d₂  ]

/// A ← its factors, as linalg_ldlt.  Returns 0, or NaN where a pivot is not above zero.
inline recording ldlt(recording *A, int n) {
  const auto at = [&](int i, int j) -> recording & { return element(A, n, i, j); };
  const recording zero = 0.0, nan = recording(0.0) / recording(0.0);
  recording fault = zero;
  for (int k = 0; k < n; ++k) {
    const recording d = at(k, k);
    fault = math<recording>::select(d > zero, fault, nan);
    for (int i = k + 1; i < n; ++i)
      at(k, i) = at(i, k), at(i, k) = at(i, k) / d;
    for (int i = k + 1; i < n; ++i)
      for (int j = k + 1; j <= i; ++j)
        at(i, j) = at(i, j) - at(i, k) * at(k, j);
    for (int i = k + 1; i < n; ++i)
      at(k, i) = at(i, k);
  }
  return fault;
}

/// x = A⁻¹ x by these factors, as linalg_ldlt_solve.
inline void solve(const recording *A, recording *x, int n) {
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < i; ++k)
      x[i] = x[i] - element(A, n, i, k) * x[k];
  for (int i = 0; i < n; ++i)
    x[i] = x[i] / element(A, n, i, i);
  for (int i = n - 1; i >= 0; --i)
    for (int k = i + 1; k < n; ++k)
      x[i] = x[i] - element(A, n, k, i) * x[k];
}

/// A ← A⁻¹, as linalg_symmetricMatrixInverse.  Returns what ldlt does.
/// A⁻¹ = L⁻ᵀ D⁻¹ L⁻¹: element (i, j), j ≤ i, is Σ_k≥i (L⁻¹)_ki (L⁻¹)_kj / d_k.
inline recording invert(recording *A, int n) {
  const auto at = [&](int i, int j) -> recording & { return element(A, n, i, j); };
  const recording fault = ldlt(A, n);
  for (int j = 0; j < n; ++j) // L⁻¹ below the diagonal,
    for (int i = j + 1; i < n; ++i) {
      recording sum = -at(i, j);
      for (int k = j + 1; k < i; ++k)
        sum = sum - at(i, k) * at(k, j);
      at(i, j) = sum;
    }
  for (int k = 0; k < n; ++k) // above it D⁻¹ L⁻¹, transposed,
    for (int i = 0; i < k; ++i)
      at(i, k) = at(k, i) / at(k, k);
  for (int i = 0; i < n; ++i) { // and their product, row by row
    const recording d = at(i, i);
    for (int j = 0; j <= i; ++j) {
      recording sum = (i == j ? recording(1.0) : at(i, j)) / d;
      for (int k = i + 1; k < n; ++k)
        sum = sum + at(i, k) * at(k, j);
      at(i, j) = at(j, i) = sum;
    }
  }
  return fault;
}

/// NaN in place of n numbers where the fault is.
inline void mark(recording fault, recording *x, std::ptrdiff_t n) {
  for (std::ptrdiff_t i = 0; i < n; ++i)
    x[i] = x[i] + fault;
}

} // namespace ksl::generate
