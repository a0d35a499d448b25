// Arrays of the runs that are computed together, a row for each:
//
//     tau_        τ, of drives                               wanted_     accelerations that computed torque asks inverse dynamics for
//     applied_    τ + τ_f, what accelerations follow from    computed_   efforts that one call of inverse dynamics gives, before they are added
//     wrenches_   (runs, wrenches, 6)                        parts_      (runs, 5, nv) of efforts
//
// and of one run: moved_ [ q | v ], closed; changed_ [ q | v | step | τ before ], for differences.
#include "simulate/system/system.hpp"

#include "batch/compute_batch.hpp"
#include "ksl/engine/model/joint_physics.hpp"
#include "ksl/surgery.hpp"

#include <cmath>

namespace ksl::simulating {

system::system(const model &m, const simulation &task, std::size_t most)
    : m_(m), task_(task), law_(task.drives), space_(m), nq_(static_cast<std::size_t>(m.nq())),
      nv_(static_cast<std::size_t>(m.nv())), tau_(most * nv_), wanted_(most * nv_), error_(nv_), computed_(most * nv_),
      applied_(most * nv_), wrenches_(most * 6 * static_cast<std::size_t>(task.external_n)) {
  for (int e = 0; e < task.external_n; ++e)
    links_.push_back(task.external[e].link);
  // wrenches_ is (runs, wrenches, 6): those of one link lie 6 · wrenches numbers apart from run to run
  for (int e = 0; e < task.external_n; ++e)
    external_.push_back({links_[static_cast<std::size_t>(e)], {wrenches_.data() + 6 * e, 6 * task.external_n}});
  if (law_.position)
    asked_.emplace(m, space_, law_);
  if (!m.loops().empty())
    closed_.emplace(m, task.external_n, most);
  if (closed_ && task.method == stepping::variational)
    tree_.emplace(without_loops(m.description()));
  if (elements::has_dampers(m))
    dampers_.emplace(m);
  if (m.acting_force_elements() > 0)
    forces_.emplace(m), element_.assign(most, -1);
  if (task.laws.any())
    held_.emplace(task.laws, m.nv(), most);
}

batch_view<double> system::batch_of(std::size_t n, const double *q, const double *v, const double *a,
                                    const double *tau) const {
  const std::ptrdiff_t nv = m_.nv();
  batch_view<double> batch;
  batch.n = n, batch.q = {q, m_.nq()}, batch.v = {v, nv}, batch.a = {a, nv}, batch.tau = {tau, nv};
  batch.external_n = task_.external_n, batch.external = external_.data(), batch.external_axes = task_.external_axes;
  return batch;
}

/// Calls an algorithm with one result (n, nv or 1) and without a look at what it computed.
void system::call(const algorithm_row &row, std::size_t n, const double *q, const double *v, const double *a,
                  const double *tau, double *out) {
  batch_view<double> batch = batch_of(n, q, v, a, tau);
  batch.result[0] = {out, row.result[0].axes == 0 ? 1 : m_.nv()};
  compute_states(row, m_, batch, 0, n);
}

/// Calls it for the tree that carries the loops, with rows of `columns` numbers.
void system::call_tree(const algorithm_row &row, const batch_view<double> &inputs, double *out, std::size_t columns) {
  batch_view<double> batch = inputs;
  batch.result[0] = {out, static_cast<std::ptrdiff_t>(columns)};
  compute_states(row, tree(), batch, 0, batch.n);
}

/// By the plan where it fits, but where laws hold coordinates: what an effort causes is known for pivots of the state's own.
void system::accelerate_closed(std::size_t n, const double *q, const double *v, double *a) {
  constexpr std::size_t most = closed_mechanism::most_by_plan;
  batch_view<double> batch = batch_of(n, q, v, nullptr, applied_.data());
  batch.result[0] = {a, m_.nv()};
  for (std::size_t first = 0; first < n; first += most) {
    const std::size_t count = std::min(most, n - first);
    bool done[most] = {};
    if (!held_)
      closed_->accelerate_by_plan(batch, first, static_cast<int>(count), done);
    for (std::size_t k = first; k < first + count; ++k)
      if (!done[k - first] &&
          !closed_->accelerate(q + k * nq_, v + k * nv_, applied_.data() + k * nv_, wrenches_of(k), a + k * nv_))
        std::fill_n(a + k * nv_, nv_, std::nan(""));
  }
}

/// What a stage leaves open changes accelerations by as much divided by the last pivot, which is small near a singular position: there the state is
/// closed first (single_run.cpp), or taken as it is where it can't be.
void system::accelerate_nearest(const double *q, const double *v, double *a) {
  moved_.assign(q, q + nq_), moved_.insert(moved_.end(), v, v + nv_);
  double opened;
  const bool is_closed = project(moved_.data(), moved_.data() + nq_, opened);
  accelerate_closed(1, is_closed ? moved_.data() : q, is_closed ? moved_.data() + nq_ : v, a);
}

// λ does no work, since what it holds stands: power is that of the efforts before hold().
bool system::accelerate(double t, std::size_t first, std::size_t n, const double *q, const double *v, double *a,
                        double *power) {
  evaluations_ += n;
  if (!set_efforts(t, first, n, q, v)) {
    std::fill_n(tau_.data(), n * nv_, std::nan(""));
    return false;
  }
  std::copy_n(tau_.data(), n * nv_, applied_.data());
  if (held_)
    held_->add_friction(n, applied_.data());
  if (closes_first_)
    accelerate_nearest(q, v, a);
  else if (closed_)
    accelerate_closed(n, q, v, a);
  else
    call(rows::forward_dynamics, n, q, v, nullptr, applied_.data(), a);
  note_elements(n, q, v, a);
  if (held_)
    held_->hold(*this, n, q, a);
  set_power(n, q, v, applied_.data(), power);
  return true;
}

// An element whose points meet has no direction: the run that ends there names it.
void system::note_elements(std::size_t n, const double *q, const double *v, const double *x) {
  for (std::size_t k = 0; forces_ && k < n; ++k) {
    const double *const row = x + k * nv_;
    if (std::all_of(row, row + nv_, [](double number) { return std::isfinite(number); }))
      continue;
    forces_->set(q + k * nq_, v + k * nv_);
    for (std::size_t i = 0; i < m_.force_elements().size(); ++i)
      if ((*forces_)[i].found() != elements::fault::none)
        element_[k] = static_cast<int>(i);
  }
}

void system::responses(const double *q, const std::vector<held_coordinate> &coordinates, double *a) {
  const std::size_t n = coordinates.size();
  for (std::size_t j = 0; closed_ && j < n; ++j)
    closed_->response(coordinates[j].coordinate, a + j * nv_);
  if (closed_ || n == 0)
    return;
  // coordinates are listed run by run: one M⁻¹ serves all of a run
  std::size_t runs = 0;
  positions_.resize(n * nq_);
  for (std::size_t j = 0; j < n; ++j)
    if (j == 0 || coordinates[j].run != coordinates[j - 1].run)
      std::copy_n(q + coordinates[j].run * nq_, nq_, positions_.data() + runs++ * nq_);
  inverses_.resize(runs * nv_ * nv_);
  batch_view<double> batch;
  batch.n = runs, batch.q = {positions_.data(), m_.nq()};
  batch.result[0] = {inverses_.data(), m_.nv() * m_.nv()};
  compute_states(rows::mass_matrix_inverse, m_, batch, 0, runs);
  const double *inverse = inverses_.data();
  for (std::size_t j = 0; j < n; ++j) {
    if (j > 0 && coordinates[j].run != coordinates[j - 1].run)
      inverse += nv_ * nv_;
    // row k of M⁻¹, which is symmetric: what an effort of 1 at coordinate k accelerates
    std::copy_n(inverse + static_cast<std::size_t>(coordinates[j].coordinate) * nv_, nv_, a + j * nv_);
  }
}

/// In this order: brakes that cut all; a function, which gives all; else the controller, gravity, what is given over time,
/// and limits last, of the sum.
bool system::set_efforts(double t, std::size_t first, std::size_t n, const double *q, const double *v) {
  set_wrenches(t, first, n);
  std::fill_n(tau_.data(), n * nv_, 0.0);
  if (is_cut_)
    return true;
  if (law_.function)
    return law_.function(law_.context, first, n, t, q, v, tau_.data());
  if (asked_)
    follow(t, first, n, q, v);
  if (law_.holds_gravity)
    add_gravity(n, q);
  if (law_.given) {
    const instant at = find(law_.given, t);
    for (std::size_t k = 0; k < n; ++k)
      add_at(law_.given, at, first + k, nv_, tau_.data() + k * nv_);
  }
  keep_limits(n);
  return true;
}

void system::set_wrenches(double t, std::size_t first, std::size_t n) {
  const std::size_t links = links_.size();
  for (std::size_t e = 0; e < links; ++e) {
    const rows_over_time &rows = task_.external[e].wrench;
    const instant at = find(rows, t);
    for (std::size_t k = 0; k < n; ++k) {
      double *const wrench = wrenches_.data() + 6 * (k * links + e);
      std::fill_n(wrench, 6, 0.0);
      add_at(rows, at, first + k, 6, wrench);
    }
  }
}

/// stiffness (q_d ⊖ q) + damping (v_d − v), as efforts or, with a_d, as accelerations for inverse dynamics.
/// Computed torque: τ = ID(q, v, a_d + k_p (q_d ⊖ q) + k_d (v_d − v)) makes the error obey ë + k_d ė + k_p e = 0 (Siciliano et al., Robotics (2009),
/// section 8.5.2).
void system::follow(double t, std::size_t first, std::size_t n, const double *q, const double *v) {
  for (std::size_t k = 0; k < n; ++k) {
    if (k == 0 || law_.position.run_stride || law_.velocity.run_stride || law_.acceleration.run_stride)
      asked_->find_at(first + k, t);
    space_.difference(1, q + k * nq_, asked_->q(), error_.data());
    for (std::size_t i = 0; i < nv_; ++i) {
      double x = law_.computed_torque ? asked_->a()[i] : 0;
      if (law_.stiffness)
        x += law_.stiffness[i] * error_[i];
      if (law_.damping)
        x += law_.damping[i] * (asked_->v()[i] - v[k * nv_ + i]);
      (law_.computed_torque ? wanted_ : tau_)[k * nv_ + i] = x;
    }
  }
  if (law_.computed_torque)
    add_inverse_dynamics(n, q, v);
}

void system::add_inverse_dynamics(std::size_t n, const double *q, const double *v) {
  if (closed_)
    for (std::size_t k = 0; k < n; ++k) {
      closed_->complete_acceleration(q + k * nq_, v + k * nv_, wanted_.data() + k * nv_);
      closed_->efforts(q + k * nq_, v + k * nv_, wanted_.data() + k * nv_, wrenches_of(k), computed_.data() + k * nv_);
    }
  else
    call(rows::inverse_dynamics, n, q, v, wanted_.data(), nullptr, computed_.data());
  for (std::size_t i = 0; i < n * nv_; ++i)
    tau_[i] += computed_[i];
}

// what inverse dynamics needs at rest, without external wrenches
void system::add_gravity(std::size_t n, const double *q) {
  for (std::size_t k = 0; closed_ && k < n; ++k)
    closed_->efforts(q + k * nq_, nullptr, nullptr, {}, computed_.data() + k * nv_);
  if (!closed_) {
    batch_view<double> batch;
    batch.n = n, batch.q = {q, m_.nq()}, batch.result[0] = {computed_.data(), m_.nv()};
    compute_states(rows::gravity_torque, m_, batch, 0, n);
  }
  for (std::size_t i = 0; i < n * nv_; ++i)
    tau_[i] += computed_[i];
}

void system::keep_limits(std::size_t n) {
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = 0; i < nv_; ++i) {
      double &x = tau_[k * nv_ + i];
      if (law_.limit && std::fabs(x) > law_.limit[i])
        x = std::copysign(law_.limit[i], x);
      if (law_.driven && !law_.driven[i])
        x = 0;
    }
}

