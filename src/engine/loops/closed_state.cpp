// How a state is computed: set_position first, which everything else relies on; then the motion and its multipliers, inverse_dynamics or
// forward_dynamics with set_multipliers; set_reactions, if wrenches are asked for, replaces the multipliers; all_wrenches hands them to the tree as
// external wrenches.  The numbers of equations are in the order of rows, those of coordinates in that of v, those of freedoms in that of
// k_.independent():
//
//     rows_[0], rows_[1]   (rows) what equations give, and the sums of the magnitudes of their terms
//     rows_[2]             (rows) errors of positions, for Baumgarte's correction, which rows_[1] then has
//     tree_, left_         (nv) efforts of the tree; those that multipliers have to balance
//     small_               (freedoms) right sides of (2) and (3); from small_ + nv on the terms of H before they cancel
//     M_, MG_, H_          M (nv, nv), M G (nv, freedoms), Gᵀ M G and then its factors (freedoms, freedoms)
#include "engine/loops/closed_state.hpp"

#include "engine/loops/idle_bodies.hpp"
#include "engine/loops/sparse_product.hpp"
#include "ksl/linalg.h"

#include <cmath>

namespace ksl::loops {

void closed_state::lay_out(arena &memory, int externals) {
  const int m = t_.rows, nv = m_.nv(), loops = static_cast<int>(t_.loops.size());
  g_.lay_out(memory, externals + 2 * loops);
  k_.lay_out(memory, m, nv);
  for (double *&x : rows_)
    x = memory.take<double>(m);
  lambda_ = memory.take<double>(m), null_lambda_ = memory.take<double>(m * m);
  zero_ = memory.take<double>(nv), tree_ = memory.take<double>(nv), left_ = memory.take<double>(nv),
  a0_ = memory.take<double>(nv);
  G_ = memory.take<double>(nv * nv), M_ = memory.take<double>(nv * nv), MG_ = memory.take<double>(std::max(nv, 6) * nv);
  H_ = memory.take<double>(nv * nv), small_ = memory.take<double>(4 * nv);
  massless_ = memory.take<unsigned char>(nv);
  reactions_ = memory.take<double>(6 * (joints() + loops));
  patterns_ = memory.take<double>(static_cast<std::ptrdiff_t>(m) * pattern_length());
  energy_ = memory.take<double>(m * m), stiff_ = memory.take<double>(m);
  wrenches_ = memory.take<double>(6 * (externals + 2 * loops)), at_joints_ = memory.take<double>(6 * loops);
  wrench_links_ = memory.take<int>(externals + 2 * loops), joint_links_ = memory.take<int>(joints());
  if (!zero_) // memory is only measured
    return;
  std::fill_n(zero_, nv, 0.0);
  for (int j = 0; j < joints(); ++j)
    joint_links_[j] = m_.joints()[static_cast<std::size_t>(j)].link;
}

/// The first equation whose value is beyond the tolerance of its terms; of the mechanism's length for errors of positions.
/// Not ≤ rather than >: NaN is a finding.
finding closed_state::check(finding::kind what, const double *values, const double *terms, bool lengths) const {
  for (int i = 0; i < t_.rows; ++i) {
    // an equation of rotation is compared with an angle, one of translation with a length
    // |e_i| ≤ ε L for positions; |ė_i| ≤ ε Σ |terms| + ε₀ L for rates, whose terms may all be zero
    const double length = t_.length / t_.row_scale[static_cast<std::size_t>(i)]; // 1 rad for moments
    const double allowed = lengths ? tolerance_ * length : tolerance_ * terms[i] + loop_tolerance::at_rest * length;
    if (!(std::fabs(values[i]) <= allowed))
      return {what, i, values[i], allowed, 0};
  }
  return {};
}

void closed_state::set_G() {
  const int nv = m_.nv(), f = k_.freedoms();
  // dependent coordinates follow by the elimination, independent ones are themselves: in the order of pivots G = [−U⁻¹ U_i; 1]
  std::fill_n(G_, nv * f, 0.0);
  for (int j = 0; j < f; ++j)
    G_[k_.independent()[j] * f + j] = 1;
  for (int i = 0; i < k_.rank; ++i)
    for (int j = 0; j < f; ++j)
      G_[k_.column[i] * f + j] = k_.element(i, j);
}

void closed_state::set_open_position(const double *q, preferred kept) {
  patterns_known_ = -1;
  g_.set_position(q);
  if (kept.coordinates == t_.is_kept.data() && !t_.idle.empty())
    k_.factor_by_stages(g_.jacobian(), t_.row_scale.data(), t_.column_scale.data(), g_.size(), g_.zero(),
                        t_.stages.data());
  else
    k_.factor(g_.jacobian(), t_.row_scale.data(), t_.column_scale.data(), g_.size(), g_.zero(), kept.coordinates,
              kept.n);
  set_G();
}

finding closed_state::set_position(const double *q, preferred kept) {
  set_open_position(q, kept);
  g_.error(rows_[0]);
  return check(finding::kind::open, rows_[0], nullptr, true);
}

namespace {

/// Takes off x what it has along the unit vector u, and returns how much.
double take_off(int n, double *x, const double *u) {
  double along = 0;
  for (int i = 0; i < n; ++i)
    along += x[i] * u[i];
  for (int i = 0; i < n; ++i)
    x[i] -= along * u[i];
  return along;
}

/// Makes x a unit vector, and returns its length.
double normalise(int n, double *x) {
  double sum = 0;
  for (int i = 0; i < n; ++i)
    sum += x[i] * x[i];
  const double norm = std::sqrt(sum);
  for (int i = 0; i < n && norm > 0; ++i)
    x[i] /= norm;
  return norm;
}

} // namespace

finding closed_state::efforts_of_drives(const double *y, double *tau) {
  const int nv = m_.nv(), f = k_.freedoms(), n = static_cast<int>(t_.kept.size());
  std::fill_n(tau, nv, 0.0);
  if (f == 0)
    return {};
  if (!t_.drives_are_known)
    return {finding::kind::no_drives, -1, 0, 0, f};
  // the right side of Gᵀ E τ_d = Gᵀ y
  double *const wanted = small_;
  for (int j = 0; j < f; ++j) {
    wanted[j] = 0;
    for (int i = 0; i < nv; ++i)
      wanted[j] += G_[i * f + j] * y[i];
  }
  bool are_independent = n == f;
  for (int j = 0; j < f && are_independent; ++j)
    are_independent = t_.is_kept[static_cast<std::size_t>(k_.independent()[j])];
  if (are_independent) { // their rows of G are those of the identity
    for (int j = 0; j < f; ++j)
      tau[k_.independent()[j]] = wanted[j];
  } else if (const finding fault = efforts_of_least_norm(wanted, tau)) {
    return fault;
  }
  return no_effort_of_idle(y, tau);
}

/// What efforts y (nv) of the tree may leave along the motion of an idle body.
double closed_state::rounding_of_idle(const idle_body &body, const double *y) const {
  double largest = 0; // as forces
  for (int i = 0; i < m_.nv(); ++i)
    largest = std::fmax(largest, std::fabs(y[i]) * t_.column_scale[static_cast<std::size_t>(i)]);
  return tolerance_ * largest / t_.column_scale[static_cast<std::size_t>(body.coordinate)];
}

/// The motion of an idle body alone has power neither at the drives nor at other bodies, so that what the motion needs along it nothing gives.  Where it
/// needs none, the efforts of the drives don't depend on how the body's own motion is chosen.
finding closed_state::no_effort_of_idle(const double *y, double *tau) const {
  for (const idle_body &body : t_.idle) {
    const std::size_t at = static_cast<std::size_t>(body.coordinate);
    const double allowed = rounding_of_idle(body, y);
    if (!(std::fabs(tau[at]) <= allowed))
      return {finding::kind::idle_effort, body.coordinate, tau[at], allowed, k_.freedoms()};
    tau[at] = 0;
  }
  return {};
}

// The vectors g_j, row j of Gᵀ E W^(−1/2), made orthonormal in turn; W^(1/2) τ = Σ z_j ĝ_j has least norm.  The rank is judged on scaled
// numbers.
//
//     minimise τᵀ W τ with g_j · (W^(1/2) τ) = wanted_j.  Rows become ĝ_j = (g_j − Σ_k<j r_k ĝ_k) / |…|, and z_j likewise from wanted_j, so that
//     ĝ_j · (W^(1/2) τ) = z_j: the solution without a part orthogonal to all ĝ_j is the shortest.
finding closed_state::efforts_of_least_norm(double *wanted, double *tau) {
  const int f = k_.freedoms(), n = static_cast<int>(t_.kept.size());
  // MG_ and H_ hold nothing here: only solve_inertia sets them, before efforts are asked for
  double *const basis = MG_, *const scaled = H_;
  for (int j = 0; j < f; ++j)
    for (int d = 0; d < n; ++d) {
      const std::size_t drive = static_cast<std::size_t>(t_.kept[static_cast<std::size_t>(d)]);
      const double g = G_[static_cast<int>(drive) * f + j];
      // W^(−1/2) weighs drives; scales of coordinates, which angles and lengths have alike, tell a rank
      basis[j * n + d] = g * t_.kept_scale[static_cast<std::size_t>(d)];
      scaled[j * n + d] = g * t_.column_scale[static_cast<std::size_t>(k_.independent()[j])] / t_.column_scale[drive];
    }
  for (int j = 0; j < f; ++j) {
    for (int pass = 0; pass < 2; ++pass)
      for (int k = 0; k < j; ++k)
        take_off(n, scaled + j * n, scaled + k * n);
    // nothing is left of g_j: no drive moves this freedom that doesn't move others the same way
    if (!(normalise(n, scaled + j * n) > loop_tolerance::rank))
      return {finding::kind::few_drives, k_.independent()[j], 0, 0, f};
  }
  for (int j = 0; j < f; ++j) {
    double *const g = basis + j * n;
    for (int pass = 0; pass < 2;
         ++pass) // what is taken off g_j is Σ_k r_k ĝ_k: its share of the right side goes with it
      for (int k = 0; k < j; ++k)
        wanted[j] -= take_off(n, g, basis + k * n) * wanted[k];
    wanted[j] /= normalise(n, g);
  }
  for (int d = 0; d < n; ++d)
    for (int j = 0; j < f; ++j)
      tau[t_.kept[static_cast<std::size_t>(d)]] +=
          wanted[j] * basis[j * n + d] * t_.kept_scale[static_cast<std::size_t>(d)];
  return {};
}

finding closed_state::steady_acceleration(const double *q, const double *v, double *a, const stabilisation *gains) {
  g_.velocity(v, rows_[0], rows_[1]);
  if (const finding fault = check(finding::kind::velocity, rows_[0], rows_[1], false))
    return fault;
  // Baumgarte: ë + 2 α ė + β² e = 0 for the errors e of the loops, so K a = −K̇ v − 2 α K v − β² e
  double *const corrected = rows_[1];
  std::fill_n(corrected, t_.rows, 0.0);
  if (gains) {
    g_.error(rows_[2]);
    for (int i = 0; i < t_.rows; ++i)
      corrected[i] = 2 * gains->alpha * rows_[0][i] + gains->beta * gains->beta * rows_[2][i];
  }
  g_.acceleration(q, v, zero_, rows_[0], nullptr);
  for (int i = 0; i < t_.rows; ++i)
    rows_[0][i] = -rows_[0][i] - corrected[i];
  k_.solve_dependent(rows_[0], 1, a);
  return {};
}

void closed_state::stop_idle_bodies(const double *q, const double *v, double *a, bool all) {
  const int nv = m_.nv(), f = k_.freedoms();
  for (const idle_body &body : t_.idle)
    for (int j = 0; j < f && (all || has_massless_idle_); ++j)
      if (k_.independent()[j] == body.coordinate && (all || massless_[j])) {
        set_spin_row(g_.tree(), g_.rest(), body, q, MG_, left_);
        double of_motion = 0;
        for (int i = 0; i < nv; ++i)
          of_motion += left_[i] * G_[i * f + j];
        // n · ω̇ of the body is spin_rate; a unit of independent coordinate j adds n · J G_j to it, and moves nothing else
        const double share = spin_rate(g_.tree(), g_.rest(), body, q, v, a) / of_motion;
        for (int i = 0; i < nv && std::isfinite(share); ++i)
          a[i] -= share * G_[i * f + j];
      }
}

finding closed_state::inverse_dynamics(const double *q, const double *v, const double *a,
                                       const external_wrenches<double> &e, double *tau) {
  if (v) {
    g_.velocity(v, rows_[0], rows_[1]);
    if (const finding fault = check(finding::kind::velocity, rows_[0], rows_[1], false))
      return fault;
  }
  if (v || a) {
    g_.acceleration(q, zeros_or(v), zeros_or(a), rows_[0], rows_[1]);
    if (const finding fault = check(finding::kind::acceleration, rows_[0], rows_[1], false))
      return fault;
  }
  state_view<double> s;
  s.q = q, s.v = zeros_or(v), s.a = zeros_or(a), s.external = e, s.result[0] = tree_;
  call(rows::inverse_dynamics, s);
  if (const finding fault = efforts_of_drives(tree_, tau))
    return fault;
  for (int i = 0; i < m_.nv(); ++i)
    left_[i] = tree_[i] - tau[i];
  k_.multipliers(left_, lambda_);
  return {};
}

finding closed_state::solve_inertia(const double *q, double *r, const double *y) {
  const int nv = m_.nv(), f = k_.freedoms();
  if (f == 0)
    return {};
  state_view<double> s;
  s.q = q, s.result[0] = M_;
  call(rows::mass_matrix, s);
  std::fill_n(MG_, nv * f, 0.0), std::fill_n(H_, f * f, 0.0);
  add_product(1, M_, nv, nv, G_, f, MG_);
  add_transposed_product(G_, nv, f, MG_, f, H_);
  // H = Gᵀ M G.  A freedom that moves no mass has a zero of H, which rounding hides: the terms that cancelled tell it.
  // All terms of H_ii = Σ_kl G_ki M_kl G_li count: M is positive semidefinite, so |G_ki M_kl G_li| ≤ (G_ki² M_kk + G_li² M_ll) / 2, and those of the
  // diagonal, nv times, bound the sum of all.
  double *const whole = small_ + m_.nv();
  for (int i = 0; i < f; ++i) {
    whole[i] = 0; // of terms before they cancel, none of which is negative
    for (int k = 0; k < nv; ++k)
      whole[i] += G_[k * f + i] * G_[k * f + i] * M_[k * nv + k];
  }
  const double least = is_single_ ? loop_tolerance::inertia_of_single : loop_tolerance::inertia;
  has_massless_idle_ = false, std::fill_n(massless_, f, static_cast<unsigned char>(0));
  for (const idle_body &body : t_.idle)
    for (int i = 0; i < f; ++i)
      if (k_.independent()[i] == body.coordinate && H_[i * f + i] <= least * whole[i]) {
        // Without inertia an effort along the motion has no answer.  Without an effort any acceleration is one: its row of H becomes that of the identity,
        // with a right side of zero, and stop_idle_bodies chooses the acceleration.
        if (!y || !(std::fabs(r[i]) <= rounding_of_idle(body, y)))
          return {finding::kind::massless, body.coordinate, 0, 0, f};
        for (int k = 0; k < f; ++k) // it moves no mass alone, and so none together with others
          H_[i * f + k] = H_[k * f + i] = 0;
        H_[i * f + i] = whole[i] = 1, r[i] = 0;
        has_massless_idle_ = true, massless_[i] = 1;
      }
  // H is symmetric and positive definite where each freedom moves mass, so L D Lᵀ needs no pivots (Golub and Van Loan, 4.1 and 4.2)
  // After it H_ has D on its diagonal and L below: what follows compares each D_i with the terms of which it is left.
  const bool is_regular = ksl_linalg_ldlt_rmo(H_, f) == 0;
  for (int i = 0; i < f; ++i) { // what the others leave of a freedom's inertia
    // the diagonal of H = L D Lᵀ is Σ L_ik² D_k, k ≤ i: D_i is what is left of it where the freedoms before i follow
    double terms = whole[i];
    for (int k = 0; k < i; ++k)
      terms += H_[i * f + k] * H_[i * f + k] * whole[k];
    if (!is_regular || !(H_[i * f + i] > least * terms)) // NaN: it overflows
      return {finding::kind::massless, k_.independent()[i], std::isfinite(terms) ? 0 : std::nan(""), 0, f};
  }
  solve_again(r);
  return {};
}

void closed_state::solve_again(double *r) const {
  if (const int f = k_.freedoms(); f > 0)
    ksl_linalg_ldlt_solve(H_, r, r, f, f, 1);
}

/// From (1), Kᵀ λ = M a + b − τ, by its rows at dependent coordinates; the others hold then, if a is the acceleration under τ.
void closed_state::set_multipliers(const double *q, const double *v, const double *a, const double *tau,
                                   const external_wrenches<double> &e) {
  state_view<double> s;
  s.q = q, s.v = v, s.a = a, s.external = e, s.result[0] = tree_;
  call(rows::inverse_dynamics, s);
  for (int i = 0; i < m_.nv(); ++i)
    left_[i] = tree_[i] - tau[i];
  k_.multipliers(left_, lambda_);
}

finding closed_state::forward_dynamics(const double *q, const double *v, const double *tau,
                                       const external_wrenches<double> &e, double *a, const stabilisation *gains) {
  if (const finding fault = steady_acceleration(q, v, a0_, gains))
    return fault;
  state_view<double> s;
  // (3): b + M a₀ by one inverse dynamics of the tree, at the accelerations a₀ that need no freedom
  s.q = q, s.v = v, s.a = a0_, s.external = e, s.result[0] = tree_;
  call(rows::inverse_dynamics, s);
  const int nv = m_.nv(), f = k_.freedoms();
  double *const r = small_;
  for (int i = 0; i < nv; ++i)
    left_[i] = tau[i] - tree_[i];
  for (int j = 0; j < f; ++j) {
    r[j] = 0;
    for (int i = 0; i < nv; ++i)
      r[j] += G_[i * f + j] * left_[i];
  }
  if (const finding fault = solve_inertia(q, r, left_))
    return fault;
  for (int i = 0; i < nv; ++i) {
    a[i] = a0_[i];
    for (int j = 0; j < f; ++j)
      a[i] += G_[i * f + j] * r[j];
  }
  stop_idle_bodies(q, v, a, false);
  return {};
}

finding closed_state::velocity_jump(const double *q, const external_wrenches<double> &impulses, double *jump) {
  state_view<double> s;
  // ∫(1) dt over the impact, in which q stays: M Δv = Σ Jᵀ impulse + Kᵀ ∫λ, K Δv = 0.  Inverse dynamics at rest without weight gives −Σ Jᵀ impulse.
  s.q = q, s.v = s.a = zero_, s.external = impulses, s.result[0] = tree_;
  g_.tree().call_weightless(rows::inverse_dynamics, g_.rest(), s);
  const int nv = m_.nv(), f = k_.freedoms();
  double *const r = small_;
  for (int j = 0; j < f; ++j) {
    r[j] = 0;
    for (int i = 0; i < nv; ++i)
      r[j] -= G_[i * f + j] * tree_[i];
  }
  if (const finding fault = solve_inertia(q, r, tree_))
    return fault;
  for (int i = 0; i < nv; ++i) {
    jump[i] = 0;
    for (int j = 0; j < f; ++j)
      jump[i] += G_[i * f + j] * r[j];
  }
  stop_idle_bodies(q, zero_, jump, false);
  return {};
}

external_wrenches<double> closed_state::all_wrenches(const external_wrenches<double> &e) {
  g_.wrenches(lambda_, wrench_links_ + e.n, wrenches_ + 6 * e.n, at_joints_);
  const int loops = static_cast<int>(t_.loops.size());
  std::copy_n(e.link, e.n, wrench_links_);
  std::copy_n(e.wrench, 6 * e.n, wrenches_);
  if (e.axes == expressed_in::world)
    for (int k = 0; k < 2 * loops; ++k) {
      // two wrenches a loop, on its successor and on its predecessor, in the axes of these links
      const mat3x3<double> R = g_.link_axes(k / 2, k % 2 == 0);
      double *const x = wrenches_ + 6 * (e.n + k);
      for (double *part : {x, x + 3}) {
        vec3<double> u = {part[0], part[1], part[2]};
        algebra<double>::product_drv(&R, &u, &u);
        part[0] = u.x, part[1] = u.y, part[2] = u.z;
      }
    }
  return {e.n + 2 * loops, wrench_links_, wrenches_, e.axes};
}

} // namespace ksl::loops
