#include "engine/loops/derivatives.hpp"

#include <algorithm>

namespace ksl::loops {

void closed_derivatives::lay_out(arena &memory, int externals) {
  const int nv = m_.nv();
  c_.lay_out(memory, externals);
  by_.lay_out(memory);
  by_q_ = memory.take<double>(nv * nv), by_v_ = memory.take<double>(nv * nv), M_ = memory.take<double>(nv * nv);
  dq_ = memory.take<double>(nv), dv_ = memory.take<double>(nv), da_ = memory.take<double>(nv),
  left_ = memory.take<double>(nv);
  rates_ = memory.take<double>(t_.rows), a_ = memory.take<double>(nv), tau_ = memory.take<double>(nv);
  r_ = memory.take<double>(nv);
  projected_q_ = memory.take<double>(nv * nv), projected_v_ = memory.take<double>(nv * nv),
  projected_a_ = memory.take<double>(nv * nv);
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
void closed_derivatives::set_tree(const double *q, const double *v, const double *a,
                                  const external_wrenches<double> &e) {
  state_view<double> s;
  s.q = q, s.v = v, s.a = a, s.external = e;
  s.result[0] = by_q_, s.result[1] = by_v_, s.result[2] = M_;
  c_.at().tree().call(rows::inverse_dynamics_derivatives, c_.at().rest(), s);
  by_.set(c_.at(), v, a, c_.multipliers());
  for (int i = 0; i < m_.nv() * m_.nv(); ++i)
    by_q_[i] -= by_.wrench_by_q()[i];
}

/// out (freedoms, nv) = Gᵀ matrix.
void closed_derivatives::project(const double *matrix, double *out) const {
  const int nv = m_.nv(), f = c_.solved().freedoms(), rank = c_.solved().rank;
  const int *const column = c_.solved().column;
  for (int j = 0; j < f; ++j)
    std::copy_n(matrix + column[rank + j] * nv, nv, out + j * nv);
  for (int i = 0; i < rank; ++i)
    for (int j = 0; j < f; ++j)
      if (const double g = c_.G(column[i], j); g != 0)
        for (int k = 0; k < nv; ++k)
          out[j * nv + k] += g * matrix[column[i] * nv + k];
}

/// The variation of q, v and a with number j of the independent coordinates of q, of v or of a.
void closed_derivatives::vary(varied what, int j) {
  const int nv = m_.nv();
  for (double *x : {dq_, dv_, da_})
    std::fill_n(x, nv, 0.0);
  double *const given = what == varied::position ? dq_ : what == varied::velocity ? dv_ : da_;
  for (int i = 0; i < nv; ++i)
    given[i] = c_.G(i, j);
  if (what == varied::position) {
    std::fill_n(rates_, t_.rows, 0.0);
    add_product(by_.velocity_by_q(), t_.rows, dq_, -1, rates_);
    c_.solved().complete(rates_, dv_);
  }
  if (what == varied::acceleration)
    return;
  std::fill_n(rates_, t_.rows, 0.0);
  if (what == varied::position)
    add_product(by_.acceleration_by_q(), t_.rows, dq_, -1, rates_);
  add_product(by_.acceleration_by_v(), t_.rows, dv_, -1, rates_);
  c_.solved().complete(rates_, da_);
}

/// The same, and left_ (freedoms): Gᵀ of what it does to the tree's efforts, less the wrenches of the loops.
void closed_derivatives::vary_efforts(varied what, int j) {
  const int f = c_.solved().freedoms();
  vary(what, j);
  std::fill_n(left_, m_.nv(), 0.0);
  if (what == varied::position)
    add_product(projected_q_, f, dq_, 1, left_);
  if (what != varied::acceleration)
    add_product(projected_v_, f, dv_, 1, left_);
  add_product(projected_a_, f, da_, 1, left_);
}

void closed_derivatives::motions(const double *v, const double *a, double *motions) {
  std::fill_n(rates_, t_.rows, 0.0); // of wrenches, which nobody asks for
  by_.set(c_.at(), v, a, rates_);
  for (const varied what : {varied::position, varied::velocity, varied::acceleration})
    for (int j = 0; j < c_.solved().freedoms(); ++j) {
      vary(what, j);
      for (const double *x : {dq_, dv_, da_})
        motions = std::copy_n(x, m_.nv(), motions);
    }
}

void closed_derivatives::set_projections() {
  project(by_q_, projected_q_);
  project(by_v_, projected_v_);
  project(M_, projected_a_);
}

finding closed_derivatives::inverse_dynamics(const double *q, const double *v, const double *a,
                                             const external_wrenches<double> &e, double *by_q, double *by_v,
                                             double *by_a) {
  if (const finding fault = c_.inverse_dynamics(q, v, a, e, tau_))
    return fault;
  const int f = c_.solved().freedoms(), nv = m_.nv();
  if (static_cast<int>(t_.drives.size()) != f)
    return {finding::kind::more_drives, -1, 0, 0, f};
  set_tree(q, v, a, e);
  set_projections();
  double *const out[] = {by_q, by_v, by_a};
  for (const varied what : {varied::position, varied::velocity, varied::acceleration}) {
    double *const matrix = out[static_cast<int>(what)];
    std::fill_n(matrix, nv * f, 0.0);
    for (int j = 0; j < f; ++j) {
      vary_efforts(what, j);
      for (int i = 0; i < f; ++i) // the drives are the independent coordinates
        matrix[c_.solved().independent()[i] * f + j] = left_[i];
    }
  }
  return {};
}

finding closed_derivatives::reaction_variations(const double *q, const double *v, const double *a,
                                                const external_wrenches<double> &e, double *motions, double *on_links,
                                                double *at_joints) {
  if (const finding fault = c_.inverse_dynamics(q, v, a, e, tau_))
    return fault;
  const int f = c_.solved().freedoms(), nv = m_.nv(), loops = static_cast<int>(t_.loops.size());
  if (static_cast<int>(t_.drives.size()) != f)
    return {finding::kind::more_drives, -1, 0, 0, f};
  set_tree(q, v, a, e);
  for (const varied what : {varied::position, varied::velocity, varied::acceleration})
    for (int j = 0; j < f; ++j) {
      vary(what, j);
      double *const efforts =
          left_; // of the tree, less the wrenches of the loops: Kᵀ dλ at coordinates without a drive
      std::fill_n(efforts, nv, 0.0);
      if (what == varied::position)
        add_product(by_q_, nv, dq_, 1, efforts);
      if (what != varied::acceleration)
        add_product(by_v_, nv, dv_, 1, efforts);
      add_product(M_, nv, da_, 1, efforts);
      c_.solved().multipliers(efforts, rates_);
      c_.at().wrench_variations(c_.multipliers(), rates_, dq_, on_links, at_joints);
      for (const double *x : {dq_, dv_, da_})
        motions = std::copy_n(x, nv, motions);
      on_links += 12 * loops, at_joints += 6 * loops;
    }
  return {};
}

finding closed_derivatives::forward_dynamics(const double *q, const double *v, const double *tau,
                                             const external_wrenches<double> &e, double *by_q, double *by_v,
                                             double *by_tau) {
  if (const finding fault = c_.forward_dynamics(q, v, tau, e, a_))
    return fault;
  c_.set_multipliers(q, v, a_, tau, e);
  set_tree(q, v, a_, e);
  set_projections();
  const int f = c_.solved().freedoms(), nv = m_.nv();
  double *const out[] = {by_q, by_v};
  for (const varied what : {varied::position, varied::velocity})
    for (int j = 0; j < f; ++j) {
      vary_efforts(what, j);
      for (int i = 0; i < f; ++i)
        r_[i] = -left_[i];
      accelerate(da_);
      for (int i = 0; i < nv; ++i)
        out[static_cast<int>(what)][i * f + j] = da_[i];
    }
  for (int k = 0; k < nv; ++k) {
    std::fill_n(da_, nv, 0.0);
    for (int j = 0; j < f; ++j)
      r_[j] = c_.G(k, j);
    accelerate(da_);
    for (int i = 0; i < nv; ++i)
      by_tau[i * nv + k] = da_[i];
  }
  return {};
}

/// a += G (Gᵀ M G)⁻¹ r, with the factors that forward dynamics has left.
void closed_derivatives::accelerate(double *a) {
  const int f = c_.solved().freedoms(), nv = m_.nv();
  c_.solve_again(r_);
  for (int i = 0; i < nv; ++i)
    for (int j = 0; j < f; ++j)
      a[i] += c_.G(i, j) * r_[j];
}

} // namespace ksl::loops
