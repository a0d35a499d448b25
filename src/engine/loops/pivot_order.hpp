// The order in which a plan eliminates: which elements of K are pivots, and in what order.
#pragma once

#include <cstddef>
#include <vector>

namespace ksl::loops {

struct pivot { int row, column; };

/// Which elements of a matrix can differ from zero.
class element_pattern {
public:
  element_pattern(int rows, int columns)
      : columns_(columns), is_set_(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns), 0) {}

  int columns() const { return columns_; }
  unsigned char &operator()(int row, int column) { return is_set_[at(row, column)]; }
  bool operator()(int row, int column) const { return is_set_[at(row, column)] != 0; }

private:
  std::size_t at(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
  }

  int columns_;
  std::vector<unsigned char> is_set_;
};

/// K at the position that a plan is made at.
struct equations_at_position {
  element_pattern filled;
  std::vector<double> A;    ///< as `filled`: the elements, all of them lengths
  std::vector<pivot> given; ///< that come first
  std::vector<int> rows;    ///< the others: elimination with complete pivoting has pivots in the first `rank` of them
  std::vector<int> columns; ///< the others, likewise
  int rank;
};

/// The given pivots, then `rank` others.  Each is the element whose elimination makes least work (Markowitz, Management Science 3, 1957,
/// p. 255) of those that are not much smaller than the largest one of their column, unless that ends with pivots that are much smaller than
/// the largest ones would be.
std::vector<pivot> order_of_pivots(const equations_at_position &given);

} // namespace ksl::loops
