// Which kernel computes what, and what it gets in place of the arguments.  `steady` makes the plan find accelerations itself:
//
//     loops_by        kernel                                   motion
//     efforts         closed_inverse_dynamics                  q, v, a
//     parts           the same, and the tree's effort_parts    q, v, a
//     statics         closed_inverse_dynamics                  q; v and a are zero
//     steady          closed_inverse_dynamics, view.steady     q, v; a are those at which independent coordinates have none
//     reactions       closed_inverse_dynamics_with_reactions   q, v, a
//     accelerations   closed_forward_dynamics                  q, v, tau
//     jump            closed_forward_dynamics, no gravity      q, external wrenches for impulses; v and tau are zero: M Δv = Σ Jᵀ p as M a = Σ Jᵀ f
//
// parts_ (states, 5, nv): transmitted, damping, friction, rotor, spring (effort_parts.hpp).
#include "engine/loops/closed_by_plan.hpp"

#include "engine/mimic/mechanism_kernel.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::loops {
namespace {

/// How many parts efforts have.
constexpr int parts = 5;

template <class S> bool determines_efforts(const loop_view<S> &loops) {
  return loops.drives_are_independent || loops.freedoms == 0 || loops.drives > 0;
}

/// A state that the plan doesn't fit, a pivot that is too small or a loop that is open, has NaN in all its results (loop_view.hpp).
template <class S> bool are_numbers(const S *x, std::ptrdiff_t n) {
  // 0 x is NaN for NaN and infinities, and 0 for all others
  S sum = 0;
  for (std::ptrdiff_t k = 0; k < n; ++k)
    sum += x[k] * S(0);
  return sum == S(0);
}

} // namespace

const algorithm_row &row_by_plan(loops_by by) {
  return by == loops_by::accelerations || by == loops_by::jump ? rows::closed_forward_dynamics
         : by == loops_by::reactions                           ? rows::closed_inverse_dynamics_with_reactions
                                                               : rows::closed_inverse_dynamics;
}

template <class S> bool plan_suits(loops_by by, const model_view<S> &view, bool elements_act) {
  const loop_view<S> *const loops = view.loops;
  if (!loops || view.nv == 0)
    return false;
  switch (by) {
  case loops_by::accelerations: return loops->freedoms > 0;
  case loops_by::jump: // springs would act, and armatures have to
    return loops->freedoms > 0 && !view.physics && !elements_act;
  case loops_by::steady: return loops->drives_are_independent || loops->freedoms == 0;
  case loops_by::efforts:
  case loops_by::statics:
  case loops_by::parts:
  case loops_by::reactions: return determines_efforts(*loops);
  default: return false;
  }
}

bool linear_suits(const algorithm_row &row, const model_view<double> &view) {
  if (!view.loops || view.nv == 0)
    return false;
  return row.request == request_kind::joints ? determines_efforts(*view.loops)
                                             : view.loops->drives_are_independent && view.loops->freedoms > 0;
}

template <class S> bool closed_by_plan<S>::suits() const { return plan_suits(row_.loops, view_, forces_.ends() > 0); }

template <class S> void closed_by_plan<S>::lay_out(arena &memory, const batch_view<S> &batch, int states) {
  const int nv = m_.nv(), externals = batch.external_n + forces_.ends();
  int joints = 0; // of all requests, for what is measured below
  for (int r = 0; r < batch.reactions_n; ++r)
    joints += batch.reactions[r].request.n;
  numbers_ = memory.take<S>(states * nv), still_ = memory.take<S>(nv);
  external_ = memory.take<external_rows<S>>(externals);
  reactions_ = memory.take<reaction_rows<S>>(batch.reactions_n);
  state_.lay_out(memory, externals, batch.reactions_n);
  std::size_t bytes = 0;
  parts_ = memory.take<S>(row_.loops == loops_by::parts ? std::ptrdiff_t(states) * parts * nv : 0);
  reaction_rows<S> rows[1];
  for (const algorithm_row *row : // those of any call, since memory is measured for one of them
       {&rows::closed_forward_dynamics, &rows::closed_inverse_dynamics, &rows::closed_inverse_dynamics_with_reactions,
        &rows::effort_parts}) {
    batch_view<S> part;
    reaction_request all;
    all.n = joints;
    rows[0] = {all, {}};
    part.n = static_cast<std::size_t>(states), part.external_n = externals, part.reactions_n = 1, part.reactions = rows;
    const mimic::mechanism_kernel<S> kernel = {*row, m_, view_};
    bytes = std::max(bytes, kernel.state_bytes());
    if (states > 1)
      bytes = std::max(bytes, kernel.batch_bytes(part));
  }
  workspace_ = memory.take<std::byte>(static_cast<std::ptrdiff_t>(bytes));
  if (forces_.ends() > 0)
    forces_.lay_out(memory, batch.external_n, states);
}

