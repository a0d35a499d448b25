#include "engine/loops/derivatives.hpp"

#include "ksl/linalg.h"

#include <algorithm>

namespace ksl::loops {

void closed_derivatives::lay_out(arena &memory, int externals) {
  const int nv = m_.nv();
  c_.lay_out(memory, externals);
  by_.lay_out(memory);
  by_q_ = memory.take<double>(nv * nv), by_v_ = memory.take<double>(nv * nv), M_ = memory.take<double>(nv * nv);
  dq_ = memory.take<double>(nv), dv_ = memory.take<double>(nv), da_ = memory.take<double>(nv), left_ = memory.take<double>(nv);
  rates_ = memory.take<double>(t_.rows), a_ = memory.take<double>(nv), tau_ = memory.take<double>(nv);
  H_ = memory.take<double>(nv * nv), r_ = memory.take<double>(nv);
}

/// out += sign · matrix x, of so many rows.
void closed_derivatives::add_product(const double *matrix, int rows, const double *x, double sign, double *out) const {
  const int nv = m_.nv();
  for (int i = 0; i < rows; ++i) {
    double sum = 0;
    for (int j = 0; j < nv; ++j)
      sum += matrix[i * nv + j] * x[j];
    out[i] += sign * sum;
  }
}

/// The derivatives of the tree's efforts, and of the loops' equations and wrenches, with the multipliers that have been found.
void closed_derivatives::set_tree(const double *q, const double *v, const double *a, const external_wrenches<double> &e) {
  state_view<double> s;
  s.q = q, s.v = v, s.a = a, s.external = e;
  s.result[0] = by_q_, s.result[1] = by_v_, s.result[2] = M_;
  c_.at().tree().call(rows::inverse_dynamics_derivatives, c_.at().rest(), s);
  by_.set(c_.at(), v, a, c_.multipliers());
  for (int i = 0; i < m_.nv() * m_.nv(); ++i)
    by_q_[i] -= by_.wrench_by_q()[i];
}

/// The variation of q, v and a with number j of the independent coordinates of q, of v or of a; left_ is what it does to the tree's efforts,
/// less the wrenches of the loops.
void closed_derivatives::vary(varied what, int j) {
  const int nv = m_.nv();
  for (double *x : {dq_, dv_, da_, left_})
    std::fill_n(x, nv, 0.0);
  double *const given = what == varied::position ? dq_ : what == varied::velocity ? dv_ : da_;
  for (int i = 0; i < nv; ++i)
    given[i] = c_.G(i, j);
  if (what == varied::position) {
    std::fill_n(rates_, t_.rows, 0.0);
    add_product(by_.velocity_by_q(), t_.rows, dq_, -1, rates_);
    c_.solved().complete(rates_, dv_);
  }
  if (what != varied::acceleration) {
    std::fill_n(rates_, t_.rows, 0.0);
    add_product(by_.acceleration_by_q(), t_.rows, dq_, -1, rates_);
    add_product(by_.acceleration_by_v(), t_.rows, dv_, -1, rates_);
    c_.solved().complete(rates_, da_);
  }
  add_product(by_q_, nv, dq_, 1, left_);
  add_product(by_v_, nv, dv_, 1, left_);
  add_product(M_, nv, da_, 1, left_);
}

finding closed_derivatives::inverse_dynamics(const double *q, const double *v, const double *a, const external_wrenches<double> &e,
                                             double *by_q, double *by_v, double *by_a) {
  if (const finding fault = c_.inverse_dynamics(q, v, a, e, tau_))
    return fault;
  const int f = c_.solved().freedoms(), nv = m_.nv();
  if (static_cast<int>(t_.drives.size()) != f)
    return {finding::kind::more_drives, -1, 0, 0, f};
  set_tree(q, v, a, e);
  double *const out[] = {by_q, by_v, by_a};
  for (const varied what : {varied::position, varied::velocity, varied::acceleration})
    for (int j = 0; j < f; ++j) {
      vary(what, j);
      c_.efforts_of_drives(left_, tau_);
      for (int i = 0; i < nv; ++i)
        out[static_cast<int>(what)][i * f + j] = tau_[i];
    }
  return {};
}

finding closed_derivatives::forward_dynamics(const double *q, const double *v, const double *tau, const external_wrenches<double> &e,
                                             double *by_q, double *by_v, double *by_tau) {
  if (const finding fault = c_.forward_dynamics(q, v, tau, e, a_))
    return fault;
  c_.set_multipliers(q, v, a_, tau, e);
  set_tree(q, v, a_, e);
  const int f = c_.solved().freedoms(), nv = m_.nv();
  if (const finding fault = c_.solve_inertia(q, nullptr))
    return fault;
  double *const out[] = {by_q, by_v};
  for (const varied what : {varied::position, varied::velocity})
    for (int j = 0; j < f; ++j) {
      vary(what, j);
      for (int i = 0; i < nv; ++i)
        left_[i] = -left_[i];
      accelerate(left_, da_);
      for (int i = 0; i < nv; ++i)
        out[static_cast<int>(what)][i * f + j] = da_[i];
    }
  for (int k = 0; k < nv; ++k) {
    std::fill_n(left_, nv, 0.0), std::fill_n(da_, nv, 0.0);
    left_[k] = 1;
    accelerate(left_, da_);
    for (int i = 0; i < nv; ++i)
      by_tau[i * nv + k] = da_[i];
  }
  return {};
}

/// a += G (Gᵀ M G)⁻¹ Gᵀ y
void closed_derivatives::accelerate(const double *y, double *a) {
  const int f = c_.solved().freedoms(), nv = m_.nv();
  for (int j = 0; j < f; ++j) {
    r_[j] = 0;
    for (int i = 0; i < nv; ++i)
      r_[j] += c_.G(i, j) * y[i];
  }
  c_.solve_again(r_);
  for (int i = 0; i < nv; ++i)
    for (int j = 0; j < f; ++j)
      a[i] += c_.G(i, j) * r_[j];
}

} // namespace ksl::loops
