// One state of a batch, in memory of its own.
#pragma once

#include "engine/mimic/algorithms.hpp"
#include "ksl/engine/lanes/workspace.hpp"

#include <algorithm>

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

/// The first state of a batch, for kernels of one state.  links, wrenches and reactions have room for those of the batch.
template <class S>
state_view<S> first_state(const batch_view<S> &batch, int *links, S *wrenches, reaction_result<S> *reactions) {
  state_view<S> s;
  s.q = batch.q.first, s.v = batch.v.first, s.a = batch.a.first, s.tau = batch.tau.first;
  for (int e = 0; e < batch.external_n; ++e) {
    links[e] = batch.external[e].link;
    std::copy_n(batch.external[e].wrench.first, 6, wrenches + 6 * e);
  }
  s.external = {batch.external_n, links, wrenches, batch.external_axes};
  s.links = batch.links, s.frame = batch.frame, s.joints = batch.joints;
  for (int r = 0; r < batch.reactions_n; ++r)
    reactions[r] = {&batch.reactions[r].request, batch.reactions[r].out.first};
  s.reactions_n = batch.reactions_n, s.reactions = reactions;
  for (int r = 0; r < most_results; ++r)
    s.result[r] = batch.result[r].first;
  return s;
}

/// One state as a batch.
template <class S> struct one_as_batch {
  external_rows<S> *external = nullptr;
  reaction_rows<S> *reactions = nullptr;

  void lay_out(arena &memory, int externals, int requests) {
    external = memory.take<external_rows<S>>(externals), reactions = memory.take<reaction_rows<S>>(requests);
  }
  batch_view<S> of(const state_view<S> &s) const {
    batch_view<S> batch;
    batch.n = 1;
    batch.q = {s.q, 0}, batch.v = {s.v, 0}, batch.a = {s.a, 0}, batch.tau = {s.tau, 0};
    for (int e = 0; e < s.external.n; ++e)
      external[e] = {s.external.link[e], {s.external.wrench + 6 * std::ptrdiff_t(e), 6}};
    batch.external_n = s.external.n, batch.external = external, batch.external_axes = s.external.axes;
    batch.links = s.links, batch.frame = s.frame, batch.joints = s.joints;
    for (int r = 0; r < s.reactions_n; ++r)
      reactions[r] = {*s.reactions[r].request, {s.reactions[r].out, 0}};
    batch.reactions_n = s.reactions_n, batch.reactions = reactions;
    for (int r = 0; r < most_results; ++r)
      batch.result[r] = {s.result[r], 0};
    return batch;
  }
};

} // namespace ksl
