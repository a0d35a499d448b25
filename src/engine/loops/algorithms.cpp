// How states go, each step taking what the one before left over:
//
//     one state     run_alone, the kernel on the caller's arrays → closed_by_plan with copies → runner: closed_state, with pivots of the state's own
//     a batch       closed_by_plan, `most` states at a time in lanes → runner, state by state
//     linear rows   linear_by_plan, in runner → wrenches_on_links, with pivots of the state's own
//
// What is left after the last step has no result: NaN, of which reason() makes a sentence by running it again.
#include "engine/loops/algorithms.hpp"

#include "engine/kernels/one_state.hpp"
#include "engine/loops/closed_by_plan.hpp"
#include "engine/loops/closed_state.hpp"
#include "engine/loops/findings.hpp"
#include "engine/loops/linear_by_plan.hpp"
#include "engine/loops/motion_by_plan.hpp"
#include "engine/loops/loop_reaction.hpp"
#include "engine/loops/wrenches_on_links.hpp"
#include "engine/mimic/mechanism_kernel.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace ksl::loops {
namespace {

/// Kernels for batches, over the model without weight and without physics of joints; and its motion by the plan.
class weightless_kernels {
public:
  explicit weightless_kernels(const model &m) : m_(m), view_(m.view()) {
    view_.gravity = {0, 0, 0};
    view_.physics = nullptr;
  }
  void measure(const algorithm_row &row, const batch_view<double> &part) {
    bytes_ = std::max(bytes_, kernel(row).batch_bytes(part));
  }
  void lay_out(arena &memory) {
    memory_ = memory.take<std::byte>(static_cast<std::ptrdiff_t>(bytes_));
    motion_.lay_out(memory, view_);
    q_ = memory.take<double>(view_.nq), G_ = memory.take<double>(std::ptrdiff_t(view_.nv) * view_.loops->freedoms);
  }
  void call(const algorithm_row &row, const batch_view<double> &part) const { kernel(row).batch(part, memory_); }
  /// G at q, its rows those of users' coordinates: the expanded mechanism has as many freedoms, since followers depend on their leaders.
  double set_G(const double *q, double *G) const {
    if (m_.followers() == 0)
      return motion_.set(view_, q, G);
    const coupling_view<double> &coupling = m_.coupling_in<double>();
    expand_position(coupling, q, q_);
    const double fault = motion_.set(view_, q_, G_);
    const int f = view_.loops->freedoms;
    for (int i = 0; i < coupling.nv; ++i)
      std::copy_n(G_ + std::ptrdiff_t(coupling.in_v[i]) * f, f, G + std::ptrdiff_t(i) * f);
    return fault;
  }
  /// The coordinate of users that is one of the expanded mechanism.
  int own(int coordinate) const {
    if (m_.followers() == 0)
      return coordinate;
    const coupling_view<double> &coupling = m_.coupling_in<double>();
    return static_cast<int>(std::find(coupling.in_v, coupling.in_v + coupling.nv, coordinate) - coupling.in_v);
  }

private:
  mimic::mechanism_kernel<double> kernel(const algorithm_row &row) const { return {row, m_, view_}; }

