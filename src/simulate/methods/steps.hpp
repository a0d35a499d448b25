// Methods with fixed steps, each for n runs at once.
#pragma once

#include "simulate/system/system.hpp"

namespace ksl::simulating {

/// n runs at one time: their states, and what moves them there.
struct block {
  std::size_t first = 0, n = 0;
  double t = 0;
  std::vector<double> q, v, work; ///< (n, nq), (n, nv), (n)
  std::vector<double> a, power;   ///< (n, nv), (n)

  block(const system &of, std::size_t most)
      : q(most * of.nq()), v(most * of.nv()), work(most), a(most * of.nv()), power(most) {}
};

/// What a step came to.
/// stopped: a function of the user's ended it; not_solved: no solution of an implicit method's equations was found.
enum class outcome { done, stopped, not_solved, not_finite };

class method {
public:
  virtual ~method() = default;
  method(const method &) = delete;
  method &operator=(const method &) = delete;

  /// The runs are at their first state, or were moved by something else than a step.
  virtual void begin(const block &) {}
  /// Moves q, v and work by a step h.  a and power are those of the state before, and are replaced after the step by whoever calls.
  virtual outcome step(system &of, block &runs, double h) = 0;
  /// What the step came to for run k of a block for which it came to something else than done or stopped.
  virtual outcome of_run(std::size_t, outcome of_block) const { return of_block; }

protected:
  method() = default;
};

std::unique_ptr<method> make_semi_implicit_euler(const system &of, std::size_t most);
std::unique_ptr<method> make_rk4(const system &of, std::size_t most);
std::unique_ptr<method> make_rkmk4(const system &of, std::size_t most);
std::unique_ptr<method> make_sdirk4(const system &of);                        // for one run at a time
std::unique_ptr<method> make_variational(const system &of, std::size_t most); // for one at a time of closed mechanisms

/// out = Σ cᵢ xᵢ, of n numbers each.
template <std::size_t terms>
void combine(std::size_t n, const double (&c)[terms], const double *const (&x)[terms], double *out) {
  for (std::size_t i = 0; i < n; ++i) {
    double sum = c[0] * x[0][i];
    for (std::size_t j = 1; j < terms; ++j)
      sum += c[j] * x[j][i];
    out[i] = sum;
  }
}
/// out += Σ cᵢ xᵢ
template <std::size_t terms>
void add_combination(std::size_t n, const double (&c)[terms], const double *const (&x)[terms], double *out) {
  for (std::size_t i = 0; i < n; ++i) {
    double sum = c[0] * x[0][i];
    for (std::size_t j = 1; j < terms; ++j)
      sum += c[j] * x[j][i];
    out[i] += sum;
  }
}

} // namespace ksl::simulating
