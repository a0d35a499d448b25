// Dynamics at frames over dual numbers: what is the inverse of another stays so as the robot moves.
#include "matrices.hpp"
#include "moved.hpp"
#include "robots.hpp"

#include "ksl/dual.hpp"
#include "ksl/engine/algorithms/operational_space/operational_space.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"

#include <doctest/doctest.h>

#include <cmath>

namespace {

using time_dual = ksl::dual<1>;
template <class T> using numbers = std::vector<T>;

template <class T> struct dynamics {
  numbers<T> inverse, inertia, bias, pseudo_inverse, J;
  T rank;
};

template <class T> dynamics<T> dynamics_of(const ksl::model &m, const numbers<T> &q, const numbers<T> &v,
                                           const int link) {
  const ksl::frame_options how = {.axes = ksl::expressed_in::world};
  const ksl::owned_workspace<ksl::operational_space_workspace<T>> w(m.view());
  const ksl::owned_workspace<ksl::jacobian_workspace<T>> w_jacobian(m.view());
  dynamics<T> d = {numbers<T>(36),           numbers<T>(36),           numbers<T>(6),
                   numbers<T>(6 * v.size()), numbers<T>(6 * v.size()), T(0)};
  ksl::operational_space_inertia_inverse<T>(m.view(), w->propagation, q.data(), 1, &link, how, d.inverse.data());
  ksl::operational_space_inertia<T>(m.view(), w->propagation, q.data(), 1, &link, how, d.inertia.data(), &d.rank);
  ksl::operational_space<T>(m.view(), *w, q.data(), v.data(), 1, &link, how, {}, d.inertia.data(), d.bias.data(),
                            d.pseudo_inverse.data(), &d.rank);
  ksl::jacobian<T>(m.view(), *w_jacobian, q.data(), link, how, d.J.data());
  return d;
}

/// Is a product of two matrices, (6, n) and (n, 6), the identity, and its derivative zero?
void check_identity(const numbers<time_dual> &a, const numbers<time_dual> &b) {
  const std::size_t n = a.size() / 6;
  for (std::size_t r = 0; r < 6; ++r)
    for (std::size_t c = 0; c < 6; ++c) {
      time_dual sum(0);
      double size = 1;
      for (std::size_t k = 0; k < n; ++k) {
        const time_dual x = a[n * r + k] * b[6 * k + c];
        sum = sum + x, size += std::fabs(x.value) + std::fabs(x.derivative[0]);
      }
      CHECK(std::fabs(sum.value - (r == c)) <= 1e-10 * size);
      CHECK(std::fabs(sum.derivative[0]) <= 1e-9 * size);
    }
}

} // namespace

TEST_CASE("operational space: inverses and their derivatives") {
  const ksl::model m = ksl::load(KSL_EXAMPLES "/robots/ur5.urdf");
  const int link = m.find_link("tool0");
  const numbers<double> q = {0.3, -1.1, 1.4, 0.6, 1.2, -0.4}, v = {0.5, 1.1, -0.7, 0.9, 0.4, -1.2};
  numbers<time_dual> step(6, time_dual(0)), v_dual(v.begin(), v.end());
  for (std::size_t i = 0; i < 6; ++i)
    step[i].derivative[0] = v[i];
  const dynamics<time_dual> d = dynamics_of(m, robots::moved(m, q, step), v_dual, link);
  const dynamics<double> plain = dynamics_of(m, q, v, link);
  CHECK(d.rank.value == 6);
  CHECK(plain.rank == 6);
  for (std::size_t i = 0; i < 36; ++i)
    CHECK(d.inertia[i].value == plain.inertia[i]);
  for (std::size_t i = 0; i < 6; ++i)
    CHECK(d.bias[i].value == plain.bias[i]);
  check_identity(d.inertia, d.inverse);
  check_identity(d.J, d.pseudo_inverse);
}

TEST_CASE("operational space: more frames than the workspace has room for are refused") {
  const ksl::model m = ksl::load(KSL_EXAMPLES "/robots/ur5.urdf");
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
