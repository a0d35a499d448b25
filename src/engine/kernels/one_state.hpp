// One state of a batch, and one state as a batch.
//
// A state has arrays of its own for what lies in rows of the batch: its external wrenches, one behind the other, and where its reactions
// go.  Kernels include this, and so it uses nothing of the standard library.
#pragma once

#include "engine/kernels/algorithm.hpp"
#include "ksl/engine/lanes/workspace.hpp"

namespace ksl {
inline namespace KSL_ISA {

constexpr input every_input[] = {input::q, input::v, input::a, input::tau, input::q1, input::fraction};

/// A state of a batch whose numbers stay where they are, but for wrenches.
template <class S> struct state_in_batch {
  int *links;
  S *wrenches;
  reaction_result<S> *reactions;

  void lay_out(arena &memory, int externals, int requests) {
    wrenches = memory.take<S>(6 * externals);
    links = memory.take<int>(externals);
    reactions = memory.take<reaction_result<S>>(requests);
  }

  /// State k of the batch; the view is good until the next call.  Reactions without rows are not asked for.
  state_view<S> load(const batch_view<S> &batch, std::size_t k) const {
    state_view<S> s;
    for (const input x : every_input)
      if (const rows_view<const S> &rows = input_of(batch, x); rows.first)
        input_of(s, x) = ksl::row(rows, k);
    load_requests(batch, k, s);
    for (int r = 0; r < most_results; ++r)
      s.result[r] = batch.result[r].first ? ksl::row(batch.result[r], k) : nullptr;
    return s;
  }

  /// All but inputs and results.
  void load_requests(const batch_view<S> &batch, std::size_t k, state_view<S> &s) const {
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
  }

  /// Row k; zeros if there are no rows.
  static const S *copy(const rows_view<const S> &rows, std::size_t k, int columns, S *out) {
    const S *const from = rows.first ? ksl::row(rows, k) : nullptr;
    for (int c = 0; c < columns; ++c)
      out[c] = from ? from[c] : S(0);
    return out;
  }
};

/// One state of a batch with copies of its inputs, since a result may be written in place over an argument; with zeros for inputs that the batch lacks,
/// and room for results that it doesn't want.  The row is the one whose kernels compute.
template <class S> struct copied_state {
  S *numbers[most_inputs], *unwanted[most_results];
  state_in_batch<S> rest;

  void lay_out(arena &memory, const algorithm_row &row, const extents &of, const batch_view<S> &batch) {
    for (int i = 0; i < row.inputs; ++i)
      numbers[i] = memory.take<S>(length_of(row.input_list[i], of.nq, of.nv));
    rest.lay_out(memory, batch.external_n, batch.reactions_n);
    for (int r = 0; r < row.results; ++r)
      unwanted[r] = memory.take<S>(batch.result[r].first ? 0 : numbers_of(row.result[r], of));
  }

  state_view<S> load(const algorithm_row &row, const extents &of, const batch_view<S> &batch, std::size_t k) const {
    state_view<S> s;
    for (int i = 0; i < row.inputs; ++i) {
      const input x = row.input_list[i];
      input_of(s, x) = rest.copy(input_of(batch, x), k, length_of(x, of.nq, of.nv), numbers[i]);
    }
    rest.load_requests(batch, k, s);
    for (int r = 0; r < row.results; ++r)
      s.result[r] = batch.result[r].first ? ksl::row(batch.result[r], k) : unwanted[r];
    return s;
  }
};

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
    for (const input x : every_input)
      input_of(batch, x) = {input_of(s, x), 0};
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

} // namespace KSL_ISA
} // namespace ksl
