// What is made of the dense mass matrix of a model with followers, in place.
//
// A factorization that fails leaves numbers that nothing may depend on: mark() makes NaN of what was computed with them.  Recordings have ldlt,
// invert, solve and mark of their own (src/generate/recorded_matrix.hpp), with the same steps.
#pragma once

#include "engine/kernels/algorithm.hpp"
#include "ksl/linalg.h"

#include <algorithm>
#include <limits>

namespace ksl::mimic {

/// Symmetric positive definite matrices: their factors, or their inverse.  True if the matrix isn't one.
inline bool ldlt(double *A, int n) { return n > 0 && ksl_linalg_ldlt_rmo(A, n) != 0; }
inline bool ldlt(float *A, int n) { return n > 0 && ksl_linalg_ldlt_rmof(A, n) != 0; }
inline bool invert(double *A, int n) { return n > 0 && ksl_linalg_symmetricMatrixInverse_rmo(A, n) != 0; }
inline bool invert(float *A, int n) { return n > 0 && ksl_linalg_symmetricMatrixInverse_rmof(A, n) != 0; }
/// x = A⁻¹ x by the factors of A.
inline void solve(const double *A, double *x, int n) {
  if (n > 0)
    ksl_linalg_ldlt_solve(A, x, x, n, n, 1);
}
inline void solve(const float *A, float *x, int n) {
  if (n > 0)
    ksl_linalg_ldlt_solvef(A, x, x, n, n, 1);
}
template <class S> void mark(bool fault, S *x, std::ptrdiff_t n) {
  if (fault)
    std::fill_n(x, n, std::numeric_limits<S>::quiet_NaN());
}

/// The result of a row that needs M (nv, nv) alone: the solution of M a = τ − bias, M⁻¹ τ, M⁻¹, or a triangle of M.  Overwrites M and bias.
/// If a joint moves no mass, M is singular, and the result is NaN.
template <class S> void finish_dense(mimic_by what, int nv, S *M, S *bias, const S *tau, S *out) {
  if (what == mimic_by::upper_triangle) {
    for (int i = 0; i < nv; ++i)
      std::copy_n(M + i * nv + i, nv - i, out + i * nv + i);
  } else if (what == mimic_by::inverse) {
    mark(invert(M, nv), M, std::ptrdiff_t(nv) * nv);
    std::copy_n(M, nv * nv, out);
  } else {
    for (int i = 0; i < nv; ++i)
      bias[i] = what == mimic_by::solution ? tau[i] - bias[i] : tau[i];
    const auto fault = ldlt(M, nv);
    solve(M, bias, nv);
    mark(fault, bias, nv);
    std::copy_n(bias, nv, out);
  }
}

} // namespace ksl::mimic
