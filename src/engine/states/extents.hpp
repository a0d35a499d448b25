// What a call gives and asks for, in numbers: for results, and for memory.
#pragma once

#include "engine/kernels/algorithm_rows.hpp"
#include "ksl/model.hpp"

#include <algorithm>

namespace ksl {

/// The extents of what a user gives and gets, with requests of so many links and joints.
inline extents extents_of(const model &m, int links, int joints) {
  const loop_view<double> *const loops = m.view().loops;
  return {m.nq(),
          m.nv(),
          links,
          joints,
          m.tree_elements(),
          static_cast<int>(m.links().size()),
          loops ? loops->freedoms : 0};
}
template <class View> extents extents_of(const model &m, const View &view) {
  return extents_of(m, view.links.n, view.joints ? view.joints->n : 0);
}

/// The row whose kernels compute a row: it may have more inputs and results.
inline const algorithm_row &computed(const algorithm_row &row) { return row.variant_of ? *row.variant_of : row; }

/// Do the row's kernels, which are those of another row, write more results than this row has?
constexpr bool has_unread_results(const algorithm_row &row) {
  return row.variant_of && row.results < row.variant_of->results;
}

/// The batch without the inputs, wrenches, requests and results that the row doesn't name.
template <class S> batch_view<S> as_row_names(const algorithm_row &row, const batch_view<S> &given) {
  batch_view<S> batch = given;
  for (const input x : {input::v, input::a, input::tau, input::q1, input::fraction})
    if (!row.reads(x))
      input_of(batch, x) = {};
  if (row.external == external_use::none)
    batch.external_n = 0;
  if (row.request != request_kind::reactions)
    batch.reactions_n = 0;
  for (int r = row.results; r < most_results; ++r)
    batch.result[r] = {};
  return batch;
}

/// How many external wrenches, links, joints (in the largest request) and requests for reactions memory must have room for.
struct room { int externals = 0, links = 0, joints = 0, requests = 0; };

template <class S> room room_for(const state_view<S> &s) {
  room wanted = {s.external.n, s.links.n, s.joints ? s.joints->n : 0, s.reactions_n};
  for (int r = 0; r < s.reactions_n; ++r)
    wanted.joints = std::max(wanted.joints, s.reactions[r].request->n);
  return wanted;
}
template <class S> room room_for(const batch_view<S> &batch) {
  room wanted = {batch.external_n, batch.links.n, batch.joints ? batch.joints->n : 0, batch.reactions_n};
  for (int r = 0; r < batch.reactions_n; ++r)
    wanted.joints = std::max(wanted.joints, batch.reactions[r].request.n);
  return wanted;
}

/// A wrench on each link, and one request that names each link and each joint once, those that close loops too: what ksl::data has room for.
inline room room_of_data(const model &m) {
  const int links = static_cast<int>(m.links().size());
  return {links, links, static_cast<int>(m.joints().size() + m.loops().size()), 1};
}

inline extents extents_of(const model &m, const room &wanted) { return extents_of(m, wanted.links, wanted.joints); }

} // namespace ksl
