//     rate_   [ 0: at the start | 1 … 11: at stages | 12: at the end, 0 of the next step | 13 … 15: for the polynomial ],  each (2 nv + 1)
//
// u begins at zero in each step: q_ is the position there, and end_ has the step u in its first nv numbers.
#include "simulate/methods/dop853.hpp"

#include "ksl/engine/model/joints.hpp"

#include <cmath>
#include <limits>

namespace ksl::simulating {

namespace table = dop853;

dop853_step::dop853_step(system &of, std::size_t run, double relative, double absolute)
    : of_(of), state_(of, run), relative_(relative), absolute_(absolute), q_(of.nq()), start_(state_.size()),
      end_(state_.size()), stage_(state_.size()), scale_(2 * of.nv()), position_(of.nv(), -1) {
  for (std::vector<double> &x : rate_)
    x.resize(state_.size());
  for (std::vector<double> &x : of_step_.part)
    x.resize(state_.size());
  const model &m = of.of();
  for (int j = 0; j < m.moving_joints(); ++j) {
    const joint_row &joint = m.joints()[static_cast<std::size_t>(j)];
    const joint_kind_row kind = ksl::row_of(joint.kind);
    for (int k = 0; k < kind.nv; ++k) // turns about several axes are of the size 1
      if (kind.velocity_is_rate || kind.quaternion < 0 || k < kind.quaternion)
        position_[static_cast<std::size_t>(joint.v_index + k)] = joint.q_index + k;
  }
}

bool dop853_step::begin(double t, const double *q, const double *v, double work) {
  t_ = t, goes_on_ = false;
  std::copy_n(q, q_.size(), q_.data());
  std::fill(start_.begin(), start_.end(), 0);
  std::copy_n(v, of_.nv(), start_.data() + of_.nv());
  start_[2 * of_.nv()] = work;
  return state_.rates(t, q_.data(), start_.data(), rate_[0].data());
}

/// An error of nothing needs no allowance.
static double relative_to(double scale, double x) { return x == 0 ? 0 : x / scale; }

/// The sum of the rates so far, and the rates there.
bool dop853_step::stage(int s) {
  for (std::size_t i = 0; i < start_.size(); ++i) {
    // k_s = f(t + c_s h, y + h Σ a_sj k_j), j < s, y in local coordinates about the position at the start of the step
    double sum = 0;
    for (int j = 0; j < s; ++j)
      if (table::a[s][j] != 0)
        sum += table::a[s][j] * rate_[j][i];
    stage_[i] = start_[i] + h_ * sum;
  }
  if (s == table::stages)
    end_ = stage_;
  return state_.rates(t_ + table::c[s] * h_, q_.data(), stage_.data(), rate_[s].data());
}

// sc = absolute + relative · max(|x|, |x′|), as the book has it; but of a joint with one axis x is its number in q, since u
// begins at zero in each step.  The work isn't judged: nothing follows from it.
void dop853_step::set_scale() {
  const std::size_t nv = of_.nv();
  const double absolute = std::fmax(absolute_, rounding_), relative = std::fmax(relative_, rounding_);
  for (std::size_t i = 0; i < nv; ++i) {
    const double x = position_[i] < 0 ? 1 : std::fabs(q_[static_cast<std::size_t>(position_[i])]);
    const double moved = std::fmax(x, position_[i] < 0 ? 1 : std::fabs(x + end_[i]));
    scale_[i] = absolute + relative * moved;
    scale_[nv + i] = absolute + relative * std::fmax(std::fabs(start_[nv + i]), std::fabs(end_[nv + i]));
  }
}

outcome dop853_step::attempt(double h) {
  h_ = h, goes_on_ = false;
  for (int s = 1; s <= table::stages; ++s)
    if (!stage(s))
      return outcome::stopped;
  set_scale();
  // |e| is the root of the sum of squares over 2 nv numbers, each beside its scale; the largest part names the coordinate for messages
  double five = 0, three = 0, most = 0;
  worst_ = -1;
  const std::size_t n = scale_.size();
  for (std::size_t i = 0; i < n; ++i) {
    double e5 = 0, e3 = 0;
    for (int s = 0; s < table::stages; ++s)
      e5 += table::of_order_5[s] * rate_[s][i], e3 += table::of_order_3[s] * rate_[s][i];
    e5 = relative_to(scale_[i], e5), e3 = relative_to(scale_[i], e3);
    five += e5 * e5, three += e3 * e3;
    if (!(std::fabs(e5) <= most) && std::isfinite(most))
      most = std::fabs(e5), worst_ = static_cast<int>(i % of_.nv());
  }
  // |e₅|² / √(|e₅|² + 0.01 |e₃|²) h: of order 8, though neither estimate is (Hairer, Nørsett and Wanner, II.10)
  const double both = five + 0.01 * three;
  error_ = both > 0 ? h * five / std::sqrt(both * static_cast<double>(n)) : both;
  if (!std::isfinite(both))
    error_ = std::numeric_limits<double>::infinity();
  return outcome::done;
}

/// Hairer, Nørsett and Wanner, Solving Ordinary Differential Equations I, section II.4.
bool dop853_step::guess_step(double most, double &h) {
  end_ = start_;
  set_scale();
  const std::size_t n = scale_.size(), nv = of_.nv();
  const auto size = [&](const std::vector<double> &x, const std::vector<double> *minus) {
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double y = relative_to(scale_[i], x[i] - (minus ? (*minus)[i] : 0));
      sum += y * y;
    }
    return std::sqrt(sum / static_cast<double>(n));
  };
  std::vector<double> y = start_;
  for (std::size_t i = 0; i < nv; ++i)
    y[i] = position_[i] < 0 ? 0 : q_[static_cast<std::size_t>(position_[i])];
  // 0.01 |y| / |y'| first; an Euler step of it tells |y''|; then 0.01 = h⁸ max(|y'|, |y''|)
  const double d0 = size(y, nullptr), d1 = size(rate_[0], nullptr);
  double first = d0 < 1e-5 || d1 < 1e-5 ? 1e-6 : 0.01 * d0 / d1;
  first = std::fmin(first, most);
  for (std::size_t i = 0; i < start_.size(); ++i)
    stage_[i] = start_[i] + first * rate_[0][i];
  if (!state_.rates(t_ + first, q_.data(), stage_.data(), rate_[1].data()))
    return false;
  const double d2 = size(rate_[1], &rate_[0]) / first, steepest = std::fmax(d1, d2);
  const double second = steepest <= 1e-15 ? std::fmax(1e-6, first * 1e-3) : std::pow(0.01 / steepest, 1. / 8);
  h = std::fmin(std::fmin(100 * first, second), most);
  if (!(h > 0))
    h = std::fmin(1e-6, most);
  return true;
}

