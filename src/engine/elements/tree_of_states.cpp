#include "engine/elements/tree_of_states.hpp"

#include "engine/mimic/algorithms.hpp"
#include "engine/states/one_state.hpp"

#include <algorithm>

namespace ksl::elements {

template <class S> void tree_of_states<S>::measure(const algorithm_row &row, const batch_view<S> &part) {
  const algorithm_row &computed = row.variant_of ? *row.variant_of : row;
  const extents own = extents_of(m_, part);
  // a call for one state uses the kernel for one
  if (m_.followers())
    bytes_ = std::max({bytes_, coupled::state_bytes<S>(row, m_, own),
                       part.n > 1 ? coupled::run_batch<S>(row, m_, part, 0, 0, nullptr) : 0});
  else
    bytes_ = std::max({bytes_, kernels_of_row<S>(row).workspace_bytes(m_.view_in<S>()),
                       part.n > 1 ? kernels_of_row<S>(row).batch(m_.view_in<S>(), part, 0, 0, nullptr).bytes : 0});
  externals_ = std::max(externals_, part.external_n), reactions_ = std::max(reactions_, part.reactions_n);
  for (int r = 0; r < computed.results; ++r)
    unwanted_n_[r] = std::max(unwanted_n_[r], numbers_of(computed.result[r], own));
}

template <class S> void tree_of_states<S>::lay_out(arena &memory) {
  zero_ = memory.take<S>(m_.nv());
  wrenches_ = memory.take<S>(6 * externals_), links_ = memory.take<int>(externals_);
  wanted_ = memory.take<reaction_result<S>>(reactions_);
  for (int r = 0; r < most_results; ++r)
    unwanted_[r] = memory.take<S>(unwanted_n_[r]);
  workspace_ = memory.take<std::byte>(static_cast<std::ptrdiff_t>(bytes_));
  if (zero_)
    std::fill_n(zero_, m_.nv(), S(0));
}

template <class S> bool tree_of_states<S>::call(const algorithm_row &row, const batch_view<S> &part) {
  if (part.n > 1) {
    if (!m_.followers())
      return kernels_of_row<S>(row).batch(m_.view_in<S>(), part, 0, part.n, workspace_).ordinary;
    coupled::run_batch<S>(row, m_, part, 0, part.n, workspace_);
    return ordinary_results(row, m_, part, 0, part.n);
  }
  const algorithm_row &computed = row.variant_of ? *row.variant_of : row;
  state_view<S> s = first_state(part, links_, wrenches_, wanted_);
  for (const S **x : {&s.v, &s.a, &s.tau})
    if (!*x)
      *x = zero_;
  for (int r = 0; r < computed.results; ++r)
    if (!s.result[r])
      s.result[r] = unwanted_[r];
  if (!m_.followers())
    return kernels_of_row<S>(row).state(m_.view_in<S>(), workspace_, s);
  coupled::run_state<S>(row, m_, workspace_, s);
  return ordinary_results(row, m_, s);
}

template class tree_of_states<double>;
template class tree_of_states<float>;

} // namespace ksl::elements
