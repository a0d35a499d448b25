// Gaussian elimination with complete pivoting of the equations of loops, K x = b.  It finds the rank, coordinates that depend on the
// others, and equations that follow from others.
//
// Rows and columns are scaled first, so that all terms are lengths (tables.hpp): K̃ = R K C.  A pivot is zero if it is below geometry::zero(),
// 1e-9 of a length of the mechanism: the Jacobian of a door on two hinges is nothing but rounding.
//
// What factor() leaves in a_, with rows and columns in the order of pivots; `row` and `column` say which of K each is (Golub and Van Loan, Matrix
// Computations, 3.4):
//
//                    dependent    independent
//                    coordinates  coordinates
//                  ┌────────────┬────────────┐ 0
//     independent  │ \     U    │    U_i     │            K̃ = R K C ≈ L (U | U_i), with ones on the diagonal of L, which aren't stored:
//     equations    │  L  \      │            │            its elements lie where elimination has made zeros
//                  ├────────────┼────────────┤ rank
//     those that   │     L_r    │ |x| ≤ zero │            row r of K̃ = row r of L_r (U | U_i): it follows from those above
//     follow       └────────────┴────────────┘ rows
//
// solved_ holds D = U⁻¹ U_i (rank, freedoms), also with `columns` numbers a row.  With v = C ṽ the equations K v = b are K̃ ṽ = R b, hence
//
//     ṽ_dependent = U⁻¹ L⁻¹ R b − D ṽ_independent.                                                                  (1)
#pragma once

#include "engine/loops/sparse_product.hpp"
#include "ksl/engine/algorithms/loops/tolerances.hpp"
#include "ksl/engine/lanes/workspace.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::loops {

class elimination {
public:
  int rows = 0, columns = 0, rank = 0;
  int *
      row = nullptr,
     *column =
         nullptr; ///< in the order of pivots: the first `rank` equations are independent, the first `rank` coordinates dependent

  void lay_out(arena &memory, int m, int n) {
    rows = m, columns = n;
    a_ = memory.take<double>(m * n), solved_ = memory.take<double>(m * n),
    work_ = memory.take<double>(std::max(m, n) * n);
    row = memory.take<int>(m), column = memory.take<int>(n);
  }

  int freedoms() const { return columns - rank; }
  /// The coordinates that the others follow from, ascending in v.
  const int *independent() const { return column + rank; }

  /// The last pivot relative to the largest term: zero at singular positions.
  double last_pivot() const { return rank > 0 ? std::fabs(at(rank - 1, rank - 1)) / size_ : 1; }
  /// The largest element that is left where rows without a pivot and independent coordinates meet.
  double largest_rest() const {
    double largest = 0;
    for (int i = rank; i < rows; ++i)
      for (int j = rank; j < columns; ++j)
        largest = std::fmax(largest, std::fabs(at(i, j)));
    return largest;
  }

  /// K: (rows, columns), not changed.  size: of the largest scaled term.  zero: pivots that are no larger are none.
  /// is_driven (columns): these coordinates are kept independent where they are as many as the freedoms and determine the motion; may be null.
  void factor(const double *K, const double *row_scale, const double *column_scale, double size, double zero,
              const unsigned char *is_driven, int drives) {
    R_ = row_scale, C_ = column_scale, size_ = size, zero_ = zero;
    // Columns of drives are last.  If the others hold all pivots that there are, and as many columns are left as there are drives, the drives are the
    // independent coordinates.  If a drive became a pivot, or another coordinate had none, the preference can't be kept as a whole, and is dropped.
    if (drives > 0) {
      load(K, is_driven);
      const int without = eliminate(0, columns - drives);
      const int with_all = eliminate(without, columns);
      rank = with_all;
      if (with_all == without && columns - rank == drives)
        return finish();
    }
    load(K, nullptr);
    rank = eliminate(0, columns);
    finish();
  }

  /// Elimination with pivots in columns of earlier stages before others: coordinates of late stages are independent, if any are.  stages (columns): from 0 on.
  void factor_by_stages(const double *K, const double *row_scale, const double *column_scale, double size, double zero,
                        const unsigned char *stages) {
    R_ = row_scale, C_ = column_scale, size_ = size, zero_ = zero;
    load(K, stages);
    rank = 0;
    // pivots are exchanged among columns before `end` alone, so that those of later stages stay where load() has put them
    for (int end = 1; end <= columns; ++end)
      if (end == columns || stages[column[end]] != stages[column[end - 1]])
        rank = eliminate(rank, end);
    finish();
  }

