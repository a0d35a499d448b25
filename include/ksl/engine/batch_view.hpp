// KSL: a batch of states as algorithms see it: row-major arrays, a row a state.
#pragma once

#include "ksl/engine/reactions.hpp"

#include <cstddef>

namespace ksl {

/// Rows of numbers; stride is the distance between two rows, in numbers.
template <class S> struct rows_view {
  S *first = nullptr;
  std::ptrdiff_t stride = 0;
};

/// Reactions that are wanted of every state: a row holds request.n × 6 numbers.
template <class S> struct reaction_rows {
  reaction_request request;
  rows_view<S> out;
};

/// n states.  Inputs without rows are zero; results without rows are not wanted.
template <class S> struct batch_view {
  std::size_t n = 0;
  rows_view<const S> q, v, a, tau;
  int external_n = 0;
  const int *external_link = nullptr; ///< (external_n)
  rows_view<const S> external;        ///< a row: external_n × 6
  rows_view<S> out;                   ///< efforts, accelerations, mass matrices: what the algorithm computes
};

inline namespace KSL_ISA {

/// Row k.
template <class S> S *row(const rows_view<S> &rows, std::size_t k) {
  return rows.first + static_cast<std::ptrdiff_t>(k) * rows.stride;
}

/// The same rows from k on; nothing stays nothing.
template <class S> rows_view<S> rows_from(const rows_view<S> &rows, std::size_t k) {
  return rows.first ? rows_view<S>{row(rows, k), rows.stride} : rows_view<S>{};
}

} // namespace KSL_ISA
} // namespace ksl
