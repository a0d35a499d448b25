// How a closed position is found, q ⊕ dv being a step of the joints (rows::integrate):
//
//     descend        Gauss–Newton: q ← q ⊕ s · dv, dv the shortest with K dv = −e, s halved until the
//                    largest error falls (Nocedal and Wright, Numerical Optimization, 3.1 and 10.3)
//     search         the same from other starts, where that ends in a minimum that isn't zero
//     move_nearer    along the closed positions: descend ends at one of many where the mechanism has freedoms, not at the nearest to the start
#include "engine/loops/assembly.hpp"

#include "engine/loops/idle_bodies.hpp"
#include "ksl/engine/model/joints.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace ksl::loops {

void assembly::lay_out(arena &memory) {
  const int nq = m_.nq(), nv = m_.nv(), rows = t_.rows;
  g_.lay_out(memory);
  const int spins = static_cast<int>(t_.idle.size());
  solve_.lay_out(memory, rows + spins, nv);
  with_spins_ = memory.take<double>(spins > 0 ? (rows + spins + 6) * nv : 0);
  scales_ = memory.take<double>(spins > 0 ? rows + spins : 0);
  eliminate_.lay_out(memory, rows, nv);
  error_ = memory.take<double>(rows), right_ = memory.take<double>(rows + spins), step_ = memory.take<double>(nv);
  trial_ = memory.take<double>(nq), far_ = memory.take<double>(nv), kept_ = memory.take<double>(nq);
  begin_ = memory.take<double>(nq), other_ = memory.take<double>(nq);
  tangent_ = memory.take<double>(nv), kept_step_ = memory.take<double>(nv), fixed_ = memory.take<unsigned char>(nv),
  reached_ = memory.take<double>(1);
}

/// The equations of loops, and below them for each idle body, none of whose coordinates are given, one by which it doesn't spin: its right side is at the
/// end of right_.  That of a body whose coordinates are given is empty.
const double *assembly::with_spins(const request &at, const unsigned char *given) {
  const int nv = m_.nv(), rows = t_.rows, all = rows + static_cast<int>(t_.idle.size());
  //     with_spins_ (rows + idle bodies + 6, nv) = [ K | a row n · J_ω for each idle body | memory for one Jacobian ]
  double *const jacobian = with_spins_ + all * nv;
  std::copy_n(g_.jacobian(), rows * nv, with_spins_);
  std::copy_n(t_.row_scale.data(), rows, scales_);
  for (int i = rows; i < all; ++i) {
    const idle_body &body = t_.idle[static_cast<std::size_t>(i - rows)];
    double *const row = with_spins_ + i * nv;
    std::fill_n(row, nv, 0.0);
    scales_[i] = t_.length, right_[i] = 0;
    if (std::any_of(body.moved.begin(), body.moved.end(), [given](int v) { return given[v]; }))
      continue;
    set_spin_row(g_.tree(), g_.rest(), body, at.q, jacobian, row);
    // n · ω̇ = rate at a = 0 + row · a has to be zero, with a = near + step; for velocities likewise row · (near + step) = 0
    if (at.v)
      right_[i] -= spin_rate(g_.tree(), g_.rest(), body, at.q, at.v, tangent_);
    for (int j = 0; j < nv; ++j)
      right_[i] -= row[j] * at.near[j];
  }
  return with_spins_;
}

completion assembly::complete_velocity(const double *q, const double *near, const unsigned char *given, double *x) {
  g_.set_position(q);
  return complete({q, nullptr, near}, given, nullptr, x);
}

