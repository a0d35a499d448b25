// The shortest x with A x = b, where rows of A may depend on each other: Gram and Schmidt's method with pivots.
//
// The rows of S A, S the scales, become orthonormal in turn, the longest that is left first: u_0, u_1, …  (Golub and Van Loan, Matrix Computations,
// 5.2, modified Gram–Schmidt.)  What is done to a row is done to its right side, so that after step k
//
//     rows taken         u_i · x = β_i, i ≤ k,   u_i · u_j = δ_ij;
//     rows left          have their part orthogonal to u_0 … u_k, and of the right side what the rows taken leave.
//
// x = Σ β_i u_i solves the rows taken, and has no part orthogonal to the rows of A, which would only make it longer.  A row that is left with nothing
// but a right side contradicts the others by that much.
#pragma once

#include "ksl/engine/algorithms/loops/tolerances.hpp"
#include "ksl/engine/lanes/workspace.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::loops {

class least_norm {
public:
  void lay_out(arena &memory, int rows, int columns) {
    basis_ = memory.take<double>(rows * columns), value_ = memory.take<double>(rows);
    order_ = memory.take<int>(rows);
  }

  int rank = 0;
  double residual = 0; ///< the largest error of an equation that follows from others, relative to its scale

  /// A: (rows, columns); equation i is multiplied by scale[i].  Columns with fixed[j] are left out: x_j = 0 there.  least: rows of which less is
  /// left, scaled, depend on the others.  b may be null.
  void solve(const double *A, int rows, int columns, const double *scale, const unsigned char *fixed, double least,
             const double *b, double *x) {
    std::fill_n(x, columns, 0.0);
    for (int i = 0; i < rows; ++i) {
      order_[i] = i, value_[i] = b ? scale[i] * b[i] : 0;
      for (int j = 0; j < columns; ++j)
        basis_[i * columns + j] = fixed[j] ? 0 : scale[i] * A[i * columns + j];
    }
    double largest = 0;
    for (int i = 0; i < rows; ++i)
      largest = std::max(largest, length(i, columns));
    // `least` knows the mechanism, not this matrix: one whose numbers are all large has rounding beyond it
    const double zero = std::max(least, largest * loop_tolerance::rank);
    for (rank = 0; rank < rows; ++rank) {
      int p = rank;
      double most = 0;
      for (int i = rank; i < rows; ++i)
        if (const double l = length(order_[i], columns); l > most)
          most = l, p = i;
      if (!(most > zero))
        break;
      std::swap(order_[p], order_[rank]);
      const int row = order_[rank];
      double *const u = basis_ + row * columns;
      for (int k = 0; k < rank; ++k) // again: what rounding left of the earlier ones
        reduce(row, order_[k], columns);
      const double inverse = 1 / length(row, columns);
      for (int j = 0; j < columns; ++j)
        u[j] *= inverse;
      value_[row] *= inverse;
      for (int i = rank + 1; i < rows; ++i)
        reduce(order_[i], row, columns);
      for (int j = 0; j < columns; ++j)
        x[j] += value_[row] * u[j];
    }
    residual = 0;
    for (int i = rank; i < rows; ++i)
      residual = std::max(residual, std::fabs(value_[order_[i]]));
  }

private:
  double length(int i, int columns) const {
    double sum = 0;
    for (int j = 0; j < columns; ++j)
      sum += basis_[i * columns + j] * basis_[i * columns + j];
    return std::sqrt(sum);
  }
  /// Takes the part along a unit row off another, and the same of the right sides.
  void reduce(int row, int by, int columns) {
    double *const x = basis_ + row * columns, *const u = basis_ + by * columns;
    double along = 0;
    for (int j = 0; j < columns; ++j)
      along += x[j] * u[j];
    for (int j = 0; j < columns; ++j)
      x[j] -= along * u[j];
    value_[row] -= along * value_[by];
  }

  // rows stay in their places; order_ has those that were taken, in turn, then the others
  double *basis_ = nullptr, *value_ = nullptr;
  int *order_ = nullptr;
};

} // namespace ksl::loops
