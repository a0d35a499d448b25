#pragma once

#include "engine/kernels/algorithm_rows.hpp"
#include "engine/kernels/one_state.hpp"
#include "ksl/model.hpp"

namespace ksl::elements {

/// forces_in_states.hpp and with_forces.hpp call it so: measure() for each row that they will call, lay_out() once, then call().  In recordings another class
/// with these three stands in its place (src/generate/).
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
  // where a call for one state, which writes all results, puts those that nobody wants
  std::ptrdiff_t unwanted_n_[most_results] = {};
  S *zero_ = nullptr, *unwanted_[most_results] = {};
  state_in_batch<S> one_ = {};
  void *workspace_ = nullptr;
};

} // namespace ksl::elements
