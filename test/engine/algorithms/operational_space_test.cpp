// Dynamics at frames over dual numbers: what is the inverse of another stays so as the robot moves.
#include "states.hpp"

#include "ksl/dynamics.hpp"
#include "robot_files.hpp"

#include <cmath>

namespace {

using robots::first, robots::numbers;

/// Is a product of two matrices, (6, n) and (n, 6), the identity, and its derivative zero?
void check_identity(const first *a, const first *b, std::size_t n) {
  for (std::size_t r = 0; r < 6; ++r)
    for (std::size_t c = 0; c < 6; ++c) {
      first sum(0);
      double size = 1;
      for (std::size_t k = 0; k < n; ++k) {
        const first x = a[n * r + k] * b[6 * k + c];
        sum = sum + x, size += std::fabs(x.value) + std::fabs(x.derivative[0]);
      }
      CHECK(std::fabs(sum.value - (r == c)) <= 1e-10 * size);
      CHECK(std::fabs(sum.derivative[0]) <= 1e-9 * size);
    }
}

} // namespace

TEST_CASE("operational space: inverses and their derivatives") {
  const ksl::model m = ksl::load(robot_file("ur5"));
  const robots::request tool = {{m.find_link("tool0")}, {.axes = ksl::expressed_in::world}, {}};
  const robots::state s = {.q = {0.3, -1.1, 1.4, 0.6, 1.2, -0.4}, .v = {0.5, 1.1, -0.7, 0.9, 0.4, -1.2}};
  const robots::state_over<first> moving = robots::moving(m, s, {.q = s.v});
  const auto dynamics = robots::results<algorithms::operational_space>(m, moving, tool);
  CHECK(dynamics.back().value == 6); // inertia, bias, pseudo-inverse, rank
  check_identity(&dynamics[0], robots::results<algorithms::operational_space_inertia_inverse>(m, moving, tool).data(),
                 6);
  check_identity(robots::results<algorithms::jacobian>(m, moving, tool).data(), &dynamics[42], 6);
  const auto inertia = robots::results<algorithms::operational_space_inertia>(m, moving, tool);
  for (std::size_t i = 0; i < 36; ++i)
    CHECK((inertia[i].value == dynamics[i].value && inertia[i].derivative[0] == dynamics[i].derivative[0]));
}

TEST_CASE("operational space: more frames than the workspace has room for are refused") {
  const ksl::model m = ksl::load(robot_file("ur5"));
  ksl::data d(m);
  const numbers<double> q(6, 0.3);
  const std::vector<int> links(m.links().size() + 1, 3);
  const std::size_t rows = 6 * links.size();
  numbers<double> inverse(rows * rows);
  CHECK_THROWS_WITH(ksl::operational_space_inertia_inverse(m, d, q.data(), static_cast<int>(links.size()), links.data(),
                                                           {}, inverse.data()),
                    "operational_space_inertia_inverse: more links than the model has");
}

// As many rows of a positive semidefinite matrix A as its rank are inverted, and the others are zero: so X A X = X and A X A = A.
TEST_CASE("a semidefinite matrix is inverted where it is regular, whatever the sizes of its rows") {
  for (int m : {1, 2, 5, 12})
    for (int rank = 0; rank <= m; ++rank) {
      const auto size = static_cast<std::size_t>(m), inner = static_cast<std::size_t>(rank);
      numbers<double> B(size * inner), A(size * size), memory(4 * size);
      for (std::size_t i = 0; i < size; ++i)
        for (std::size_t k = 0; k < inner; ++k)
          B[i * inner + k] = std::pow(10.0, static_cast<double>(i % 3)) *
                             (std::sin(1.0 + static_cast<double>(i * i + 3 * k + i * k)) + (i % inner == k));
      if (rank > 0)
        A = matrices::product(B, matrices::transposed(B, size), inner);
      if (rank > 0 && rank < m && m > 2) // what rounding leaves of a row that is zero
        for (std::size_t j = 0; j < size; ++j)
          A[size + j] = A[j * size + 1] = j == 1 ? 1e-26 : 0;
      const numbers<double> given = A;
      const double found = ksl::invert_semidefinite(m, A.data(), memory.data());
      std::size_t rows = 0;
      for (std::size_t i = 0; i < size; ++i)
        rows += A[i * size + i] != 0;
      CHECK((found == static_cast<double>(rows) && found >= rank - 1 && found <= rank));
      const numbers<double> product = matrices::product(given, A, size);
      CHECK(matrices::difference(matrices::product(product, given, size), given) < 1e-9);
      CHECK(matrices::difference(matrices::product(A, product, size), A) < 1e-9);
      for (std::size_t i = 0; i < size; ++i)
        for (std::size_t j = 0; j < size; ++j)
          CHECK((A[i * size + j] == A[j * size + i] && (A[i * size + i] != 0 || A[i * size + j] == 0)));
    }
}
