#include "engine/loops/closed.hpp"

#include "engine/loops/closed_state.hpp"
#include "engine/loops/findings.hpp"
#include "engine/loops/loop_reaction.hpp"
#include "engine/loops/planned.hpp"
#include "engine/loops/wrenches_on_links.hpp"
#include "engine/one_state.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace ksl::loops {
namespace {

/// Computes one state in double precision; inputs are copied, so that results may lie where they were.
template <class S> class runner {
public:
  runner(const algorithm_row &row, const model &m, room wanted)
      : row_(row), m_(m), room_(wanted), c_(m, sizeof(S) == 8 ? tolerance_of_double : tolerance_of_float) {}

  void lay_out(arena &memory) {
    const int nq = m_.nq(), nv = m_.nv();
    c_.lay_out(memory, row_.closed == closed_by::linear ? 1 : room_.externals);
    q_ = memory.take<double>(nq), v_ = memory.take<double>(nv), a_ = memory.take<double>(nv),
    tau_ = memory.take<double>(nv);
    result_ = memory.take<double>(5 * nv), wrenches_ = memory.take<double>(6 * room_.externals);
    requested_.lay_out(memory, m_, room_.joints);
    if (row_.closed == closed_by::linear)
      on_links_.lay_out(memory, m_, room_);
  }

  /// Are all results numbers?  Else they overflowed, which no finding says.
  bool are_finite(const state_view<S> &s) const {
    bool finite = true;
    const auto look = [&](const S *x, std::ptrdiff_t n) {
      for (std::ptrdiff_t i = 0; x && i < n; ++i)
        finite &= std::isfinite(x[i]);
    };
    for (int r = 0; r < row_.results; ++r)
      look(s.result[r], numbers_of(row_.result[r], extents_of(m_, s)));
    for (int r = 0; r < s.reactions_n; ++r)
      look(s.reactions[r].out, 6 * std::ptrdiff_t(s.reactions[r].request->n));
    return finite;
  }

  finding run(const state_view<S> &s) {
    copy(s.q, m_.nq(), q_), copy(s.v, m_.nv(), v_), copy(s.a, m_.nv(), a_), copy(s.tau, m_.nv(), tau_);
    copy(s.external.wrench, 6 * s.external.n, wrenches_);
    const external_wrenches<double> e = {s.external.n, s.external.link, wrenches_, s.external.axes};
    finding fault = c_.set_position(q_);
    if (!fault)
      fault = compute(e, s);
    if (fault)
      fill(s, std::numeric_limits<S>::quiet_NaN());
    return fault;
  }

private:
  static void copy(const S *from, int n, double *to) {
    for (int i = 0; i < n; ++i)
      to[i] = from ? static_cast<double>(from[i]) : 0;
  }
  static void store(const double *from, std::ptrdiff_t n, S *to) {
    for (std::ptrdiff_t i = 0; i < n && to; ++i)
      to[i] = static_cast<S>(from[i]);
  }
  void fill(const state_view<S> &s, S x) const {
    for (int r = 0; r < row_.results; ++r)
      if (s.result[r])
        std::fill_n(s.result[r], numbers_of(row_.result[r], extents_of(m_, s)), x);
    for (int r = 0; r < s.reactions_n; ++r)
      if (s.reactions[r].out)
        std::fill_n(s.reactions[r].out, 6 * s.reactions[r].request->n, x);
  }

  finding compute(const external_wrenches<double> &e, const state_view<S> &s) {
    const int nv = m_.nv();
    finding fault;
    switch (row_.closed) {
    case closed_by::efforts: fault = c_.inverse_dynamics(q_, v_, a_, e, result_); break;
    case closed_by::statics: fault = c_.inverse_dynamics(q_, nullptr, nullptr, e, result_); break;
    case closed_by::steady:
      if (fault = c_.steady_acceleration(q_, v_, a_); !fault)
        fault = c_.inverse_dynamics(q_, v_, a_, e, result_);
      break;
    case closed_by::accelerations: fault = c_.forward_dynamics(q_, v_, tau_, e, result_); break;
    case closed_by::jump: fault = c_.velocity_jump(q_, e, result_); break;
    case closed_by::parts: return set_parts(e, s);
    case closed_by::linear: return set_linear(s);
    case closed_by::reactions:
      if (fault = c_.inverse_dynamics(q_, v_, a_, e, result_); !fault)
        set_reactions(e, s);
      break;
    case closed_by::tree:
    case closed_by::plan:
    case closed_by::refusal: __builtin_unreachable();
    }
    if (!fault && row_.results > 0)
      store(result_, nv, s.result[0]);
    return fault;
  }

  /// The parts of the efforts at the joints.  What loops change is transmitted; joints without a motor need what damping, friction, rotors
  /// and springs take from the mechanism.
  finding set_parts(const external_wrenches<double> &e, const state_view<S> &s) {
    const int nv = m_.nv();
    if (const finding fault = c_.inverse_dynamics(q_, v_, a_, e, tau_))
      return fault;
    state_view<double> view;
    view.q = q_, view.v = v_, view.a = a_, view.external = e, view.result[0] = result_;
    c_.at().tree().call(rows::effort_parts, c_.at().rest(), view);
    for (int i = 0; i < nv; ++i) {
      result_[i] = tau_[i];
      for (int part = 1; part < 5; ++part)
        result_[i] -= result_[part * nv + i];
    }
    store(result_, 5 * std::ptrdiff_t(nv), s.result[0]);
    return {};
  }

  void set_reactions(const external_wrenches<double> &e, const state_view<S> &s) {
    c_.set_reactions(q_, v_, a_, e);
    const external_wrenches<double> all = c_.all_wrenches(e);
    for (int r = 0; r < s.reactions_n; ++r)
      if (const reaction_request &wanted = *s.reactions[r].request; s.reactions[r].out)
        store(requested_.find(c_, q_, v_, a_, all, wanted), 6 * std::ptrdiff_t(wanted.n), s.reactions[r].out);
  }

  /// What wrenches on links need, or what inertial parameters do.
  finding set_linear(const state_view<S> &s) {
    if (row_.reads(input::v)) // is it a motion of the mechanism
      if (const finding fault = c_.inverse_dynamics(q_, v_, a_, {}, result_))
        return fault;
    const extents of = extents_of(m_, s);
    const result_row &result = row_.result[0];
    const bool by_parameters = result.shape[result.axes - 1] == extent::ten;
    const double *found = nullptr;
    if (const finding fault = on_links_.find(c_, q_, s.links, s.joints, &found))
      return fault;
    store(by_parameters ? on_links_.by_parameters(c_, q_, v_, a_) : found, numbers_of(result, of), s.result[0]);
    return {};
  }

  const algorithm_row &row_;
  const model &m_;
  const room room_;
  closed_state c_;
  double *q_ = nullptr, *v_ = nullptr, *a_ = nullptr, *tau_ = nullptr, *result_ = nullptr, *wrenches_ = nullptr;
  requested_reactions requested_;
  wrenches_on_links on_links_;
};

} // namespace

