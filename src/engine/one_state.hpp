// One state of a batch, in memory of its own.
#pragma once

#include "engine/coupled.hpp"
#include "ksl/engine/lanes/workspace.hpp"

namespace ksl {

/// Memory to compute one state of a batch in.  The inputs are copied, since a result may be written in place over an argument.
template <class S> struct one_state_memory {
  void *workspace;
  S *numbers[most_inputs], *wrenches, *unwanted[most_results] = {};
  int *links;
  reaction_result<S> *reactions;

  void lay_out(arena &memory, const algorithm_row &row, const model &m, const batch_view<S> &batch,
               std::size_t workspace_bytes) {
    workspace = memory.take<std::byte>(static_cast<std::ptrdiff_t>(workspace_bytes));
    const algorithm_row &computed = row.variant_of ? *row.variant_of : row; // which may have more inputs and results
    for (int i = 0; i < most_inputs; ++i)
      numbers[i] = memory.take<S>(i < computed.inputs ? length_of(computed.input_list[i], m.nq(), m.nv()) : 0);
    wrenches = memory.take<S>(6 * batch.external_n);
    links = memory.take<int>(batch.external_n);
    reactions = memory.take<reaction_result<S>>(batch.reactions_n);
    for (int r = 0; r < computed.results; ++r)
      unwanted[r] =
          batch.result[r].first ? nullptr : memory.take<S>(numbers_of(computed.result[r], extents_of(m, batch)));
  }

  static const S *copy(const rows_view<const S> &rows, std::size_t k, int columns, S *out) {
    const S *const from = rows.first ? row(rows, k) : nullptr;
    for (int c = 0; c < columns; ++c)
      out[c] = from ? from[c] : S(0);
    return out;
  }

  /// State k of the batch, for the row's kernels.
  state_view<S> load(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t k) const {
    const algorithm_row &computed = row.variant_of ? *row.variant_of : row; // which may have more inputs
    state_view<S> s;
    for (int i = 0; i < computed.inputs; ++i) {
      const input x = computed.input_list[i];
      input_of(s, x) = copy(input_of(batch, x), k, length_of(x, m.nq(), m.nv()), numbers[i]);
    }
    for (int e = 0; e < batch.external_n; ++e) {
      links[e] = batch.external[e].link;
      copy(batch.external[e].wrench, k, 6, wrenches + 6 * e);
    }
    s.external = {batch.external_n, links, wrenches, batch.external_axes};
    s.links = batch.links, s.frame = batch.frame, s.joints = batch.joints;
    for (int r = 0; r < batch.reactions_n; ++r)
      if (batch.reactions[r].out.first)
        reactions[s.reactions_n++] = {&batch.reactions[r].request, ksl::row(batch.reactions[r].out, k)};
    s.reactions = reactions;
    for (int r = 0; r < most_results; ++r)
      s.result[r] = batch.result[r].first ? ksl::row(batch.result[r], k) : unwanted[r];
    return s;
  }
};

} // namespace ksl