  const model &m_;
  model_view<double> view_;
  std::size_t bytes_ = 0;
  void *memory_ = nullptr;
  motion_by_plan<double> motion_;
  double *q_ = nullptr, *G_ = nullptr; ///< of the expanded mechanism
};

/// Computes one state in double precision; inputs are copied, so that results may lie where they were.
template <class S> class runner {
public:
  runner(const algorithm_row &row, const model &m, room wanted)
      : row_(row), m_(m), room_(wanted), c_(m, accepted_of<S>), by_plan_(row, m, weightless_kernels(m)) {}

  void lay_out(arena &memory) {
    const int nq = m_.nq(), nv = m_.nv();
    c_.lay_out(memory, row_.loops == loops_by::linear ? 1 : room_.externals);
    q_ = memory.take<double>(nq), v_ = memory.take<double>(nv), a_ = memory.take<double>(nv),
    tau_ = memory.take<double>(nv);
    result_ = memory.take<double>(5 * nv), wrenches_ = memory.take<double>(6 * room_.externals);
    requested_.lay_out(memory, m_, room_.joints);
    if (row_.loops == loops_by::linear)
      on_links_.lay_out(memory, m_, room_);
    if (is_linear_by_plan())
      by_plan_.lay_out(memory, room_);
  }

  /// copies → rows that are linear by the plan, if it fits → position → result; a finding leaves NaN in all results of the call, reactions included.
  finding run(const state_view<S> &s) {
    copy(s.q, m_.nq(), q_), copy(s.v, m_.nv(), v_), copy(s.a, m_.nv(), a_), copy(s.tau, m_.nv(), tau_);
    copy(s.external.wrench, 6 * s.external.n, wrenches_);
    const external_wrenches<double> e = {s.external.n, s.external.link, wrenches_, s.external.axes};
    is_finite_ = true;
    if (is_linear_by_plan() && set_linear_by_plan(s))
      return {};
    finding fault = c_.set_position(q_);
    if (!fault)
      fault = compute(e, s);
    if (fault)
      fill(s, std::numeric_limits<S>::quiet_NaN());
    return fault;
  }

  /// Are all results of the last state finite, if it has some?
  bool is_finite() const { return is_finite_; }

private:
  static void copy(const S *from, int n, double *to) {
    for (int i = 0; i < n; ++i)
      to[i] = from ? static_cast<double>(from[i]) : 0;
  }
  void store(const double *from, std::ptrdiff_t n, S *to) {
    for (std::ptrdiff_t i = 0; i < n && to; ++i) {
      to[i] = static_cast<S>(from[i]);
      is_finite_ = is_finite_ && std::isfinite(to[i]);
    }
  }
  void fill(const state_view<S> &s, S x) const {
    for (int r = 0; r < row_.results; ++r)
      if (s.result[r])
        std::fill_n(s.result[r], numbers_of(row_.result[r], extents_of(m_, s)), x);
    for (int r = 0; r < s.reactions_n; ++r)
      if (s.reactions[r].out)
        std::fill_n(s.reactions[r].out, 6 * s.reactions[r].request->n, x);
  }

  /// result_ has nv numbers: efforts of drives, accelerations, or a jump.  statics is inverse dynamics without v and a, steady that at accelerations
  /// that the loops alone demand, with idle bodies stopped.
  finding compute(const external_wrenches<double> &e, const state_view<S> &s) {
    const int nv = m_.nv();
    finding fault;
    switch (row_.loops) {
    case loops_by::efforts: fault = c_.inverse_dynamics(q_, v_, a_, e, result_); break;
    case loops_by::statics: fault = c_.inverse_dynamics(q_, nullptr, nullptr, e, result_); break;
    case loops_by::steady:
      if (fault = c_.steady_acceleration(q_, v_, a_); !fault) {
        c_.stop_idle_bodies(q_, v_, a_, true);
        fault = c_.inverse_dynamics(q_, v_, a_, e, result_);
      }
      break;
    case loops_by::accelerations: fault = c_.forward_dynamics(q_, v_, tau_, e, result_); break;
    case loops_by::jump: fault = c_.velocity_jump(q_, e, result_); break;
    case loops_by::parts: return set_parts(e, s);
    case loops_by::linear: return set_linear(s);
    case loops_by::reactions:
      if (fault = c_.inverse_dynamics(q_, v_, a_, e, result_); !fault)
        set_reactions(e, s);
      break;
    case loops_by::tree:
    case loops_by::plan:
    case loops_by::refusal: __builtin_unreachable();
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
      // (5, nv): transmitted, damping, friction, rotor, spring (effort_parts.hpp).  The last four are each joint's own, as in the tree
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

  /// Single states are closed to fewer digits than the plan takes.
  bool is_linear_by_plan() const {
    return row_.loops == loops_by::linear && sizeof(S) == sizeof(double) && linear_suits(row_, m_.view());
  }
  bool set_linear_by_plan(const state_view<S> &s) {
    state_view<double> of;
    of.q = q_, of.v = v_, of.a = a_, of.links = s.links, of.joints = s.joints;
    if (by_plan_.run(of, m_.view().gravity) * 0 != 0)
      return false;
    store(by_plan_.found(), numbers_of(row_.result[0], extents_of(m_, s)), s.result[0]);
    return true;
  }

  const algorithm_row &row_;
  const model &m_;
  const room room_;
  closed_state c_;
  double *q_ = nullptr, *v_ = nullptr, *a_ = nullptr, *tau_ = nullptr, *result_ = nullptr, *wrenches_ = nullptr;
  bool is_finite_ = true;
  requested_reactions requested_;
  wrenches_on_links on_links_;
  linear_by_plan<double, weightless_kernels> by_plan_;
};

} // namespace

void refuse(const algorithm_row &row, const model &m) {
  if (row.loops == loops_by::plan)
    throw std::invalid_argument(std::string(row.name) + " is private");
  if (m.loops().empty() || row.loops != loops_by::refusal)
    return;
  throw std::invalid_argument(
      std::string(row.name) +
      " is not available for mechanisms with loops, whose coordinates depend on each other; the tree that is left "
      "when loops are cut has it, which is another machine: loops=\"cut\", or without_loops");
}

namespace {

/// The states of a batch: some at a time by the plan, and one by one those that it doesn't fit.
template <class S> class states_of_batch {
public:
  states_of_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch)
      : row_(row), m_(m), batch_(batch), of_(extents_of(m, batch)),
        n_(static_cast<int>(std::min<std::size_t>(batch.n, closed_by_plan<S>::most))), fast_(row, m),
        one_(row, m, room_for(batch)) {}

  void lay_out(arena &memory) {
    fast_.lay_out(memory, batch_, n_);
    one_.lay_out(memory);
    state_.lay_out(memory, computed(row_), of_, batch_);
  }

  /// Returns whether all have results.
  /// The plan refuses states by NaN: of `n_` states in lanes those that aren't done are computed again one by one, from the batch, whose inputs are
  /// still there since lanes write results of their own first.
  bool run(std::size_t first, std::size_t end, bool by_plan) {
    const bool suits = by_plan && fast_.suits();
    bool found = true, done[closed_by_plan<S>::most] = {};
    for (std::size_t k = first; k < end; k += static_cast<std::size_t>(n_)) {
      const int n = static_cast<int>(std::min(end - k, static_cast<std::size_t>(n_)));
      if (suits)
        fast_.run(batch_, k, n, done);
      for (int i = 0; i < n; ++i)
        if (!done[i])
          found = !one_.run(state_.load(computed(row_), of_, batch_, k + static_cast<std::size_t>(i))) &&
                  one_.is_finite() && found;
    }
    return found;
  }

private:
  const algorithm_row &row_;
  const model &m_;
  const batch_view<S> &batch_;
  const extents of_;
  const int n_;
  closed_by_plan<S> fast_;
  runner<S> one_;
  copied_state<S> state_ = {};
};

/// What run_state lays out for a call of this room: the state as a batch of one, and what that batch needs.
template <class S> std::size_t counted_bytes(const algorithm_row &row, const model &m, const room &wanted) {
  batch_view<S> batch;
  reaction_request request;
  request.n = wanted.joints * std::max(wanted.requests, 1);
  const reaction_rows<S> rows = {request, {}};
  batch.n = 1, batch.external_n = wanted.externals, batch.reactions_n = 1, batch.reactions = &rows;
  batch.joints = &request, batch.links.n = wanted.links;
  arena measure;
  measure.take<external_rows<S>>(wanted.externals);
  measure.take<reaction_rows<S>>(wanted.requests); // of run_state, and twice those of closed_by_plan
  measure.take<reaction_rows<S>>(wanted.requests);
  measure.take<reaction_result<S>>(wanted.requests);
  return measure.used() + batch_bytes(row, m, batch);
}

/// For a wrench on each link and a request that names each joint once, of any algorithm but the linear ones.
template <class S> std::size_t most_bytes(const model &m) {
  std::size_t most = 0;
  for (const algorithm_row *row : {&rows::inverse_dynamics_with_reactions, &rows::effort_parts})
    most = std::max(most, counted_bytes<S>(*row, m, room_of_data(m)));
  return most;
}

/// Does memory for the one have room for the other?
bool fits(const room &wanted, const room &given) {
  return wanted.externals <= given.externals && wanted.joints <= given.joints && wanted.requests <= given.requests;
}

} // namespace

template <class S> std::size_t state_bytes(const algorithm_row &row, const model &m, const room &wanted) {
  if (row.loops == loops_by::linear || !fits(wanted, room_of_data(m))) // which need much
    return counted_bytes<S>(row, m, wanted);
  bytes_of_calls &bytes =
      *m.loop_tables().bytes; // copies of a model share them: they differ in masses and gravity alone
  std::atomic<std::size_t> &known = sizeof(S) == sizeof(double) ? bytes.in_double : bytes.in_single;
  if (known == 0) // threads that count at once find the same
    known = most_bytes<S>(m);
  return known;
}

template <class S> bool run_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s) {
  // Three ways, each where the one before has no result: the plan's kernel, on the state as it is; the plan, with copies and what force elements
  // and parts of efforts need around it; elimination with pivots of the state's own (closed_state), which alone can say why there is none.
  if (run_alone(row, m, memory, s))
    return true;
  arena pieces(memory);
  one_as_batch<S> alone;
  alone.lay_out(pieces, s.external.n, s.reactions_n);
  const batch_view<S> batch = alone.of(s);
  // by the plan at first, in memory that is not larger than that of a batch, and without the time that laying out all of that takes
  closed_by_plan<S> fast(row, m);
  if (bool done = false; fast.suits()) {
    arena part = pieces;
    fast.lay_out(part, batch, 1);
    fast.run(batch, 0, 1, &done);
    if (done)
      return true;
  }
  states_of_batch<S> states(row, m, batch);
  states.lay_out(pieces);
  return states.run(0, 1, false);
}