void require_closed(const algorithm_row &row, const model &m) {
  if (row.closed == closed_by::plan)
    throw std::invalid_argument(std::string(row.name) + " is private");
  if (m.loops().empty() || row.closed != closed_by::refusal)
    return;
  throw std::invalid_argument(
      std::string(row.name) +
      " is not available for mechanisms with loops, whose coordinates depend on each other; the tree that is left "
      "when loops are cut has it, which is another machine: loops=\"cut\", or without_loops");
}

template <class S> room room_for(const state_view<S> &s) {
  room wanted = {s.external.n, s.joints ? s.joints->n : 0, s.reactions_n, s.links.n};
  for (int r = 0; r < s.reactions_n; ++r)
    wanted.joints = std::max(wanted.joints, s.reactions[r].request->n);
  return wanted;
}

template <class S> room room_for(const batch_view<S> &batch) {
  room wanted = {batch.external_n, batch.joints ? batch.joints->n : 0, batch.reactions_n, batch.links.n};
  for (int r = 0; r < batch.reactions_n; ++r)
    wanted.joints = std::max(wanted.joints, batch.reactions[r].request.n);
  return wanted;
}

namespace {

template <class S> std::size_t counted_bytes(const algorithm_row &row, const model &m, room wanted) {
  batch_view<S> batch;
  reaction_request request;
  request.n = wanted.joints * std::max(wanted.requests, 1);
  const reaction_rows<S> rows = {request, {}};
  batch.n = 1, batch.external_n = wanted.externals, batch.reactions_n = 1, batch.reactions = &rows;
  batch.joints = &request, batch.links.n = wanted.links;
  arena measure;
  measure.take<external_rows<S>>(wanted.externals);
  measure.take<reaction_rows<S>>(wanted.requests); // of run_state, and twice those of planned
  measure.take<reaction_rows<S>>(wanted.requests);
  measure.take<reaction_result<S>>(wanted.requests);
  return measure.used() + loops::run_batch<S>(row, m, batch, 0, 0, nullptr).bytes;
}

/// For a wrench on each link and a request that names each joint once, of any algorithm but the linear ones.
template <class S> std::size_t most_bytes(const model &m) {
  std::size_t most = 0;
  for (const algorithm_row *row : {&rows::inverse_dynamics_with_reactions, &rows::effort_parts})
    most = std::max(most, counted_bytes<S>(*row, m, room_of_data(m)));
  return most;
}

} // namespace