/// Rows of the caller's from state `first` on; what the table above has as zero is still_, one row for all states, with a stride of zero.
template <class S> batch_view<S> closed_by_plan<S>::part_of(const batch_view<S> &batch, std::size_t first,
                                                            int n) const {
  batch_view<S> part;
  part.n = static_cast<std::size_t>(n);
  part.q = rows_from(batch.q, first), part.v = rows_from(batch.v, first), part.a = rows_from(batch.a, first);
  part.tau = rows_from(batch.tau, first);
  if (row_.loops == loops_by::statics)
    part.v = part.a = {still_, 0};
  if (row_.loops == loops_by::steady)
    part.a = {still_, 0};
  if (row_.loops == loops_by::jump)
    part.v = part.tau = {still_, 0};
  const bool elements = forces_.ends() > 0; // `first` is the state that run has set them at
  for (int e = 0; e < batch.external_n + forces_.ends(); ++e)
    external_[e] = elements ? forces_.external()[e]
                            : external_rows<S>{batch.external[e].link, rows_from(batch.external[e].wrench, first)};
  part.external_n = batch.external_n + forces_.ends(), part.external = external_,
  part.external_axes = batch.external_axes;
  return part;
}

/// Several states in lanes, or one alone.
template <class S> void closed_by_plan<S>::call(const algorithm_row &row, const batch_view<S> &part) {
  const mimic::mechanism_kernel<S> kernel = {row, m_, view_};
  if (part.n > 1) {
    kernel.batch(part, workspace_);
    return;
  }
  kernel.state(workspace_, state_.load(part, 0));
}

/// The parts of efforts, where numbers_ has efforts (algorithms.cpp says what they are).
template <class S>
void closed_by_plan<S>::set_parts(const batch_view<S> &batch, batch_view<S> part, std::size_t first, const bool *done) {
  const std::ptrdiff_t nv = m_.nv();
  part.reactions_n = 0, part.result[0] = {parts_, parts * nv};
  call(rows::effort_parts, part);
  for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(part.n); ++i) {
    if (!done[i])
      continue;
    S *const own = parts_ + i * parts * nv, *const tau = numbers_ + i * nv;
    for (std::ptrdiff_t k = 0; k < nv; ++k) {
      // parts sum up to the efforts: the first is what the others, which are each joint's own, leave
      own[k] = tau[k];
      for (int p = 1; p < parts; ++p)
        own[k] -= own[p * nv + k];
    }
    std::copy_n(own, parts * nv, ksl::row(batch.result[0], first + static_cast<std::size_t>(i)));
  }
}

template <class S> void closed_by_plan<S>::run(const batch_view<S> &batch, std::size_t first, int n, bool *done) {
  const int nv = m_.nv();
  std::fill_n(still_, nv, S(0));
  if (forces_.ends() > 0)
    forces_.set(batch, first, n);
  batch_view<S> part = part_of(batch, first, n);
  // to memory of its own: the caller's result may lie where an argument is, which closed_state needs where the plan doesn't fit
  part.result[0] = {numbers_, nv};
  part.reactions_n = 0, part.reactions = reactions_;
  for (int r = 0; r < batch.reactions_n; ++r)
    if (const reaction_rows<S> &asked = batch.reactions[r]; asked.out.first)
      reactions_[part.reactions_n++] = {asked.request, rows_from(asked.out, first)};
  call(row_by_plan(row_.loops), part);
  for (int i = 0; i < n; ++i)
    done[i] = are_numbers(numbers_ + i * nv, nv);
  for (int r = 0; r < part.reactions_n; ++r)
    for (int i = 0; i < n; ++i)
      done[i] = done[i] && are_numbers(ksl::row(reactions_[r].out, static_cast<std::size_t>(i)),
                                       6 * std::ptrdiff_t(reactions_[r].request.n));
  if (row_.loops == loops_by::parts && batch.result[0].first)
    return set_parts(batch, part, first, done);
  for (int i = 0; i < n && row_.results > 0 && batch.result[0].first; ++i)
    if (done[i])
      std::copy_n(numbers_ + i * nv, nv, ksl::row(batch.result[0], first + static_cast<std::size_t>(i)));
}

template <class S> bool run_alone(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s) {
  const model_view<S> &view = m.view_in<S>();
  const bool forward = row.loops == loops_by::accelerations,
             inverse = row.loops == loops_by::efforts || row.loops == loops_by::reactions;
  if (!view.loops || m.nv() == 0 || m.acting_force_elements() > 0 ||
      !(forward ? view.loops->freedoms > 0 : inverse && determines_efforts(*view.loops)))
    return false;
  arena pieces(memory);
  state_view<S> alone = s; // the result goes to memory of its own: it may lie where an argument is
  alone.result[0] = pieces.take<S>(m.nv());
  reaction_result<S> *const reactions = pieces.take<reaction_result<S>>(s.reactions_n);
  alone.reactions_n = 0, alone.reactions = reactions;
  for (int r = 0; r < s.reactions_n; ++r)
    if (s.reactions[r].out)
      reactions[alone.reactions_n++] = s.reactions[r];
  mimic::mechanism_kernel<S>{row_by_plan(row.loops), m, view}.state(pieces.take<std::byte>(0), alone);
  bool fits = are_numbers(alone.result[0], m.nv());
  for (int r = 0; r < alone.reactions_n; ++r)
    fits = fits && are_numbers(reactions[r].out, 6 * std::ptrdiff_t(reactions[r].request->n));
  if (!fits)
    return false;
  if (row.results > 0 && s.result[0])
    std::copy_n(alone.result[0], m.nv(), s.result[0]);
  return true;
}

template bool plan_suits(loops_by, const model_view<double> &, bool);
template bool plan_suits(loops_by, const model_view<float> &, bool);
template class closed_by_plan<double>;
template class closed_by_plan<float>;
template bool run_alone(const algorithm_row &, const model &, void *, const state_view<double> &);
template bool run_alone(const algorithm_row &, const model &, void *, const state_view<float> &);

} // namespace ksl::loops