bool dop853_step::make_dense() {
  if (goes_on_)
    return true;
  for (int s = table::stages + 1; s < table::extended; ++s)
    if (!stage(s))
      return false;
  of_step_.h = h_, of_step_.q = q_, of_step_.start = start_;
  std::vector<double> *const part = of_step_.part;
  for (std::size_t i = 0; i < start_.size(); ++i) {
    // y(θ) = y₀ + θ (p₀ + (1 − θ) (p₁ + θ (p₂ + (1 − θ) (p₃ + …)))): three parts by the ends and their rates, as Hermite's polynomial, and four
    // by all stages
    const double change = end_[i] - start_[i];
    part[0][i] = change;
    part[1][i] = h_ * rate_[0][i] - change;
    part[2][i] = 2 * change - h_ * (rate_[table::stages][i] + rate_[0][i]);
    for (int k = 0; k < 4; ++k) {
      double sum = 0;
      for (int s = 0; s < table::extended; ++s)
        if (table::dense[k][s] != 0)
          sum += table::dense[k][s] * rate_[s][i];
      part[3 + k][i] = h_ * sum;
    }
  }
  return true;
}

void dop853_step::state_on(const polynomial &p, double share, double *q, double *y) const {
  const std::size_t n = p.start.size();
  std::fill_n(y, n, 0.0);
  // Horner's scheme with θ and 1 − θ in turn
  for (int k = 6; k >= 0; --k)
    for (std::size_t i = 0; i < n; ++i)
      y[i] = (y[i] + p.part[k][i]) * (k % 2 == 0 ? share : 1 - share);
  for (std::size_t i = 0; i < n; ++i)
    y[i] += p.start[i];
  of_.space().move(1, p.q.data(), y, q);
}

outcome dop853_step::at(double share, double *q, double *v, double *work) {
  const std::size_t nv = of_.nv();
  std::vector<double> y(start_.size());
  // θ from the beginning of that polynomial's step: beyond 1 from its end on
  if (goes_on_)
    state_on(kept_, 1 + share * h_ / kept_.h, q, y.data());
  else
    state_on(of_step_, share, q, y.data());
  std::copy_n(y.data() + nv, nv, v);
  *work = y[2 * nv];
  return outcome::done;
}

const double *dop853_step::end_position(double *q) {
  if (goes_on_)
    state_on(kept_, 1 + h_ / kept_.h, q, stage_.data());
  else
    of_.space().move(1, q_.data(), end_.data(), q);
  return q;
}

void dop853_step::keep_polynomial() { kept_ = of_step_; }

void dop853_step::go_on(double h) { h_ = h, goes_on_ = true; }

void dop853_step::accept(double t) {
  const std::size_t nv = of_.nv();
  t_ = t;
  if (goes_on_) { // whose rates whoever calls has to find
    std::vector<double> q(q_.size());
    state_on(kept_, 1 + h_ / kept_.h, q.data(), start_.data());
    q_ = q;
    std::fill_n(start_.data(), nv, 0.0);
    return;
  }
  of_.space().move(1, q_.data(), end_.data(), q_.data());
  start_ = end_;
  std::fill_n(start_.data(), nv, 0.0);
  // first same as last: the rates at the end are those at the next beginning
  std::swap(rate_[0], rate_[table::stages]);
  std::copy_n(start_.data() + nv, nv, rate_[0].data()); // about the new position the rate of u is v
}

} // namespace ksl::simulating
