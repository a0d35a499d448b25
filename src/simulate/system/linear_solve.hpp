// Square systems of linear equations: LU decomposition with partial pivoting.
//
//     A  →  [ U U U U ]      P A = L U, L with ones on its diagonal, which are not stored.  Rows are swapped whole, with the factors to their left,
//           [ L U U U ]      so that all swaps of a right side come before its substitution (Golub, Van Loan, Matrix Computations (2013), 3.4).
//           [ L L U U ]      Row order_[c] and row c were swapped in step c.
//           [ L L L U ]
#pragma once

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace ksl::simulating {

class linear_solve {
public:
  /// Replaces A (n, n), row-major, by its factors; false if it is singular.
  bool factor(std::size_t n, double *A) {
    n_ = n, A_ = A, order_.resize(n);
    for (std::size_t c = 0; c < n; ++c) {
      std::size_t p = c;
      for (std::size_t i = c + 1; i < n; ++i)
        if (std::fabs(A[i * n + c]) > std::fabs(A[p * n + c]))
          p = i;
      if (!(std::fabs(A[p * n + c]) > 0))
        return false;
      order_[c] = p;
      for (std::size_t j = 0; p != c && j < n; ++j)
        std::swap(A[c * n + j], A[p * n + j]);
      for (std::size_t i = c + 1; i < n; ++i) {
        const double factor = A[i * n + c] /= A[c * n + c];
        for (std::size_t j = c + 1; j < n; ++j)
          A[i * n + j] -= factor * A[c * n + j];
      }
    }
    return true;
  }

  /// x (n): A⁻¹ x
  void solve(double *x) const {
    for (std::size_t c = 0; c < n_; ++c)
      std::swap(x[c], x[order_[c]]);
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t j = 0; j < i; ++j)
        x[i] -= A_[i * n_ + j] * x[j];
    for (std::size_t i = n_; i-- > 0;) {
      for (std::size_t j = i + 1; j < n_; ++j)
        x[i] -= A_[i * n_ + j] * x[j];
      x[i] /= A_[i * n_ + i];
    }
  }

private:
  std::size_t n_ = 0;
  const double *A_ = nullptr;
  std::vector<std::size_t> order_;
};

} // namespace ksl::simulating