template <class S> std::size_t batch_bytes(const algorithm_row &row, const model &m, const batch_view<S> &batch) {
  arena measure;
  states_of_batch<S>(row, m, batch).lay_out(measure);
  return measure.used();
}

template <class S>
bool run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first, std::size_t end,
               void *memory) {
  arena pieces(memory);
  states_of_batch<S> states(row, m, batch);
  states.lay_out(pieces);
  return states.run(first, end, true);
}

template <class S> std::string reason(const algorithm_row &row, const model &m, const state_view<S> &given) {
  // results go to memory of their own: those of the caller stay as they are
  state_view<S> s = given;
  // numbers   [ result 0 | result 1 | … ], sized first, since s.result points into it
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
  template std::size_t state_bytes<S>(const algorithm_row &, const model &, const room &);                             \
  template bool run_state(const algorithm_row &, const model &, void *, const state_view<S> &);                        \
  template std::size_t batch_bytes(const algorithm_row &, const model &, const batch_view<S> &);                       \
  template bool run_batch(const algorithm_row &, const model &, const batch_view<S> &, std::size_t, std::size_t,       \
                          void *);                                                                                     \
  template std::string reason(const algorithm_row &, const model &, const state_view<S> &);
KSL_INSTANTIATE(double)
KSL_INSTANTIATE(float)
#undef KSL_INSTANTIATE

} // namespace ksl::loops
