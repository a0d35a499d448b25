// The classical Runge–Kutta method of order 4, with compositions of exponentials instead of commutators: Celledoni, Marthinsen and Owren,
// Commutator-free Lie group methods (2003), table 2.  Where ⊕ is addition, it is the classical method.
//
//     q₂ = q₁ ⊕ ½h v₁,    v₂ = v₁ + ½h a₁
//     q₃ = q₁ ⊕ ½h v₂,    v₃ = v₁ + ½h a₂
//     q₄ = q₂ ⊕ (h v₃ − ½h v₁),    v₄ = v₁ + h a₃
//
//     q′ = q₁ ⊕ h/12 (3 v₁ + 2 v₂ + 2 v₃ − v₄) ⊕ h/12 (−v₁ + 2 v₂ + 2 v₃ + 3 v₄),   v′ = v₁ + h/6 (a₁ + 2 a₂ + 2 a₃ + a₄).
#include "simulate/methods/steps.hpp"

namespace ksl::simulating {
namespace {

class rk4 final : public method {
public:
  rk4(const system &of, std::size_t most) : q_(most * of.nq()), half_q_(q_.size()), u_(most * of.nv()) {
    for (stage &s : stages_)
      s.v.resize(u_.size()), s.a.resize(u_.size()), s.power.resize(most);
  }

  outcome step(system &of, block &b, double h) override {
    const std::size_t n = b.n * of.nv();
    const manifold &space = of.space();
    stage &two = stages_[0], &three = stages_[1], &four = stages_[2];
    const double *const v = b.v.data(), *const a = b.a.data();
    const auto evaluate = [&](stage &s, double t, const double *q) {
      return of.accelerate(t, b.first, b.n, q, s.v.data(), s.a.data(), s.power.data());
    };
    combine<1>(n, {h / 2}, {v}, u_.data()), space.move(b.n, b.q.data(), u_.data(), half_q_.data());
    combine<2>(n, {1, h / 2}, {v, a}, two.v.data());
    if (!evaluate(two, b.t + h / 2, half_q_.data()))
      return outcome::stopped;
    combine<1>(n, {h / 2}, {two.v.data()}, u_.data()), space.move(b.n, b.q.data(), u_.data(), q_.data());
    combine<2>(n, {1, h / 2}, {v, two.a.data()}, three.v.data());
    if (!evaluate(three, b.t + h / 2, q_.data()))
      return outcome::stopped;
    // the fourth stage starts at the second one's position
    combine<2>(n, {h, -h / 2}, {three.v.data(), v}, u_.data());
    space.move(b.n, half_q_.data(), u_.data(), q_.data());
    combine<2>(n, {1, h}, {v, three.a.data()}, four.v.data());
    if (!evaluate(four, b.t + h, q_.data()))
      return outcome::stopped;
    finish(of, b, h);
    return outcome::done;
  }

private:
  struct stage { std::vector<double> v, a, power; };

  void finish(system &of, block &b, double h) {
    const std::size_t n = b.n * of.nv();
    const double *const v[] = {b.v.data(), stages_[0].v.data(), stages_[1].v.data(), stages_[2].v.data()},
                        *const a[] = {b.a.data(), stages_[0].a.data(), stages_[1].a.data(), stages_[2].a.data()},
                        *const p[] = {b.power.data(), stages_[0].power.data(), stages_[1].power.data(),
                                      stages_[2].power.data()};
    const double whole[] = {h / 6, h / 3, h / 3, h / 6};
    if (of.space().is_flat()) {
      combine(n, whole, v, u_.data());
      of.space().move(b.n, b.q.data(), u_.data(), b.q.data());
    } else {
      // h/12 (3, 2, 2, −1), and then h/12 (−1, 2, 2, 3): together the classical weights
      combine<4>(n, {h / 4, h / 6, h / 6, -h / 12}, v, u_.data());
      of.space().move(b.n, b.q.data(), u_.data(), q_.data());
      combine<4>(n, {-h / 12, h / 6, h / 6, h / 4}, v, u_.data());
      of.space().move(b.n, q_.data(), u_.data(), b.q.data());
    }
    add_combination(n, whole, a, b.v.data());
    add_combination(b.n, whole, p, b.work.data());
    b.t += h;
  }

  stage stages_[3];
  std::vector<double> q_, half_q_, u_;
};

} // namespace

std::unique_ptr<method> make_rk4(const system &of, std::size_t most) { return std::make_unique<rk4>(of, most); }

} // namespace ksl::simulating
