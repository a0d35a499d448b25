// A singly diagonally implicit Runge–Kutta method of order 4, L-stable: Hairer and Wanner, Solving Ordinary Differential Equations II,
// 2nd edition, table IV.6.5.  Stage i is
//
//     u = h Σ aᵢⱼ rateⱼ,   v = v₀ + h Σ aᵢⱼ accelerationⱼ,                                                              (1)
//
// and its acceleration is found by Newton's method with the derivatives at the beginning of the step: with γ = aᵢᵢ and r what is left of
// a(q₀ ⊕ u, v) − acceleration, (I − hγ ∂a/∂v − h²γ² ∂a/∂q) δ = r.
//
// A change δ of the acceleration changes v by hγ δ and u by h²γ² δ, J⁻¹(u) being nearly 1.  That and the derivatives of an older state make
// convergence linear instead of quadratic; the stage that is found is the same.
#include "simulate/system/linear_solve.hpp"
#include "simulate/methods/steps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ksl::simulating {
namespace {

constexpr int stages = 5;
constexpr double diagonal = 0.25;
constexpr double at[stages] = {0.25, 0.75, 11. / 20, 0.5, 1};
constexpr double below[stages][stages] = {{},
                                          {1. / 2},
                                          {17. / 50, -1. / 25},
                                          {371. / 1360, -137. / 2720, 15. / 544},
                                          {25. / 24, -49. / 48, 125. / 16, -85. / 12}};
constexpr int most_iterations = 50;
/// Corrections of h times the acceleration, relative to the speeds, below which a stage is solved; or they no longer become smaller.
constexpr double solved = 1e-15, nearly_solved = 1e-9;

bool not_finite(const std::vector<double> &x) {
  return !std::all_of(x.begin(), x.end(), [](double number) { return std::isfinite(number); });
}

/// In terms of the table: c = at, A = below with `diagonal` γ on its diagonal, and b is the last row of A.
class sdirk4 final : public method {
public:
  explicit sdirk4(const system &of)
      : nv_(of.nv()), by_q_(nv_ * nv_), by_v_(nv_ * nv_), matrix_(nv_ * nv_), u_(nv_), v_(nv_), from_u_(nv_),
        from_v_(nv_), left_(nv_), q_(of.nq()) {
    for (stage &s : stages_)
      s.rate.resize(nv_), s.a.resize(nv_);
  }

  outcome step(system &of, block &b, double h) override {
    if (not_finite(b.a))
      return outcome::not_finite;
    if (!of.derivatives(b.t, b.first, b.q.data(), b.v.data(), by_q_.data(), by_v_.data()))
      return outcome::stopped;
    const double share = h * diagonal;
    for (std::size_t i = 0; i < nv_ * nv_; ++i)
      // I − hγ ∂a/∂v − h²γ² ∂a/∂q, once for all stages: γ is the same in each
      matrix_[i] = -share * by_v_[i] - share * share * by_q_[i];
    for (std::size_t i = 0; i < nv_; ++i)
      matrix_[i * nv_ + i] += 1;
    if (!lu_.factor(nv_, matrix_.data()))
      return outcome::not_solved;
    for (int i = 0; i < stages; ++i)
      if (const outcome found = solve_stage(of, b, h, i); found != outcome::done)
        return found;
    // the method is stiffly accurate: its last stage is the end of the step
    of.space().move(1, b.q.data(), u_.data(), b.q.data());
    b.v = v_;
    for (int j = 0; j < stages; ++j)
      b.work[0] += h * weight(stages - 1, j) * stages_[j].power;
    b.t += h;
    return outcome::done;
  }

private:
  struct stage {
    std::vector<double> rate, a;
    double power = 0;
  };
  static double weight(int i, int j) { return i == j ? diagonal : below[i][j]; }

  outcome solve_stage(system &of, const block &b, double h, int i) {
    stage &s = stages_[i];
    const stage &guess = stages_[i > 0 ? i - 1 : 0];
    for (std::size_t k = 0; k < nv_; ++k) {
      from_u_[k] = 0, from_v_[k] = b.v[k];
      for (int j = 0; j < i; ++j)
        from_u_[k] += h * below[i][j] * stages_[j].rate[k], from_v_[k] += h * below[i][j] * stages_[j].a[k];
      // from the accelerations of the stage before, and velocities at the start for the rate of u
      s.a[k] = i > 0 ? guess.a[k] : b.a[k];
      s.rate[k] = b.v[k];
    }
    const double share = h * diagonal;
    double before = std::numeric_limits<double>::infinity();
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
      for (std::size_t k = 0; k < nv_; ++k)
        v_[k] = from_v_[k] + share * s.a[k], u_[k] = from_u_[k] + share * s.rate[k];
      // (1) has the rate of u on both sides: rates at the last u, and u by them; each iteration does that once
      of.space().rates(1, u_.data(), v_.data(), s.rate.data());
      for (std::size_t k = 0; k < nv_; ++k)
        u_[k] = from_u_[k] + share * s.rate[k];
      of.space().move(1, b.q.data(), u_.data(), q_.data());
      if (!of.accelerate(b.t + at[i] * h, b.first, 1, q_.data(), v_.data(), left_.data(), &s.power))
        return outcome::stopped;
      if (iteration == 0 && not_finite(left_))
        return outcome::not_finite;
      double speed = 0, correction = 0;
      for (std::size_t k = 0; k < nv_; ++k)
        left_[k] -= s.a[k];
      lu_.solve(left_.data());
      for (std::size_t k = 0; k < nv_; ++k) {
        s.a[k] += left_[k];
        correction = std::fmax(correction, share * std::fabs(left_[k])), speed = std::fmax(speed, std::fabs(v_[k]));
      }
      if (!std::isfinite(correction))
        return outcome::not_solved;
      const double size = std::fmax(1, speed);
      if (correction <= solved * size || (correction >= before && before <= nearly_solved * size))
        return outcome::done;
      before = correction;
    }
    return outcome::not_solved;
  }

  std::size_t nv_;
  stage stages_[stages];
  std::vector<double> by_q_, by_v_, matrix_, u_, v_, from_u_, from_v_, left_, q_;
  linear_solve lu_;
};

} // namespace

std::unique_ptr<method> make_sdirk4(const system &of) { return std::make_unique<sdirk4>(of); }

} // namespace ksl::simulating