/// P = τ · v + Σ w · V + P_dampers − Σ (d v + F f(v / w)) v: of efforts, of external wrenches w on links with twists V, of dampers, of damping and
/// smooth friction of joints.
void system::set_power(std::size_t n, const double *q, const double *v, const double *tau, double *power) {
  if (task_.external_n)
    call(rows::external_power, n, q, v, nullptr, nullptr, power);
  else
    std::fill_n(power, n, 0.0);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = 0; i < nv_; ++i)
      power[k] += tau[k * nv_ + i] * v[k * nv_ + i];
  for (std::size_t k = 0; dampers_ && k < n; ++k)
    power[k] += dampers_->power(q + k * nq_, v + k * nv_);
  const model_view<double> view = m_.view();
  if (!view.physics)
    return;
  moving_.resize(
      static_cast<std::size_t>(view.nv)); // followers have physics of their own, and move as their leaders do
  for (std::size_t k = 0; k < n; ++k) {
    if (m_.followers())
      expand_motion(m_.coupling_in<double>(), v + k * nv_, moving_.data());
    else
      std::copy_n(v + k * nv_, nv_, moving_.data());
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      const coordinate_physics<double> &c = view.physics[i];
      power[k] -= (c.damping * moving_[i] + c.friction * friction_at(moving_[i], c.friction_width)) * moving_[i];
    }
  }
}

