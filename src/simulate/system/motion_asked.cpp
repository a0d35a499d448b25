#include "simulate/system/motion_asked.hpp"

namespace ksl::simulating {

motion_asked::motion_asked(const model &m, const manifold &space, const drive_law &law)
    : law_(law), space_(space), nq_(static_cast<std::size_t>(m.nq())), nv_(static_cast<std::size_t>(m.nv())), q_(nq_),
      v_(nv_), a_(nv_), way_(nv_), end_(nv_), step_(nv_), rate_(nv_) {}

/// With u₁ the way from one row to the next, s the share of the interval and h its length, the position is q₀ ⊕ u(s),
///
///     u(s) = h v₀ s + (3 u₁ − h (2 v₀ + r₁)) s² + (h (v₀ + r₁) − 2 u₁) s³,
///
/// r₁ being the rate of u that the velocity v₁ means at u₁.  On curved joints the velocity is J(u) du/dt.
void motion_asked::find_at(std::size_t run, double t) {
  const instant at = find(law_.position, t);
  std::fill(v_.begin(), v_.end(), 0), std::fill(a_.begin(), a_.end(), 0);
  if (law_.acceleration)
    add_at(law_.acceleration, at, run, nv_, a_.data());
  const double *const q0 = row_of(law_.position, run, at.before, nq_);
  if (at.length <= 0) {
    std::copy_n(q0, nq_, q_.data());
    if (law_.velocity)
      add_at(law_.velocity, at, run, nv_, v_.data());
    return;
  }
  const double *const v0 = law_.velocity ? row_of(law_.velocity, run, at.before, nv_) : v_.data();
  space_.difference(1, q0, q0 + nq_, way_.data());
  space_.rates(1, way_.data(), law_.velocity ? v0 + nv_ : v0, end_.data());
  const double s = at.share, h = at.length;
  for (std::size_t k = 0; k < nv_; ++k) {
    // Hermite's cubic on [0, 1]: u(0) = 0, u(1) = u₁, u′(0) = h v₀, u′(1) = h r₁
    const double first = h * v0[k], last = h * end_[k], square = 3 * way_[k] - 2 * first - last,
                 cube = first + last - 2 * way_[k];
    step_[k] = s * (first + s * (square + s * cube));
    rate_[k] = (first + s * (2 * square + 3 * s * cube)) / h;
  }
  space_.move(1, q0, step_.data(), q_.data());
  space_.velocities(1, step_.data(), rate_.data(), v_.data());
}

} // namespace ksl::simulating
