#include "simulate/methods/methods.hpp"

#include <cmath>
#include <limits>

namespace ksl::simulating {

std::unique_ptr<method> make_method(stepping how, const system &of, std::size_t most) {
  switch (how) {
  case stepping::semi_implicit_euler: return make_semi_implicit_euler(of, most);
  case stepping::rk4: return make_rk4(of, most);
  case stepping::rkmk4: return make_rkmk4(of, most);
  case stepping::sdirk4: return make_sdirk4(of);
  case stepping::variational: return make_variational(of, most);
  case stepping::dop853: break;
  }
  __builtin_unreachable();
}

/// ⌈(end − begin) / step⌉, at least 1: but where the quotient is a whole number up to the rounding of times, and up to 1e-12 of itself, no further
/// step is made for that.
double equal_steps(double begin, double end, double step) {
  constexpr double quotient = 1e-12, times = 2 * std::numeric_limits<double>::epsilon();
  const double length = end - begin, rounding = times * std::fmax(std::fabs(begin), std::fabs(end));
  return std::fmax(1, std::ceil((length - rounding) / step * (1 - quotient)));
}

} // namespace ksl::simulating
