#include "engine/states/ordinary_results.hpp"

#include "engine/kernels/kernels.hpp"

#include <cmath>

namespace ksl {
namespace {

/// Are all n numbers finite?  Reads a register at a time.
template <class S> bool all_finite(const S *x, std::ptrdiff_t n) {
  if constexpr (sizeof(S) == 8)
    return !x || finite_kernels_in_force().in_double(x, static_cast<std::size_t>(n));
  else
    return !x || finite_kernels_in_force().in_float(x, static_cast<std::size_t>(n));
}

/// Is result r of one state ordinary?
template <class S> bool ordinary_result(const algorithm_row &row, const model &m, int r, const extents &own,
                                        const S *x) {
  const bool triangle = row.mimic == mimic_by::upper_triangle; // below the diagonal nothing was written
  // row i of an upper triangle has n − i numbers from i (n + 1) on; a whole result is one row of them
  const std::ptrdiff_t rows = triangle ? m.nv() : 1, n = triangle ? m.nv() : numbers_of(row.result[r], own);
  for (std::ptrdiff_t i = 0; i < rows; ++i)
    if (!all_finite(x ? x + i * (n + 1) : x, n - i))
      return false;
  for (std::ptrdiff_t i = 0; i < n && row.needs_mass && x; ++i)
    if (!(std::fabs(static_cast<double>(x[i])) <= large_result))
      return false;
  return true;
}

} // namespace

template <class S> bool ordinary_results(const algorithm_row &row, const model &m, const state_view<S> &s) {
  const extents own = extents_of(m, s);
  bool ordinary = true;
  for (int r = 0; r < row.results && ordinary; ++r)
    ordinary = ordinary_result(row, m, r, own, s.result[r]);
  for (int r = 0; r < s.reactions_n && ordinary; ++r)
    ordinary = all_finite(s.reactions[r].out, 6 * std::ptrdiff_t(s.reactions[r].request->n));
  return ordinary;
}

template <class S>
bool ordinary_results(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first,
                      std::size_t end) {
  const extents own = extents_of(m, batch);
  bool ordinary = true;
  for (std::size_t k = first; k < end && ordinary; ++k) {
    for (int r = 0; r < row.results && ordinary; ++r)
      ordinary = !batch.result[r].first || ordinary_result(row, m, r, own, ksl::row(batch.result[r], k));
    for (int r = 0; r < batch.reactions_n && ordinary; ++r)
      ordinary = !batch.reactions[r].out.first ||
                 all_finite(ksl::row(batch.reactions[r].out, k), 6 * std::ptrdiff_t(batch.reactions[r].request.n));
  }
  return ordinary;
}

#define KSL_INSTANTIATE(S)                                                                                             \
  template bool ordinary_results(const algorithm_row &, const model &, const state_view<S> &);                         \
  template bool ordinary_results(const algorithm_row &, const model &, const batch_view<S> &, std::size_t, std::size_t);
KSL_INSTANTIATE(double)
KSL_INSTANTIATE(float)
#undef KSL_INSTANTIATE

} // namespace ksl