template <class S> std::size_t state_bytes(const algorithm_row &row, const model &m, room wanted) {
  if (row.closed == closed_by::linear || !fits(wanted, room_of_data(m))) // which need much
    return counted_bytes<S>(row, m, wanted);
  bytes_of_calls &bytes =
      *m.loop_tables().bytes; // copies of a model share them: they differ in masses and gravity alone
  std::atomic<std::size_t> &known = sizeof(S) == sizeof(double) ? bytes.in_double : bytes.in_single;
  if (known == 0) // threads that count at once find the same
    known = most_bytes<S>(m);
  return known;
}

template <class S> bool run_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s) {
  if (run_alone(row, m, memory, s))
    return true;
  arena pieces(memory);
  one_as_batch<S> alone;
  alone.lay_out(pieces, s.external.n, s.reactions_n);
  const batch_view<S> batch = alone.of(s);
  // by the plan at first, in memory that is not larger than that of run_batch, and without the time that laying out all of that takes
  planned<S> fast(row, m);
  if (bool done = false; fast.suits()) {
    arena part = pieces;
    fast.lay_out(part, batch, 1);
    fast.run(batch, 0, 1, &done);
    if (done)
      return true;
  }
  return loops::run_batch(row, m, batch, 0, 1, pieces.take<std::byte>(0), false).ordinary;
}

template <class S>
batch_outcome run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first,
                        std::size_t end, void *memory, bool by_plan) {
  const int states = static_cast<int>(std::min<std::size_t>(batch.n, planned<S>::most));
  planned<S> fast(row, m);
  runner<S> one(row, m, room_for(batch));
  one_state_memory<S> state;
  arena pieces(memory);
  fast.lay_out(pieces, batch, states);
  one.lay_out(pieces);
  state.lay_out(pieces, row, m, batch, 0);
  const bool suits = memory && by_plan && fast.suits();
  bool ordinary = true, done[planned<S>::most] = {};
  for (std::size_t k = first; memory && k < end; k += static_cast<std::size_t>(states)) {
    const int n = static_cast<int>(std::min(end - k, static_cast<std::size_t>(states)));
    if (suits)
      fast.run(batch, k, n, done);
    for (int i = 0; i < n; ++i)
      if (!done[i]) {
        const state_view<S> &s = state.load(row, m, batch, k + static_cast<std::size_t>(i));
        ordinary = !one.run(s) && one.are_finite(s) && ordinary;
      }
  }
  return {pieces.used(), ordinary};
}

template <class S> std::string reason(const algorithm_row &row, const model &m, const state_view<S> &given) {
  // results go to memory of their own: those of the caller stay as they are
  state_view<S> s = given;
  std::vector<S> numbers;
  for (int r = 0; r < row.results; ++r)
    numbers.resize(numbers.size() + static_cast<std::size_t>(numbers_of(row.result[r], extents_of(m, s))));
  s.reactions_n = 0;
  std::size_t used = 0;
  for (int r = 0; r < row.results; ++r) {
    s.result[r] = numbers.data() + used;
    used += static_cast<std::size_t>(numbers_of(row.result[r], extents_of(m, s)));
  }
  runner<S> one(row, m, room_for(s));
  arena measure;
  one.lay_out(measure);
  std::vector<std::byte> memory(measure.used() + 64);
  void *begin = memory.data();
  std::size_t space = memory.size();
  arena pieces(std::align(64, measure.used(), begin, space));
  one.lay_out(pieces);
  return text_of(one.run(s), m);
}

#define KSL_INSTANTIATE(S)                                                                                             \
  template room room_for(const state_view<S> &);                                                                       \
  template room room_for(const batch_view<S> &);                                                                       \
  template std::size_t state_bytes<S>(const algorithm_row &, const model &, room);                                     \
  template bool run_state(const algorithm_row &, const model &, void *, const state_view<S> &);                        \
  template batch_outcome run_batch(const algorithm_row &, const model &, const batch_view<S> &, std::size_t,           \
                                   std::size_t, void *, bool);                                                         \
  template std::string reason(const algorithm_row &, const model &, const state_view<S> &);
KSL_INSTANTIATE(double)
KSL_INSTANTIATE(float)
#undef KSL_INSTANTIATE

} // namespace ksl::loops
