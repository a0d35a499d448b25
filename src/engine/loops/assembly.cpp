#include "engine/loops/assembly.hpp"

#include "ksl/engine/model/joints.hpp"

#include <cmath>

namespace ksl::loops {

void assembly::lay_out(arena &memory) {
  const int nq = m_.nq(), nv = m_.nv(), rows = t_.rows;
  g_.lay_out(memory);
  solve_.lay_out(memory, rows, nv);
  eliminate_.lay_out(memory, rows, nv);
  error_ = memory.take<double>(rows), right_ = memory.take<double>(rows), step_ = memory.take<double>(nv);
  trial_ = memory.take<double>(nq), far_ = memory.take<double>(nv), kept_ = memory.take<double>(nq);
  tangent_ = memory.take<double>(nv), kept_step_ = memory.take<double>(nv), fixed_ = memory.take<unsigned char>(nv),
  reached_ = memory.take<double>(1);
}

completion assembly::complete(const double *near, const unsigned char *given, const double *b, double *x,
                              double terms) {
  const int nv = m_.nv(), rows = t_.rows;
  g_.velocity(near, right_, nullptr);
  for (int i = 0; i < rows; ++i) {
    right_[i] = (b ? b[i] : 0) - right_[i];
    terms = std::max(terms, std::fabs(b ? b[i] : 0) * t_.row_scale[static_cast<std::size_t>(i)]);
  }
  for (int j = 0; j < nv; ++j)
    terms = std::max(terms, g_.size() * std::fabs(near[j]) / t_.column_scale[static_cast<std::size_t>(j)]);
  solve_.solve(g_.jacobian(), rows, nv, t_.row_scale.data(), given, g_.zero(), right_, step_);
  int free = 0;
  for (int j = 0; j < nv; ++j) {
    free += !given[j];
    x[j] = near[j] + step_[j];
  }
  const double rates = accepted_within(t_, loop_tolerance::rates);
  if (solve_.residual > rates * terms + loop_tolerance::at_rest * t_.length)
    return completion::contradictory;
  return free > solve_.rank ? completion::nearest : completion::unique;
}

completion assembly::complete_acceleration(const double *q, const double *v, const double *near,
                                           const unsigned char *given, double *x) {
  g_.set_position(q);
  std::fill_n(tangent_, m_.nv(), 0.0);
  g_.acceleration(q, v, tangent_, error_, right_);
  double terms = 0; // of redundant equations rounding of the velocities' terms is left
  for (int i = 0; i < t_.rows; ++i) {
    error_[i] = -error_[i];
    terms = std::fmax(terms, right_[i] * t_.row_scale[static_cast<std::size_t>(i)]);
  }
  return complete(near, given, error_, x, terms);
}

/// Frames and Jacobian at q; error_, and its largest component as a length.
double assembly::set_error(const double *q) {
  g_.set_position(q);
  g_.error(error_);
  double largest = 0;
  for (int i = 0; i < t_.rows; ++i) {
    const double x = std::fabs(error_[i]) * t_.row_scale[static_cast<std::size_t>(i)];
    largest = x <= largest ? largest : x; // NaN stays
  }
  return largest;
}

void assembly::step(const double *q, const double *dv, double share, double *out) {
  for (int j = 0; j < m_.nv(); ++j)
    tangent_[j] = share * dv[j];
  state_view<double> s;
  s.q = q, s.v = tangent_, s.result[0] = out;
  g_.tree().call(rows::integrate, g_.rest(), s);
}

double assembly::distance(const double *start, const double *q, double *d) {
  state_view<double> s;
  s.q = start, s.q1 = q, s.result[0] = d;
  g_.tree().call(rows::difference, g_.rest(), s);
  double sum = 0;
  for (int j = 0; j < m_.nv(); ++j)
    sum += d[j] * d[j];
  return std::sqrt(sum);
}

/// The share of step_ that moves no coordinate by more than a radian, or half a length of the mechanism.  From far away, or near a singular
/// position, a whole step can be many turns.
double assembly::longest_share() const {
  double most = 0;
  for (int j = 0; j < m_.nv(); ++j)
    most = std::max(most, std::fabs(step_[j]) / (t_.column_turns[static_cast<std::size_t>(j)] ? 1 : t_.length / 2));
  return most > 1 ? 1 / most : 1;
}

/// Brings joints with one coordinate back to their limits, and holds them there.  Was one beyond?
bool assembly::keep_limits(double *q) {
  bool beyond = false;
  for (int j = 0; j < m_.moving_joints(); ++j) {
    const joint_row &row = m_.joints()[static_cast<std::size_t>(j)];
    if (!row_of(row.kind).has_limits || row.description < 0)
      continue;
    const joint_description &given = m_.description().joints[static_cast<std::size_t>(row.description)];
    double &x = q[row.q_index];
    const bool low = given.lower && x < *given.lower, high = given.upper && x > *given.upper;
    if (!low && !high)
      continue;
    x = low ? *given.lower : *given.upper;
    fixed_[row.v_index] = 1;
    beyond = true;
  }
  return beyond;
}

/// step_: the shortest one with K x = right_.  By elimination, which is faster, where it is the only one.
void assembly::set_step() {
  const int nv = m_.nv();
  int fixed = 0;
  for (int j = 0; j < nv; ++j)
    fixed += fixed_[j];
  is_determined_ = nv - fixed <= t_.rows && eliminate_.determine(g_.jacobian(), t_.row_scale.data(),
                                                                 t_.column_scale.data(), g_.size(), fixed_, fixed);
  if (is_determined_)
    eliminate_.solve_dependent(right_, 1, step_);
  else
    solve_.solve(g_.jacobian(), t_.rows, nv, t_.row_scale.data(), fixed_, g_.size() * rank_within(t_, 0), right_,
                 step_);
}

/// Gauss–Newton steps, the shortest ones that close the linearised loops, halved while the error doesn't fall.
bool assembly::descend(double *q, int iterations, const close_options &options) {
  const double wanted = closed_within(t_, q, m_.nq());
  double error = set_error(q);
  for (int k = 0; k < iterations; ++k) {
    *reached_ = error;
    if (error <= wanted)
      return true;
    for (int i = 0; i < t_.rows; ++i)
      right_[i] = -error_[i];
    set_step();
    lost_rank_ = !is_determined_ && solve_.residual > 0.5 * error;
    double share = longest_share(), trial = 0;
    bool fell = false;
    for (int halvings = 0; halvings < 40 && !fell; ++halvings) {
      step(q, step_, share, trial_);
      if (options.limits && keep_limits(trial_))
        at_limits_ = true;
      trial = set_error(trial_);
      fell = trial < error * (1 - 1e-4 * share) || trial <= wanted;
      share /= 2;
    }
    if (!fell) {
      *reached_ = set_error(q);
      return false;
    }
    std::copy_n(trial_, m_.nq(), q);
    error = trial;
  }
  *reached_ = error;
  return error <= wanted;
}

/// step_: the part along the closed positions of the way from q to the start.  Returns its length; far is the length of the whole way.
double assembly::way_back(const double *start, const double *q, double &far) {
  const int nv = m_.nv();
  set_error(q);
  far = distance(start, q, far_);
  for (int i = 0; i < t_.rows; ++i) { // what the loops demand of the way: K⁺ K d
    right_[i] = 0;
    for (int j = 0; j < nv; ++j)
      right_[i] += g_.jacobian()[i * nv + j] * far_[j];
  }
  solve_.solve(g_.jacobian(), t_.rows, nv, t_.row_scale.data(), fixed_, g_.size() * rank_within(t_, 0), right_, step_);
  double along = 0;
  for (int j = 0; j < nv; ++j) {
    step_[j] = fixed_[j] ? 0 : step_[j] - far_[j];
    along += step_[j] * step_[j];
  }
  return std::sqrt(along);
}

/// Steps along the closed positions towards the start, each followed by Gauss–Newton steps, while they lead nearer.
void assembly::move_nearer(const double *start, double *q, const close_options &options) {
  const int nv = m_.nv();
  double share = 1, far = 0, along = way_back(start, q, far);
  for (int k = 0; k < options.iterations && share > 1e-6 && along > 1e-10 * (1 + far); ++k) {
    std::copy_n(q, m_.nq(), kept_), std::copy_n(step_, nv, kept_step_);
    step(kept_, kept_step_, share, q);
    const bool closed = descend(q, 8, {options.limits, 8});
    double new_far = 0;
    const double new_along = way_back(start, q, new_far);
    // near the end the distance is flat, and its slope still tells
    if (closed && (new_far < far * (1 - 1e-6) || (new_far < far * (1 + 1e-9) && new_along < along))) {
      share = std::min(1.0, 2 * share);
      far = new_far, along = new_along;
    } else {
      std::copy_n(kept_, m_.nq(), q), std::copy_n(kept_step_, nv, step_);
      share /= 2;
    }
  }
}

closing assembly::close(const double *q, const unsigned char *hold, const close_options &options, double *out,
                        double *error) {
  const int nv = m_.nv();
  std::copy_n(q, m_.nq(), out);
  std::copy_n(hold, nv, fixed_);
  at_limits_ = lost_rank_ = false;
  if (options.limits && keep_limits(out))
    at_limits_ = true;
  std::copy_n(hold, nv, fixed_);
  const bool closed = descend(out, options.iterations, options);
  *error = *reached_;
  if (closed && !is_determined_ && !std::equal(q, q + m_.nq(), out)) { // else there is no other nearby, or none nearer
    move_nearer(q, out, options);
    *error = set_error(out);
  }
  if (closed)
    return closing::closed;
  if (at_limits_)
    return closing::limits;
  if (std::all_of(hold, hold + nv, [](unsigned char h) { return h != 0; }))
    return closing::nothing_free;
  return lost_rank_ ? closing::singular : closing::out_of_reach;
}

} // namespace ksl::loops