/// Efforts that are no part of the Lagrangian, for the variational method: Jᵀ w of external wrenches, dampers between points, damping and smooth
/// friction of joints.
void system::set_outer_efforts(std::size_t n, const double *q, const double *v, double *out) {
  const std::size_t size = n * nv_;
  std::fill_n(out, size, 0.0);
  if (task_.external_n) {
    // Jᵀ w: the efforts that hold the mechanism without the wrenches, less those that hold it with them
    batch_view<double> batch = batch_of(n, q, nullptr, nullptr, nullptr);
    call_tree(rows::gravity_torque, batch, computed_.data(), nv_);
    for (std::size_t i = 0; i < size; ++i)
      out[i] -= computed_[i];
    batch.external_n = 0;
    call_tree(rows::gravity_torque, batch, computed_.data(), nv_);
    for (std::size_t i = 0; i < size; ++i)
      out[i] += computed_[i];
  }
  for (std::size_t k = 0; dampers_ && k < n; ++k)
    dampers_->add_efforts(q + k * nq_, v + k * nv_, out + k * nv_);
  if (!m_.view().physics)
    return;
  parts_.resize(5 * size);
  call_tree(rows::effort_parts, batch_of(n, q, v, nullptr, nullptr), parts_.data(), 5 * nv_);
  for (std::size_t i = 0; i < size; ++i) {
    // (n, 5, nv): rows 1 and 2 are what damping and friction need, which is minus what they do
    const double *const of_run = parts_.data() + i / nv_ * 5 * nv_ + i % nv_;
    out[i] -= of_run[nv_] + of_run[2 * nv_];
  }
}

