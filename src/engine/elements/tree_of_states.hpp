#pragma once

#include "engine/kernels/algorithm_rows.hpp"
#include "engine/kernels/one_state.hpp"
#include "ksl/model.hpp"

namespace ksl::elements {

/// Calls of the kernels of the tree, for several states in lanes or for one alone.
template <class S> class tree_of_states {
public:
  explicit tree_of_states(const model &m) : m_(m) {}

  /// Makes room for calls of the row.
  void measure(const algorithm_row &row, const batch_view<S> &part);
  void lay_out(arena &memory);
  /// Returns whether the results are ordinary.
  bool call(const algorithm_row &row, const batch_view<S> &part);

private:
  const model &m_;
  std::size_t bytes_ = 0;
  int externals_ = 0, reactions_ = 0;
  std::ptrdiff_t unwanted_n_[most_results] = {};
  S *zero_ = nullptr, *unwanted_[most_results] = {};
  state_in_batch<S> one_ = {};
  void *workspace_ = nullptr;
};

} // namespace ksl::elements
