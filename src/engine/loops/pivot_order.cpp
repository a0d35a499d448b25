// Why the order matters, of an arrow:
//
//     x x x      first (0, 0): count (3 − 1)(3 − 1) = 4, and the other four elements are full afterwards
//     x x .      first (1, 1): count (2 − 1)(2 − 1) = 1, and nothing is filled; then (2, 2), then (0, 0)
//     x . x
#include "engine/loops/pivot_order.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ksl::loops {
namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

/// Threshold pivoting (Duff, Erisman and Reid, Direct Methods for Sparse Matrices): |a_ij| ≥ u max_k |a_kj|, in the column since multipliers are a_kj / a_ij.
/// A pivot that makes less work may be smaller than the largest element of its column by this factor, so that no multiplier is above its
/// inverse.
constexpr double large_enough = 0.25;

/// And no smaller than this share of the largest element of all.
constexpr double not_tiny = 0.01;

enum class prefer { least_work, largest };

/// Elimination that remembers its pivots.
class ordering {
public:
  ordering(const equations_at_position &given, prefer wanted) : e_(given), wanted_(wanted) {
    for (const pivot &p : e_.given) {
      element(p.row, p.column) = 1;
      take(p);
    }
    for (int left = e_.rank; left > 0; --left) {
      const pivot p = best_of(left);
      smallest_ = std::min(smallest_, std::fabs(element(p.row, p.column)));
      e_.rows.erase(std::find(e_.rows.begin(), e_.rows.end(), p.row));
      e_.columns.erase(std::find(e_.columns.begin(), e_.columns.end(), p.column));
      take(p);
    }
  }

  const std::vector<pivot> &pivots() const { return pivots_; }
  /// Of those that weren't given.
  double smallest() const { return smallest_; }

private:
  double &element(int row, int column) { return e_.A[index(row * e_.filled.columns() + column)]; }

  /// Among the first `left` rows and columns.
  pivot best_of(int left) {
    std::vector<int> in_row, in_column;
    count(in_row, in_column);
    std::vector<double> of_column(index(left), 0);
    const auto size = [&](int i, int j) { return std::fabs(element(e_.rows[index(i)], e_.columns[index(j)])); };
    for (int i = 0; i < left; ++i)
      for (int j = 0; j < left; ++j)
        of_column[index(j)] = std::max(of_column[index(j)], size(i, j));
    const double largest = *std::max_element(of_column.begin(), of_column.end());

    pivot best = {0, 0};
    int least = 0;
    double of_best = -1;
    for (int i = 0; i < left; ++i)
      for (int j = 0; j < left; ++j) {
        const double wanted =
            wanted_ == prefer::largest ? largest : std::max(large_enough * of_column[index(j)], not_tiny * largest);
        if (!(size(i, j) >= wanted))
          continue;
        // Markowitz's count: a pivot updates so many elements, all other rows of its column at all other columns of its row
        const int work = (in_row[index(i)] - 1) * (in_column[index(j)] - 1);
        if (of_best < 0 || work < least || (work == least && size(i, j) > of_best))
          best = {e_.rows[index(i)], e_.columns[index(j)]}, least = work, of_best = size(i, j);
      }
    return best;
  }

  /// How many elements each row and column that is left has.
  void count(std::vector<int> &in_row, std::vector<int> &in_column) const {
    in_row.assign(e_.rows.size(), 0), in_column.assign(e_.columns.size(), 0);
    for (std::size_t i = 0; i < e_.rows.size(); ++i)
      for (std::size_t j = 0; j < e_.columns.size(); ++j)
        if (e_.filled(e_.rows[i], e_.columns[j]))
          ++in_row[i], ++in_column[j];
  }

  /// Right-looking elimination of a dense copy with its pattern: an element counts as filled once a row with a pivot has reached it, even if it
  /// cancelled to zero at this position.
  void take(const pivot &p) {
    pivots_.push_back(p);
    for (const int i : e_.rows) {
      if (!e_.filled(i, p.column))
        continue;
      const double factor = element(i, p.column) / element(p.row, p.column);
      for (const int j : e_.columns)
        if (e_.filled(p.row, j))
          element(i, j) -= factor * element(p.row, j), e_.filled(i, j) = 1;
    }
  }

  equations_at_position e_; ///< what is left
  prefer wanted_;
  std::vector<pivot> pivots_;
  double smallest_ = std::numeric_limits<double>::infinity();
};

} // namespace

std::vector<pivot> order_of_pivots(const equations_at_position &given) {
  const ordering by_size(given, prefer::largest), by_work(given, prefer::least_work);
  // A sparse order ends at rounding where early pivots left nothing for the last ones.  So its smallest pivot is held against that of an
  // order by size alone.
  return by_work.smallest() >= large_enough * by_size.smallest() ? by_work.pivots() : by_size.pivots();
}

} // namespace ksl::loops