// What is held doesn't accelerate, however q and v change: (1) of held_joints.hpp, with each column for the accelerations.
bool system::derivatives(double t, std::size_t run, const double *q, const double *v, double *by_q, double *by_v) {
  if (!add_derivatives(t, run, q, v, by_q, by_v))
    return false;
  if (!held_)
    return true;
  double power;
  if (!accelerate(t, run, 1, q, v, changed_.data(), &power)) // sets what holds there
    return false;
  held_->hold_derivatives(by_q), held_->hold_derivatives(by_v);
  return true;
}

/// Efforts of drives change accelerations by M⁻¹ times their own derivatives, which are differences: one for each coordinate of q and of v.
/// They serve Newton's method in sdirk4, whose solution doesn't depend on them: one-sided differences are enough.  Efforts
/// that are given over time have none by q and v.
bool system::add_derivatives(double t, std::size_t run, const double *q, const double *v, double *by_q, double *by_v) {
  const std::size_t square = nv_ * nv_;
  changed_.resize(nq_ + 3 * nv_), rates_.resize(square);
  if (!set_efforts(t, run, 1, q, v))
    return false;
  batch_view<double> batch = batch_of(1, q, v, nullptr, tau_.data());
  batch.result[0] = {by_q, 0}, batch.result[1] = {by_v, 0}, batch.result[2] = {rates_.data(), 0};
  if (!closed_)
    compute_states(rows::forward_dynamics_derivatives, m_, batch, 0, 1);
  else if (!closed_->derivatives(q, v, tau_.data(), wrenches_of(0), by_q, by_v, rates_.data()))
    std::fill_n(by_q, square, std::nan("")); // no step can be solved
  if (!law_.function && !asked_ && !law_.holds_gravity)
    return true;
  double *const x = changed_.data(), *const w = x + nq_, *const step = w + nv_, *const before = step + nv_;
  std::copy_n(tau_.data(), nv_, before);
  for (std::size_t k = 0; k < 2 * nv_; ++k) {
    const std::size_t c = k % nv_;
    // about the root of the unit roundoff, 1.5e-8: half of the digits are left
    const double size = 1e-7 * std::fmax(1, k < nv_ ? 1 : std::fabs(v[c]));
    std::fill_n(step, nv_, 0.0), std::copy_n(v, nv_, w), std::copy_n(q, nq_, x);
    if (k < nv_)
      step[c] = size, space_.move(1, q, step, x);
    else
      w[c] += size;
    if (!set_efforts(t, run, 1, x, w))
      return false;
    double *const out = k < nv_ ? by_q : by_v;
    for (std::size_t i = 0; i < nv_; ++i)
      for (std::size_t j = 0; j < nv_; ++j)
        // da/dx = ∂a/∂x (τ stays) + M⁻¹ ∂τ/∂x
        out[i * nv_ + c] += rates_[i * nv_ + j] * (tau_[j] - before[j]) / size;
  }
  return true;
}

} // namespace ksl::simulating