completion assembly::complete(const request &at, const unsigned char *given, const double *b, double *x, double terms) {
  const double *const near = at.near;
  const int nv = m_.nv(), rows = t_.rows;
  // K (near + step) = b with the shortest step: x is the solution nearest to `near`
  g_.velocity(near, right_, nullptr);
  for (int i = 0; i < rows; ++i) {
    right_[i] = (b ? b[i] : 0) - right_[i];
    terms = std::max(terms, std::fabs(b ? b[i] : 0) * t_.row_scale[static_cast<std::size_t>(i)]);
  }
  for (int j = 0; j < nv; ++j)
    terms = std::max(terms, g_.size() * std::fabs(near[j]) / t_.column_scale[static_cast<std::size_t>(j)]);
  if (at.q && !t_.idle.empty() && std::any_of(given, given + nv, [](unsigned char is_given) { return is_given; }))
    solve_.solve(with_spins(at, given), rows + static_cast<int>(t_.idle.size()), nv, scales_, given, g_.zero(), right_,
                 step_);
  else
    solve_.solve(g_.jacobian(), rows, nv, t_.row_scale.data(), given, g_.zero(), right_, step_);
  int free = 0;
  for (int j = 0; j < nv; ++j) {
    free += !given[j];
    x[j] = near[j] + step_[j];
  }
  // what the equations contradict each other by, of terms that cancel and of rounding at rest
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
  return complete({q, v, near}, given, error_, x, terms);
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
/// A coordinate that a step leads beyond a limit is held at it for the rest of this descent: the next steps look for closed positions with it there.
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
    // the equations contradict each other here, to first order, by half of the error or more: no step closes them
    lost_rank_ = !is_determined_ && solve_.residual > 0.5 * error;
    double share = longest_share(), trial = 0;
    bool fell = false;
    for (int halvings = 0; halvings < 40 && !fell; ++halvings) {
      step(q, step_, share, trial_);
      if (options.limits && keep_limits(trial_))
        at_limits_ = true;
      trial = set_error(trial_);
      // Armijo's condition: by a share of what the step would close if the loops were linear
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
  // step = K⁺ K d − d = −(1 − K⁺ K) d: back along d = q ⊖ start, without what K sees of it, which would open the loops
  solve_.solve(g_.jacobian(), t_.rows, nv, t_.row_scale.data(), fixed_, g_.size() * rank_within(t_, 0), right_, step_);
  double along = 0;
  for (int j = 0; j < nv; ++j) {
    step_[j] = fixed_[j] ? 0 : step_[j] - far_[j];
    along += step_[j] * step_[j];
  }
  return std::sqrt(along);
}

/// Steps along the closed positions towards the start, each followed by Gauss–Newton steps, while they lead nearer.
/// A descent of ½ |q ⊖ start|² on the closed positions: its slope there is (1 − K⁺ K) d, zero at the nearest position, and `descend` brings each step
/// back onto them.  share is that of the whole way, doubled after a step that leads nearer, halved after one that doesn't.
void assembly::move_nearer(const double *start, double *q, const close_options &options) {
  const int nv = m_.nv();
  double share = 1, far = 0, along = way_back(start, q, far);
  for (int k = 0; k < options.iterations && share > 1e-6 && along > 1e-10 * (1 + far); ++k) {
    std::copy_n(q, m_.nq(), kept_), std::copy_n(step_, nv, kept_step_);
    step(kept_, kept_step_, share, q);
    const bool closed = descend(q, 8, {options.limits, 8, 1});
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

/// `descend` from q, which it replaces, with all joints free that are not to be held.
bool assembly::descend_from(double *q, const unsigned char *hold, const close_options &options) {
  const int nv = m_.nv();
  std::copy_n(hold, nv, fixed_);
  if (options.limits && keep_limits(q))
    at_limits_ = true;
  std::copy_n(hold, nv, fixed_);
  return descend(q, options.iterations, options);
}

/// Start number `start` into other_: coordinates that are free differ from q at random, the same in every call, at first by a little, and
/// then by half a turn, or by a length of the mechanism.
void assembly::set_start(const double *q, const unsigned char *hold, int start) {
  constexpr int whole = 4; // starts until the largest differences
  std::uint64_t state = static_cast<std::uint64_t>(start);
  for (int j = 0; j < m_.nv(); ++j) {
    state =
        state * 6364136223846793005U + 1442695040888963407U; // Knuth, The Art of Computer Programming 2, section 3.3.4
    const double share = std::ldexp(static_cast<double>(state >> 11), -52) - 1;
    const double most = t_.column_turns[static_cast<std::size_t>(j)] ? std::numbers::pi : t_.length;
    step_[j] = hold[j] ? 0 : share * most * std::min(1.0, static_cast<double>(start) / whole);
  }
  step(q, step_, 1, other_);
}

/// Other starts, since a minimum of the error says nothing about other closed positions: out becomes the nearest of the first ones that
/// are found.  False where there is none: out is then the position that is least open, whose error it may lower.
bool assembly::search(const double *q, const unsigned char *hold, const close_options &options, double *out,
                      double *error) {
  constexpr int enough = 4;
  double nearest = std::numeric_limits<double>::infinity();
  bool is_alone = true;
  for (int start = 1, found = 0; start < options.starts && found < enough; ++start) {
    set_start(q, hold, start);
    if (!descend_from(other_, hold, options)) {
      if (found == 0 && *reached_ < *error)
        *error = *reached_, std::copy_n(other_, m_.nq(), out);
      continue;
    }
    ++found;
    if (const double far = distance(q, other_, far_); far < nearest)
      nearest = far, is_alone = is_determined_, std::copy_n(other_, m_.nq(), out);
  }
  is_determined_ = is_alone;
  std::copy_n(hold, m_.nv(), fixed_);
  return std::isfinite(nearest);
}

/// From the given position; where that ends in a minimum, from others; and then, where freedoms are left, along the closed positions towards the
/// start.
closing assembly::close(const double *near, const unsigned char *hold, const close_options &options, double *out,
                        double *error) {
  const double *const q = begin_; // out may be near
  std::copy_n(near, m_.nq(), begin_), std::copy_n(near, m_.nq(), out);
  at_limits_ = lost_rank_ = false;
  bool closed = descend_from(out, hold, options);
  *error = *reached_;
  // what to say if no position is found, in this order: limits stopped the way there; nothing was free to move; the equations contradict each other
  const bool is_held = std::all_of(hold, hold + m_.nv(), [](unsigned char h) { return h != 0; });
  const closing why = at_limits_   ? closing::limits
                      : is_held    ? closing::nothing_free
                      : lost_rank_ ? closing::singular
                                   : closing::not_found;
  if (!closed && !is_held && std::isfinite(*error) && search(q, hold, options, out, error))
    closed = true, *error = set_error(out);
  if (closed && !is_determined_ && !std::equal(q, q + m_.nq(), out)) { // else there is no other nearby, or none nearer
    move_nearer(q, out, options);
    *error = set_error(out);
  }
  return closed ? closing::closed : why;
}

} // namespace ksl::loops
