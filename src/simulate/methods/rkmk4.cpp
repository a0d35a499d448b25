// The classical Runge–Kutta method of order 4 in local coordinates u of the manifold about the position where the step begins: Munthe-Kaas,
// High order Runge–Kutta methods on manifolds (1999).
//
//     uᵢ = cᵢ h k_{i−1},   vᵢ = v + cᵢ h a_{i−1},   kᵢ = J⁻¹(uᵢ) vᵢ,   c = 0, ½, ½, 1
//     q′ = q ⊕ h/6 (k₁ + 2 k₂ + 2 k₃ + k₄),        v′ = v + h/6 (a₁ + 2 a₂ + 2 a₃ + a₄)
//
// with J⁻¹ whole (manifold::rates), where the paper has as many of its terms as the order needs.
#include "simulate/methods/steps.hpp"

namespace ksl::simulating {
namespace {

class rkmk4 final : public method {
public:
  rkmk4(const system &of, std::size_t most) : q_(most * of.nq()), u_(most * of.nv()) {
    for (stage &s : stages_)
      s.v.resize(u_.size()), s.rate.resize(u_.size()), s.a.resize(u_.size()), s.power.resize(most);
  }

  outcome step(system &of, block &b, double h) override {
    const std::size_t n = b.n * of.nv();
    const double share[] = {h / 2, h / 2, h};
    const double *rate = b.v.data(), *a = b.a.data(); // at u = 0 the rate of u is v
    for (int i = 0; i < 3; ++i) {
      stage &s = stages_[i];
      combine<1>(n, {share[i]}, {rate}, u_.data());
      combine<2>(n, {1, share[i]}, {b.v.data(), a}, s.v.data());
      of.space().move(b.n, b.q.data(), u_.data(), q_.data());
      if (!of.accelerate(b.t + share[i], b.first, b.n, q_.data(), s.v.data(), s.a.data(), s.power.data()))
        return outcome::stopped;
      of.space().rates(b.n, u_.data(), s.v.data(), s.rate.data());
      rate = s.rate.data(), a = s.a.data();
    }
    const double whole[] = {h / 6, h / 3, h / 3, h / 6};
    const stage &two = stages_[0], &three = stages_[1], &four = stages_[2];
    combine<4>(n, whole, {b.v.data(), two.rate.data(), three.rate.data(), four.rate.data()}, u_.data());
    of.space().move(b.n, b.q.data(), u_.data(), b.q.data());
    add_combination<4>(n, whole, {b.a.data(), two.a.data(), three.a.data(), four.a.data()}, b.v.data());
    add_combination<4>(b.n, whole, {b.power.data(), two.power.data(), three.power.data(), four.power.data()},
                       b.work.data());
    b.t += h;
    return outcome::done;
  }

private:
  struct stage { std::vector<double> v, rate, a, power; };
  stage stages_[3];
  std::vector<double> q_, u_;
};

} // namespace

std::unique_ptr<method> make_rkmk4(const system &of, std::size_t most) { return std::make_unique<rkmk4>(of, most); }

} // namespace ksl::simulating
