// Matrices (nv, freedoms) have a column for each independent coordinate.  Results that list variations have one for each kind, coordinate and part:
//
//     motions (3, freedoms, 3, nv) = [ by q_i of the first coordinate: dq, dv, da | by q_i of the second | … | by v_i … | by a_i … ]
#include "engine/loops/derivatives.hpp"

#include "engine/mimic/mechanism_kernel.hpp"
#include "engine/loops/sparse_product.hpp"
#include "engine/states/ordinary_results.hpp"
#include "engine/states/thread_memory.hpp"
#include "text/rounding.hpp"

#include <algorithm>

namespace ksl::loops {

void closed_derivatives::lay_out(arena &memory, int externals) {
  const int nv = m_.nv();
  c_.lay_out(memory, externals);
  by_.lay_out(memory);
  for (double **matrix : {&by_q_, &by_v_, &M_, &v_by_q_, &a_by_q_, &a_by_v_, &efforts_, &projected_, &solved_})
    *matrix = memory.take<double>(nv * nv);
  rates_ = memory.take<double>(t_.rows * nv), column_ = memory.take<double>(nv);
  a_ = memory.take<double>(nv), tau_ = memory.take<double>(nv);
}

/// The derivatives of the tree's efforts, and of the loops' equations and wrenches, with the multipliers that have been found; then how
/// coordinates follow.
void closed_derivatives::set_tree(const double *q, const double *v, const double *a,
                                  const external_wrenches<double> &e) {
  state_view<double> s;
  s.q = q, s.v = v, s.a = a, s.external = e;
  s.result[0] = by_q_, s.result[1] = by_v_, s.result[2] = M_;
  c_.at().tree().call(rows::inverse_dynamics_derivatives, c_.at().rest(), s);
  by_.set(c_.at(), v, a, c_.multipliers());
  for (int i = 0; i < m_.nv() * m_.nv(); ++i)
    by_q_[i] -= by_.wrench_by_q()[i];
  set_motions();
}

/// out (nv, freedoms): K out = − by_q G − by_v v, zero at independent coordinates.  v may be null.
void closed_derivatives::follow(const double *by_q, const double *by_v, const double *v, double *out) {
  const int nv = m_.nv(), f = c_.solved().freedoms();
  std::fill_n(rates_, t_.rows * f, 0.0);
  add_product(-1, by_q, t_.rows, nv, c_.G(), f, rates_);
  if (v)
    add_product(-1, by_v, t_.rows, nv, v, f, rates_);
  c_.solved().solve_dependent(rates_, f, out);
}

void closed_derivatives::set_motions() {
  // K v = 0 and K a + K̇ v = 0 along the mechanism, at dq = G dq_i and dv = G dv_i:
  //     K dv/dq_i = −∂(K v)/∂q G
  //     K da/dq_i = −∂(K a + K̇ v)/∂q G − ∂(K̇ v)/∂v dv/dq_i
  //     K da/dv_i = −∂(K̇ v)/∂v G
  follow(by_.velocity_by_q(), nullptr, nullptr, v_by_q_);
  follow(by_.acceleration_by_q(), by_.acceleration_by_v(), v_by_q_, a_by_q_);
  follow(by_.acceleration_by_v(), nullptr, nullptr, a_by_v_);
}

/// One row of the table in the header.
closed_derivatives::varied closed_derivatives::motion(int kind) const {
  // columns by q_i, v_i and a_i; da/da_i = G, since K da = 0
  const varied all[kinds] = {{c_.G(), v_by_q_, a_by_q_}, {nullptr, c_.G(), a_by_v_}, {nullptr, nullptr, c_.G()}};
  return all[kind];
}

/// efforts_: what the variation of a motion does to the tree's efforts, less the wrenches of the loops.
void closed_derivatives::set_efforts(const varied &by) {
  const int nv = m_.nv(), f = c_.solved().freedoms();
  std::fill_n(efforts_, nv * f, 0.0);
  if (by.q)
    add_product(1, by_q_, nv, nv, by.q, f, efforts_);
  if (by.v)
    add_product(1, by_v_, nv, nv, by.v, f, efforts_);
  add_product(1, M_, nv, nv, by.a, f, efforts_);
}

/// projected_ (freedoms, freedoms) = Gᵀ efforts_.
void closed_derivatives::project() {
  const int nv = m_.nv(), f = c_.solved().freedoms();
  std::fill_n(projected_, f * f, 0.0);
  add_transposed_product(c_.G(), nv, f, efforts_, f, projected_);
}

/// dq, dv and da (nv) with independent coordinate j.  Returns the end.
double *closed_derivatives::copy_motion(const varied &by, int j, double *to) const {
  const int nv = m_.nv(), f = c_.solved().freedoms();
  for (const double *matrix : {by.q, by.v, by.a})
    for (int i = 0; i < nv; ++i)
      *to++ = matrix ? matrix[i * f + j] : 0;
  return to;
}

void closed_derivatives::motions(const double *v, const double *a, double *motions) {
  std::fill_n(rates_, t_.rows, 0.0); // of wrenches, which nobody asks for
  by_.set(c_.at(), v, a, rates_);
  set_motions();
  for (int kind = 0; kind < kinds; ++kind)
    for (int j = 0; j < c_.solved().freedoms(); ++j)
      motions = copy_motion(motion(kind), j, motions);
}

/// dτ_d = Gᵀ dE, dE the variation of the tree's efforts less Kᵀ λ, since Gᵀ E = 1: the drives are the independent coordinates.
finding closed_derivatives::inverse_dynamics(const double *q, const double *v, const double *a,
                                             const external_wrenches<double> &e, double *by_q, double *by_v,
                                             double *by_a) {
  if (const finding fault = c_.inverse_dynamics(q, v, a, e, tau_))
    return fault;
  const int f = c_.solved().freedoms(), nv = m_.nv();
  if (!t_.idle.empty())
    return {finding::kind::no_column, t_.idle[0].coordinate, 0, 0, f};
  if (static_cast<int>(t_.drives.size()) != f)
    return {finding::kind::more_drives, -1, 0, 0, f};
  set_tree(q, v, a, e);
  double *const out[kinds] = {by_q, by_v, by_a};
  for (int kind = 0; kind < kinds; ++kind) {
    std::fill_n(out[kind], nv * f, 0.0);
    set_efforts(motion(kind));
    project();
    for (int i = 0; i < f; ++i) // the drives are the independent coordinates
      std::copy_n(projected_ + i * f, f, out[kind] + c_.solved().independent()[i] * f);
  }
  return {};
}

finding closed_derivatives::reaction_variations(const double *q, const double *v, const double *a,
                                                const external_wrenches<double> &e, double *motions, double *on_links,
                                                double *at_joints) {
  if (const finding fault = c_.inverse_dynamics(q, v, a, e, tau_))
    return fault;
  const int f = c_.solved().freedoms(), nv = m_.nv(), loops = static_cast<int>(t_.loops.size());
  if (!t_.idle.empty())
    return {finding::kind::no_column, t_.idle[0].coordinate, 0, 0, f};
  if (static_cast<int>(t_.drives.size()) != f)
    return {finding::kind::more_drives, -1, 0, 0, f};
  set_tree(q, v, a, e);
  for (int kind = 0; kind < kinds; ++kind) {
    // The variation of (1): Kᵀ dλ = dE − E dτ_d with dE what set_efforts has.  Dependent coordinates have no drive, so that dE alone determines dλ.
    set_efforts(motion(kind)); // Kᵀ dλ at coordinates without a drive
    for (int j = 0; j < f; ++j) {
      for (int i = 0; i < nv; ++i)
        column_[i] = efforts_[i * f + j];
      c_.solved().multipliers(column_, rates_);
      double *const end = copy_motion(motion(kind), j, motions);
      c_.at().wrench_variations(c_.multipliers(), rates_, motions, on_links, at_joints);
      motions = end, on_links += 12 * loops, at_joints += 6 * loops;
    }
  }
  return {};
}

finding closed_derivatives::forward_dynamics(const double *q, const double *v, const double *tau,
                                             const external_wrenches<double> &e, double *by_q, double *by_v,
                                             double *by_tau) {
  if (const finding fault = c_.forward_dynamics(q, v, tau, e, a_))
    return fault;
  if (c_.has_massless_idle())
    return {finding::kind::massless, t_.idle[0].coordinate, 0, 0, c_.solved().freedoms()};
  c_.set_multipliers(q, v, a_, tau, e);
  set_tree(q, v, a_, e);
  const int f = c_.solved().freedoms(), nv = m_.nv();
  std::copy_n(c_.G(), nv * f, solved_); // G (Gᵀ M G)⁻¹, with the factors that forward dynamics has left
  for (int i = 0; i < nv; ++i)
    c_.solve_again(solved_ + i * f);
  // a_i are those at which Gᵀ (b + M a − Kᵀ λ) = Gᵀ τ.  With db what a variation does to these efforts where the a_i stay,
  //     Gᵀ M G da_i = −Gᵀ db,   da = (da where a_i stay) + G da_i;   by τ: da = G (Gᵀ M G)⁻¹ Gᵀ.
  double *const out[] = {by_q, by_v};
  for (int kind = 0; kind < 2; ++kind) {
    set_efforts(motion(kind));
    project();
    for (int i = 0; i < nv * f; ++i)
      out[kind][i] = motion(kind).a[i];
    add_product(-1, solved_, nv, f, projected_, f, out[kind]);
  }
  double *const transposed = efforts_; // Gᵀ
  for (int i = 0; i < nv; ++i)
    for (int j = 0; j < f; ++j)
      transposed[j * nv + i] = c_.G(i, j);
  std::fill_n(by_tau, nv * nv, 0.0);
  add_product(1, solved_, nv, f, transposed, nv, by_tau);
  return {};
}

namespace {

const algorithm_row &row_by_plan(bool forward) {
  return forward ? rows::closed_forward_dynamics_derivatives : rows::closed_inverse_dynamics_derivatives;
}

bool has_plan(const model &m) {
  const loop_view<double> *const loops = m.view().loops;
  return loops && loops->drives_are_independent && loops->freedoms > 0 && m.acting_force_elements() == 0;
}

} // namespace

bool derive_by_plan(bool forward, const model &m, data *d, state_view<double> s, double *by_q, double *by_v,
                    double *by_x) {
  if (!has_plan(m))
    return false;
  const model_view<double> &view = m.view();
  const std::ptrdiff_t nv = m.nv(), narrow = nv * view.loops->freedoms,
                       numbers[] = {narrow, narrow, forward ? nv * nv : narrow};
  double *const out[] = {by_q, by_v, by_x};
  const mimic::mechanism_kernel<double> kernel = {row_by_plan(forward), m, view};
  //     memory   [ by_q (nv, f) | by_v (nv, f) | by_x (nv, f), or by τ (nv, nv) | workspace of the kernel ]
  //
  // Results go to the front first: the caller's arrays stay as they are where a pivot is too small, and NaN comes out.
  arena measure;
  for (const std::ptrdiff_t n : numbers)
    measure.take<double>(n);
  const std::size_t needed = measure.used() + kernel.state_bytes();
  arena memory(d && needed <= d->bytes() ? d->memory() : thread_memory(kept_for::workspace, needed));
  for (int r = 0; r < 3; ++r)
    s.result[r] = memory.take<double>(numbers[r]);
  // the kernel's workspace is what is left behind the pieces; take(0) is where it begins
  if (!kernel.state(memory.take<std::byte>(0), s) && !ordinary_results(row_by_plan(forward), m, s))
    return false;
  for (int r = 0; r < 3; ++r)
    std::copy_n(s.result[r], numbers[r], out[r]);
  return true;
}

int freedoms_by_plan(const model &m) { return has_plan(m) ? m.view().loops->freedoms : 0; }

/// A batch of states by the plan's kernel, all in one call; what has NaN is told by `done`, and left to single calls.
void derive_in_lanes(bool forward, const model &m, const batch_view<double> &batch, unsigned char *done) {
  const nearest_rounding rounding;
  const model_view<double> &view = m.view();
  const mimic::mechanism_kernel<double> kernel = {row_by_plan(forward), m, view};
  kernel.batch(batch, thread_memory(kept_for::workspace, kernel.batch_bytes(batch)));
  for (std::size_t k = 0; k < batch.n; ++k) // as of one state
    done[k] = ordinary_results(row_by_plan(forward), m, batch, k, k + 1);
}

} // namespace ksl::loops
