// The order of pivots of a plan: least work, unless that ends with pivots that are much smaller than they could be.
#include "engine/loops/pivot_order.hpp"

#include <doctest/doctest.h>
#include <vector>

namespace {

using namespace ksl::loops;

equations_at_position of(const std::vector<std::vector<double>> &A) {
  const int rows = static_cast<int>(A.size()), columns = static_cast<int>(A[0].size());
  equations_at_position e{element_pattern(rows, columns), {}, {}, {}, {}, rows};
  for (int i = 0; i < rows; ++i) {
    e.rows.push_back(i);
    for (int j = 0; j < columns; ++j) {
      const double x = A[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
      e.A.push_back(x), e.filled(i, j) = x != 0;
    }
  }
  for (int j = 0; j < columns; ++j)
    e.columns.push_back(j);
  return e;
}

} // namespace

TEST_CASE("order of pivots: of an arrow the head comes last, and nothing is filled") {
  const std::vector<pivot> order = order_of_pivots(of({{2, 1, 1, 1}, {1, 2, 0, 0}, {1, 0, 2, 0}, {1, 0, 0, 2}}));
  REQUIRE(order.size() == 4);
  CHECK(order[3].row == 0);
  CHECK(order[3].column == 0);
  for (int k = 0; k < 3; ++k)
    CHECK(order[static_cast<std::size_t>(k)].row == order[static_cast<std::size_t>(k)].column);
}

TEST_CASE("order of pivots: no pivot is below a quarter of its column") {
  const std::vector<pivot> order = order_of_pivots(of({{0.1, 1}, {1, 1}}));
  CHECK((order[0].row != 0 || order[0].column != 0));
}

TEST_CASE("order of pivots: given ones come first, also where others make less work") {
  equations_at_position e = of({{2, 1, 1, 1}, {1, 2, 0, 0}, {1, 0, 2, 0}, {1, 0, 0, 2}});
  e.given = {{0, 0}}, e.rows = {1, 2, 3}, e.columns = {1, 2, 3}, e.rank = 3;
  const std::vector<pivot> order = order_of_pivots(e);
  REQUIRE(order.size() == 4);
  CHECK(order[0].row == 0);
  CHECK(order[0].column == 0);
}
