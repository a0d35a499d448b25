#include "engine/elements/dampers.hpp"

#include <algorithm>

namespace ksl::elements {

bool has_dampers(const model &m) {
  const auto damps = [](const force_element_row &of) { return of.numbers.damping > 0; };
  return m.acting_force_elements() > 0 && std::any_of(m.force_elements().begin(), m.force_elements().end(), damps);
}

/// −Σ c l̇²: a damper pulls its points together by c l̇ while they part by l̇.
double dampers::power(const double *q, const double *v) {
  at_.set(q, v);
  double power = 0;
  for (std::size_t i = 0; i < m_.force_elements().size(); ++i)
    power -= m_.force_elements()[i].numbers.damping * at_[i].speed * at_[i].speed;
  return power;
}

/// They are −Σ damping dl/dt ∂l/∂q, and ∂l/∂q is dl/dt for a velocity of 1.
void dampers::add_efforts(const double *q, const double *v, double *out) {
  at_.set(q, v);
  for (std::size_t i = 0; i < forces_.size(); ++i)
    forces_[i] = m_.force_elements()[i].numbers.damping * at_[i].speed;
  for (std::size_t k = 0; k < unit_.size(); ++k) {
    unit_[k] = 1;
    at_.set(q, unit_.data());
    unit_[k] = 0;
    for (std::size_t i = 0; i < forces_.size(); ++i)
      out[k] -= forces_[i] * at_[i].speed;
  }
}

} // namespace ksl::elements
