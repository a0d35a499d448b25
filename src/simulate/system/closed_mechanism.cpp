// Four objects, each in memory of its own, since each keeps what the last call has left:
//
//     planned_       accelerations in lanes by the model's plan, which takes open states, too: its tolerance is any_opening
//     state_         one state with pivots of its own: accelerations, responses to efforts by the same factors, G, Gᵀ M G
//     assembly_      the way back onto the loops, and motions that keep them closed
//     derivatives_   made when they are asked for, by sdirk4 alone
#include "simulate/system/closed_mechanism.hpp"

#include "engine/loops/tables.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

namespace ksl::simulating {
namespace {

/// States between steps are taken as they are, however far loops are open: relative to the mechanism's length.
constexpr double any_opening = 1e12;

/// Lays a workspace out in memory of its own.
template <class Lay> void lay_out(std::vector<std::byte> &memory, Lay lay) {
  arena measure;
  lay(measure);
  memory.resize(measure.used() + 64);
  void *begin = memory.data();
  std::size_t space = memory.size();
  arena pieces(std::align(64, measure.used(), begin, space));
  lay(pieces);
}

} // namespace

closed_mechanism::closed_mechanism(const model &m, int externals, std::size_t most)
    : m_(m), externals_(externals), moved_(static_cast<std::size_t>(m.nq() + 2 * m.nv())),
      rows_(static_cast<std::size_t>(m.loop_tables().rows)), terms_(rows_.size()),
      reduced_(static_cast<std::size_t>(m.nv())), free_(static_cast<std::size_t>(m.nv()), 0) {
  state_.emplace(m, any_opening);
  assembly_.emplace(m);
  lay_out(of_state_, [&](arena &memory) { state_->lay_out(memory, externals); });
  lay_out(of_assembly_, [&](arena &memory) { assembly_->lay_out(memory); });
  const loop_view<double> *const plan = m.view().loops;
  if (!plan)
    return;
  // the model's plan, but for states that are open
  plan_ = *plan;
  plan_->tolerance = any_opening;
  batch_view<double> batch;
  batch.external_n = externals;
  if (planned_.emplace(rows::forward_dynamics, m, &*plan_).suits()) {
    const int states = static_cast<int>(std::min<std::size_t>(most, most_by_plan));
    lay_out(of_planned_, [&](arena &memory) { planned_->lay_out(memory, batch, states); });
  } else {
    planned_.reset();
  }
}

void closed_mechanism::accelerate_by_plan(const batch_view<double> &batch, std::size_t first, int n, bool *done) {
  std::fill_n(done, n, false);
  if (planned_)
    planned_->run(batch, first, n, done);
}

bool closed_mechanism::accelerate(const double *q, const double *v, const double *tau,
                                  const external_wrenches<double> &e, double *a) {
  return !state_->set_position(q) && !state_->forward_dynamics(q, v, tau, e, a);
}

bool closed_mechanism::derivatives(const double *q, const double *v, const double *tau,
                                   const external_wrenches<double> &e, double *by_q, double *by_v, double *by_tau) {
  if (!derivatives_) {
    derivatives_.emplace(m_, any_opening);
    lay_out(of_derivatives_, [&](arena &memory) { derivatives_->lay_out(memory, externals_); });
  }
  if (derivatives_->state().set_position(q) || derivatives_->forward_dynamics(q, v, tau, e, by_q, by_v, by_tau))
    return false;
  const loops::elimination &solved = derivatives_->state().solved();
  const int nv = m_.nv(), f = solved.freedoms();
  //     nv = 3, independent coordinates 0 and 2:     [ a b │ c d │ e f │ · · · ]   →   [ a 0 b │ c 0 d │ e 0 f ]
  for (double *matrix : {by_q, by_v})
    for (int i = nv; i-- > 0;) { // rows of f numbers become rows of nv, from the last on
      std::copy_n(matrix + i * f, f, reduced_.data());
      std::fill_n(matrix + i * nv, nv, 0.0);
      for (int j = 0; j < f; ++j)
        matrix[i * nv + solved.independent()[j]] = reduced_[static_cast<std::size_t>(j)];
    }
  return true;
}

void closed_mechanism::response(int coordinate, double *a) {
  // G (Gᵀ M G)⁻¹ Gᵀ e_k, by the factors that the last acceleration has left
  const int freedoms = state_->solved().freedoms();
  for (int j = 0; j < freedoms; ++j)
    reduced_[static_cast<std::size_t>(j)] = state_->G(coordinate, j);
  state_->solve_again(reduced_.data());
  for (int i = 0; i < m_.nv(); ++i) {
    a[i] = 0;
    for (int j = 0; j < freedoms; ++j)
      a[i] += state_->G(i, j) * reduced_[static_cast<std::size_t>(j)];
  }
}

bool closed_mechanism::efforts(const double *q, const double *v, const double *a, const external_wrenches<double> &e,
                               double *tau) {
  return !state_->set_position(q) && !state_->inverse_dynamics(q, v, a, e, tau);
}

void closed_mechanism::complete_acceleration(const double *q, const double *v, double *a) {
  std::copy_n(a, m_.nv(), moved_.data());
  assembly_->complete_acceleration(q, v, moved_.data(), m_.loop_tables().is_driven.data(), a);
}

int closed_mechanism::set_tangent(const double *q, double *G) {
  state_->set_open_position(q);
  const int f = state_->solved().freedoms();
  std::copy_n(state_->G(), m_.nv() * f, G);
  return f;
}

void closed_mechanism::way_back(double *x) {
  // K x = −e, with independent coordinates that stay
  state_->at().error(rows_.data());
  for (double &row : rows_)
    row = -row;
  std::fill_n(x, m_.nv(), 0.0);
  state_->solved().complete(rows_.data(), x);
}

double closed_mechanism::error(const double *q) {
  assembly_->at().set_position(q);
  assembly_->at().error(rows_.data());
  double most = 0;
  for (std::size_t i = 0; i < rows_.size(); ++i)
    most = std::fmax(most, std::fabs(rows_[i]) * m_.loop_tables().row_scale[i]);
  return most;
}

double closed_mechanism::regularity(const double *q) {
  state_->set_open_position(q);
  // a rank below that of earlier positions: an equation has lost its pivot already
  if (state_->solved().rank < rank_)
    return 0;
  rank_ = state_->solved().rank;
  return state_->solved().last_pivot();
}

/// First the position, then the velocities there.  Both are left alone where they are closed to rounding, so that no rounding
/// is added.
bool closed_mechanism::project(double *q, double *v, double &opened, const unsigned char *held) {
  opened = error(q);
  if (!(opened <= loops::closed_within(m_.loop_tables(), q, m_.nq()))) {
    double left = 0;
    // with held coordinates where they are; where no closed position is found so, all may move
    const bool is_closed = held && assembly_->close(q, held, nearby, moved_.data(), &left) == closing::closed;
    if (!is_closed && assembly_->close(q, free_.data(), nearby, moved_.data(), &left) != closing::closed)
      return false;
    std::copy_n(moved_.data(), m_.nq(), q);
    assembly_->at().set_position(q);
  }
  if (!keeps_closed(v)) {
    if (!held || assembly_->nearest_velocity(v, held, moved_.data()) == completion::contradictory)
      assembly_->nearest_velocity(v, free_.data(), moved_.data());
    std::copy_n(moved_.data(), m_.nv(), v);
  }
  return true;
}

/// At the position that was set last.
/// Relative to the terms of K v: where large ones cancel, their rounding stays.
bool closed_mechanism::keeps_closed(const double *v) {
  assembly_->at().velocity(v, rows_.data(), terms_.data());
  for (std::size_t i = 0; i < rows_.size(); ++i)
    if (!(std::fabs(rows_[i]) <= loop_tolerance::rates_between_steps * terms_[i]))
      return false;
  return true;
}

} // namespace ksl::simulating
