// A batch goes `states` at a time through the same memory, whole blocks of lanes; a single state is a batch of one, in arrays around its own:
//
//     of a batch       [ forces: poses, twists, wrenches of ends | J, its change by q and ∂F, for derivatives | workspace of the tree's calls ]
//     of one state     [ one_as_batch: rows that point to the state's arrays | the same for one state ]
//
// An element that has no force at a state makes the results NaN and `ordinary` false; the other states of the batch are computed all the same.
#include "engine/elements/algorithms.hpp"

#include "engine/elements/with_forces.hpp"
#include "engine/states/ordinary_results.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace ksl::elements {
namespace {

/// How many states of a batch are computed at a time.
template <class S> int states_of(const with_forces<S> &work, const batch_view<S> &batch) {
  return static_cast<int>(std::min<std::size_t>(static_cast<std::size_t>(work.states()), batch.n));
}

} // namespace

void refuse(const algorithm_row &row, const model &m) {
  if (row.elements == elements_by::refusal && m.acting_force_elements() > 0)
    throw std::invalid_argument(
        std::string(row.name) +
        " is not available with force elements between points of two links; leave \"force elements\" out of "
        "the model's physics, or take the first derivatives");
}

template <class S> std::size_t batch_bytes(const algorithm_row &row, const model &m, const batch_view<S> &batch) {
  with_forces<S> work(row, m);
  arena measure;
  work.lay_out(measure, batch, states_of(work, batch));
  return measure.used();
}

template <class S>
bool run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first, std::size_t end,
               void *memory) {
  with_forces<S> work(row, m);
  const int states = states_of(work, batch);
  arena pieces(memory);
  work.lay_out(pieces, batch, states);
  bool ordinary = true;
  for (std::size_t k = first; k < end; k += static_cast<std::size_t>(states))
    ordinary = work.run(batch, k, static_cast<int>(std::min(end - k, static_cast<std::size_t>(states)))) && ordinary;
  return ordinary;
}

/// Counted without a call, for as many wrenches, links and joints as are wanted: of reactions, one request that names the joints of all.
template <class S> std::size_t state_bytes(const algorithm_row &row, const model &m, const room &wanted) {
  const reaction_request request = [&] {
    reaction_request all;
    all.n = wanted.joints;
    return all;
  }();
  const reaction_rows<S> reactions = {request, {}};
  batch_view<S> batch;
  batch.n = 1, batch.external_n = wanted.externals, batch.links = {wanted.links, nullptr}, batch.joints = &request;
  if (row.request == request_kind::reactions) // kernels count the joints of all requests
    batch.reactions_n = 1, batch.reactions = &reactions;
  arena measure;
  one_as_batch<S>().lay_out(measure, wanted.externals, wanted.requests);
  measure.take<reaction_rows<S>>(wanted.requests), measure.take<reaction_result<S>>(wanted.requests);
  return measure.used() + batch_bytes(row, m, batch);
}

template <class S> bool run_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s) {
  arena pieces(memory);
  one_as_batch<S> one;
  one.lay_out(pieces, s.external.n, s.reactions_n);
  const batch_view<S> batch = one.of(s);
  with_forces<S> work(row, m);
  work.lay_out(pieces, batch, 1);
  // What the tree has judged is what its kernel wrote.  Rows that solve with M, to whose results elements have added since, are judged again.
  const bool ordinary = work.run(batch, 0, 1), as_kernel_wrote = row.elements == elements_by::wrenches;
  return ordinary && (!row.needs_mass || as_kernel_wrote || ordinary_results(row, m, s));
}

#define KSL_INSTANTIATE(S)                                                                                             \
  template std::size_t state_bytes<S>(const algorithm_row &, const model &, const room &);                             \
  template bool run_state(const algorithm_row &, const model &, void *, const state_view<S> &);                        \
  template std::size_t batch_bytes(const algorithm_row &, const model &, const batch_view<S> &);                       \
  template bool run_batch(const algorithm_row &, const model &, const batch_view<S> &, std::size_t, std::size_t,       \
                          void *);
KSL_INSTANTIATE(double)
KSL_INSTANTIATE(float)
#undef KSL_INSTANTIATE

} // namespace ksl::elements
