#include "engine/elements/tree_of_states.hpp"

#include "engine/mimic/algorithms.hpp"

#include <algorithm>

namespace ksl::elements {

template <class S> void tree_of_states<S>::measure(const algorithm_row &row, const batch_view<S> &part) {
  const way_calls<S> &calls = calls_in(mimic::ways<S>, row, m_);
  bytes_ = std::max({bytes_, calls.state_bytes(row, m_, room_for(part)), // of a call for one state
                     part.n > 1 ? calls.batch_bytes(row, m_, part) : 0});
  externals_ = std::max(externals_, part.external_n), reactions_ = std::max(reactions_, part.reactions_n);
  const algorithm_row &all = computed(row);
  const extents own = extents_of(m_, part);
  for (int r = 0; r < all.results; ++r)
    unwanted_n_[r] = std::max(unwanted_n_[r], numbers_of(all.result[r], own));
}

template <class S> void tree_of_states<S>::lay_out(arena &memory) {
  zero_ = memory.take<S>(m_.nv());
  one_.lay_out(memory, externals_, reactions_);
  for (int r = 0; r < most_results; ++r)
    unwanted_[r] = memory.take<S>(unwanted_n_[r]);
  workspace_ = memory.take<std::byte>(static_cast<std::ptrdiff_t>(bytes_));
  if (zero_)
    std::fill_n(zero_, m_.nv(), S(0));
}

/// Calls for one state take arrays for all inputs and results of the row; those of batches leave absent ones out.
template <class S> bool tree_of_states<S>::call(const algorithm_row &row, const batch_view<S> &part) {
  const way_calls<S> &calls = calls_in(mimic::ways<S>, row, m_);
  if (part.n > 1)
    return calls.run_batch(row, m_, part, 0, part.n, workspace_);
  state_view<S> s = one_.load(part, 0);
  for (const S **x : {&s.v, &s.a, &s.tau})
    if (!*x)
      *x = zero_;
  for (int r = 0; r < computed(row).results; ++r)
    if (!s.result[r])
      s.result[r] = unwanted_[r];
  return calls.run_state(row, m_, workspace_, s);
}

template class tree_of_states<double>;
template class tree_of_states<float>;

} // namespace ksl::elements
