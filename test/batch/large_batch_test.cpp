// Batches that are written past the caches hold the same bits as small ones, wherever their rows begin in memory.
#include "ksl/arrays.h"
#include "ksl/batch.hpp"
#include "random_trees.hpp"

#include "ksl/engine/lanes/transpose.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace {

template <class S> void compare_with_small_batches(const ksl::model &m, std::size_t before, std::size_t gap) {
  const std::size_t width = static_cast<std::size_t>(m.nv()) * static_cast<std::size_t>(m.nv()),
                    nq = static_cast<std::size_t>(m.nq());
  const std::size_t stride = width + gap, n = ksl::streamed_array / (width * sizeof(S)) + 37, part = 50;
  std::mt19937 random(5);
  std::uniform_real_distribution<S> number(S(-2), S(2));
  std::vector<S> q(n * nq), large(before + n * stride + 1, S(-7)), small(part * width);
  std::generate(q.begin(), q.end(), [&] { return number(random); });
  for (std::size_t k = 0; k < n; ++k)
    robots::normalize_quaternions(m, &q[k * nq]);
  ksl::batch_view<S> b;
  b.n = n;
  b.q = {q.data(), m.nq()};
  b.result[0] = {large.data() + before, static_cast<std::ptrdiff_t>(stride)};
  ksl::mass_matrix_batch(m, b, 2);
  std::size_t different = 0;
  for (std::size_t first = 0; first < n; first += part) {
    b.n = std::min(part, n - first);
    b.q.first = q.data() + first * nq;
    b.result[0] = {small.data(), static_cast<std::ptrdiff_t>(width)};
    ksl::mass_matrix_batch(m, b, 1);
    for (std::size_t k = 0; k < b.n; ++k) {
      const S *const row = large.data() + before + (first + k) * stride;
      different += !std::equal(row, row + width, small.data() + k * width);
      different += !std::all_of(row + width, row + stride, [](S x) { return x == S(-7); });
    }
  }
  CHECK(different == 0);
  CHECK(
      std::all_of(large.begin(), large.begin() + static_cast<std::ptrdiff_t>(before), [](S x) { return x == S(-7); }));
  CHECK(large.back() == S(-7));
}

} // namespace

TEST_CASE("large batches hold the same bits as small ones") {
  std::mt19937 random(2);
  for (int bodies : {13, 16, 34}) // the last also where a register is half a line
    for (std::size_t before : {0u, 1u, 3u, 6u})
      for (std::size_t gap : {0u, 5u}) {
        const ksl::model m = robots::random_tree(bodies, random);
        if (static_cast<std::size_t>(m.nv() * m.nv()) * sizeof(float) < ksl::streamed_row)
          continue;
        compare_with_small_batches<double>(m, before, gap);
        compare_with_small_batches<float>(m, before, gap);
      }
}

TEST_CASE("large arrays of wrenches hold the same bits as small ones: packed, apart, and in place") {
  const double D[12] = {0.6, 0.8, 0, -0.8, 0.6, 0, 0, 0, 1, 0.3, -0.2, 0.5};
  const std::size_t n = (std::size_t(8) << 20) / (6 * sizeof(double)) + 11,
                    part = 1000; // of 8 MB on, caches are passed by
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-2, 2);
  std::vector<double> c(6 * n), small(6 * n), packed(6 * n), apart(7 * n, -7);
  std::generate(c.begin(), c.end(), [&] { return number(random); });
  for (std::size_t first = 0; first < n; first += part)
    ksl_array_product_CoAdc(std::min(part, n - first), D, 0, &c[6 * first], 6, &small[6 * first], 6);
  ksl_array_product_CoAdc(n, D, 0, c.data(), 6, packed.data(), 6);
  ksl_array_product_CoAdc(n, D, 0, c.data(), 6, apart.data(), 7);
  ksl_array_product_CoAdc(n, D, 0, c.data(), 6, c.data(), 6);
  CHECK(packed == small);
  CHECK(c == small);
  std::size_t different = 0;
  for (std::size_t k = 0; k < n; ++k)
    different += !std::equal(&small[6 * k], &small[6 * k] + 6, &apart[7 * k]) || apart[7 * k + 6] != -7;
  CHECK(different == 0);
}