  /// Elimination with some coordinates left out, `fixed` in number.  Do the equations determine all others?  Pivots are the largest of their
  /// columns only, which is faster, and as good where no rank is asked for.
  bool determine(const double *K, const double *row_scale, const double *column_scale, double size,
                 const unsigned char *is_fixed, int fixed) {
    R_ = row_scale, C_ = column_scale, size_ = size;
    load(K, is_fixed);
    const int wanted = columns - fixed;
    for (rank = 0; rank < std::min(rows, wanted); ++rank) {
      int p = rank;
      for (int i = rank + 1; i < rows; ++i)
        if (std::fabs(at(i, rank)) > std::fabs(at(p, rank)))
          p = i;
      if (!(std::fabs(at(p, rank)) > loop_tolerance::nearly_singular * size_))
        break;
      take_pivot(rank, p, rank, wanted);
    }
    return rank == wanted;
  }

  /// (1) with ṽ_independent = 0:
  /// x (columns, n) with K x = b (rows, n) for the independent equations, zero at independent coordinates and those that are left out; at most
  /// as many right sides n as there are coordinates.
  void solve_dependent(const double *b, int n, double *x) const {
    solve_equations(b, n);
    std::fill_n(x, columns * n, 0.0);
    for (int i = 0; i < rank; ++i)
      for (int c = 0; c < n; ++c)
        x[column[i] * n + c] = work_[i * n + c] * C_[column[i]];
  }

  /// How a dependent coordinate follows from an independent one: x_i = element(i, j) x_j for b = 0.
  double element(int dependent, int free) const {
    return -solved_[dependent * columns + free] * C_[column[dependent]] / C_[column[rank + free]];
  }

  /// x (columns) from its independent coordinates, which it has, with K x = b for the independent equations.
  void complete(const double *b, double *x) const {
    solve_equations(b, 1);
    for (int i = 0; i < rank; ++i) {
      double sum = work_[i] * C_[column[i]];
      for (int j = 0; j < freedoms(); ++j)
        sum += element(i, j) * x[column[rank + j]];
      x[column[i]] = sum;
    }
  }

  /// Multipliers λ (rows) with (Kᵀ λ)_i = y_i for dependent coordinates i; zero for equations that follow from others.
  void multipliers(const double *y, double *lambda) const {
    std::fill_n(lambda, rows, 0.0);
    // Kᵀ λ = y is K̃ᵀ λ̃ = C y with λ = R λ̃; of its dependent rows Uᵀ Lᵀ λ̃ = C y, and λ̃ = L⁻ᵀ z
    for (int i = 0; i < rank; ++i) { // Uᵀ z = C y
      double sum = C_[column[i]] * y[column[i]];
      for (int k = 0; k < i; ++k)
        sum -= at(k, i) * work_[k];
      work_[i] = sum / at(i, i);
    }
    back_through_lower(lambda);
  }

  /// Multipliers (rows) with Kᵀ λ = 0, of which redundant equation number k (of rows − rank) has one.
  void null_vector(int k, double *lambda) const {
    // row rank + k of K̃ is l (U | U_i) up to what counts as zero, l its row of L_r: λ̃ is −L⁻ᵀ lᵀ at the independent equations, and 1 at this one
    std::fill_n(lambda, rows, 0.0);
    for (int i = 0; i < rank; ++i)
      work_[i] = -at(rank + k, i);
    back_through_lower(lambda);
    lambda[row[rank + k]] = R_[row[rank + k]];
  }

private:
  double &at(int i, int j) const { return a_[i * columns + j]; }

  void load(const double *K, const unsigned char *stages) {
    int n = 0;
    for (int stage = 0; n < columns; ++stage)
      for (int j = 0; j < columns; ++j)
        if ((stages ? stages[j] : 0) == stage)
          column[n++] = j;
    for (int i = 0; i < rows; ++i) {
      row[i] = i;
      for (int j = 0; j < columns; ++j)
        at(i, j) = K[i * columns + column[j]] * R_[i] * C_[column[j]];
    }
  }

