// The state of one run in local coordinates about a position, and its rates, as one array of 2 nv + 1 numbers: u, v and the work.
#pragma once

#include "simulate/system/system.hpp"

namespace ksl::simulating {

///     y   [ u (nv) | v (nv) | W ]            q = q₀ ⊕ u
///     dy  [ J⁻¹(u) v | a(q, v, t) | power ]
class local_state {
public:
  local_state(system &of, std::size_t run) : of_(of), run_(run), q_(of.nq()) {}

  std::size_t size() const { return 2 * of_.nv() + 1; }

  /// The rates dy of y about q0 at time t.  False if a function ended the run.
  bool rates(double t, const double *q0, const double *y, double *dy) {
    const std::size_t nv = of_.nv();
    of_.space().move(1, q0, y, q_.data());
    if (!of_.accelerate(t, run_, 1, q_.data(), y + nv, dy + nv, dy + 2 * nv))
      return false;
    of_.space().rates(1, y, y + nv, dy);
    return true;
  }

private:
  system &of_;
  std::size_t run_;
  std::vector<double> q_;
};

} // namespace ksl::simulating
