// v' = v + h a(q, v), q' = q ⊕ h v': order 1.  Without efforts that depend on velocity it is symplectic where the mass matrix is constant.
#include "simulate/methods/steps.hpp"

namespace ksl::simulating {
namespace {

class semi_implicit_euler final : public method {
public:
  semi_implicit_euler(const system &of, std::size_t most) : u_(most * of.nv()) {}

  outcome step(system &of, block &b, double h) override {
    const std::size_t n = b.n * of.nv();
    for (std::size_t i = 0; i < n; ++i) {
      b.v[i] += h * b.a[i];
      u_[i] = h * b.v[i];
    }
    for (std::size_t k = 0; k < b.n; ++k)
      b.work[k] += h * b.power[k];
    of.space().move(b.n, b.q.data(), u_.data(), b.q.data());
    b.t += h;
    return outcome::done;
  }

private:
  std::vector<double> u_;
};

} // namespace

std::unique_ptr<method> make_semi_implicit_euler(const system &of, std::size_t most) {
  return std::make_unique<semi_implicit_euler>(of, most);
}

} // namespace ksl::simulating