  /// Eliminates from pivot number k on, with pivots in columns before `end`.  Returns how many pivots there are in all.
  int eliminate(int k, int end) {
    for (; k < std::min(rows, end); ++k) {
      int p = k, c = k;
      double largest = 0;
      for (int i = k; i < rows; ++i)
        for (int j = k; j < end; ++j)
          if (const double x = std::fabs(at(i, j)); x > largest)
            largest = x, p = i, c = j;
      if (!(largest > zero_))
        return k;
      take_pivot(k, p, c, columns);
    }
    return k;
  }

  /// Brings element (p, c) to place k, and eliminates below it, in columns before `end`.
  /// line[k] becomes l = line[k] / pivot, the element of L.  Rows are exchanged whole, with the part of L that they have.
  void take_pivot(int k, int p, int c, int end) {
    if (p != k) {
      std::swap(row[p], row[k]);
      std::swap_ranges(&at(p, 0), &at(p, 0) + columns, &at(k, 0));
    }
    if (c != k) {
      std::swap(column[c], column[k]);
      for (int i = 0; i < rows; ++i)
        std::swap(at(i, c), at(i, k));
    }
    const double inverse = 1 / at(k, k);
    const double *const pivot = &at(k, 0);
    for (int i = k + 1; i < rows; ++i) {
      double *const line = &at(i, 0);
      if (line[k] == 0)
        continue;
      const double factor = line[k] *= inverse;
      for (int j = k + 1; j < end; ++j)
        line[j] -= factor * pivot[j];
    }
  }

  /// Orders the independent coordinates, and solves U D = U_i, from the last row up.
  void finish() {
    for (int a = rank + 1; a < columns; ++a) // few, and nearly in order
      for (int b = a; b > rank && column[b] < column[b - 1]; --b) {
        std::swap(column[b], column[b - 1]);
        for (int i = 0; i < rank; ++i)
          std::swap(at(i, b), at(i, b - 1));
      }
    const int f = freedoms();
    for (int i = rank - 1; i >= 0; --i) {
      double *const line = solved_ + i * columns;
      std::copy_n(&at(i, rank), f, line);
      for (int k = i + 1; k < rank; ++k) {
        const double factor = at(i, k), *const below = solved_ + k * columns;
        for (int j = 0; j < f && factor != 0; ++j)
          line[j] -= factor * below[j];
      }
      const double inverse = 1 / at(i, i);
      for (int j = 0; j < f; ++j)
        line[j] *= inverse;
    }
  }

  /// work_ (rank, n): x̃ of the dependent coordinates with L U x̃ = R b, b (rows, n).  Factors of most mechanisms are sparse.
  void solve_equations(const double *b, int n) const {
    with_width(n, [this, b](auto width) {
      const auto take_off = [&](int i, int k) {
        if (const double factor = at(i, k); factor != 0)
          for (int c = 0; c < width; ++c)
            work_[i * width + c] -= factor * work_[k * width + c];
      };
      for (int i = 0; i < rank; ++i) {
        for (int c = 0; c < width; ++c)
          work_[i * width + c] = R_[row[i]] * b[row[i] * width + c];
        for (int k = 0; k < i; ++k)
          take_off(i, k);
      }
      for (int i = rank - 1; i >= 0; --i) {
        for (int k = i + 1; k < rank; ++k)
          take_off(i, k);
        for (int c = 0; c < width; ++c)
          work_[i * width + c] /= at(i, i);
      }
    });
  }

  /// λ = R L⁻ᵀ work_, for the independent equations.
  void back_through_lower(double *lambda) const {
    for (int i = rank - 1; i >= 0; --i) {
      double sum = work_[i];
      for (int k = i + 1; k < rank; ++k)
        sum -= at(k, i) * work_[k];
      work_[i] = sum;
    }
    for (int i = 0; i < rank; ++i)
      lambda[row[i]] = R_[row[i]] * work_[i];
  }

  double *a_ = nullptr, *solved_ = nullptr, *work_ = nullptr;
  const double *R_ = nullptr, *C_ = nullptr;
  double size_ = 1, zero_ = 0;
};

} // namespace ksl::loops
