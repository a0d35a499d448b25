// Springs, dampers and cylinders between points of two links, on top of the kernels.  At a state each pulls its two points together with a
// force along the line between them, which acts as an external wrench on each of the two links.  Algorithms that know external wrenches are
// called with these; energies and derivatives get what is missing.  A model without such elements pays one comparison.
//
// With l the distance of the points p₁ and p₂, l u = p₂ − p₁, and f the tension, the wrenches are f u at p₁ and −f u at p₂.  What a small
// motion adds to them is closed-form:
//
//     d(f u) = (df − f/l dl) u + f/l d(p₂ − p₁),   dl = u · d(p₂ − p₁),   df = ∂f/∂l dl + ∂f/∂l̇ dl̇.                     (1)
#pragma once

#include "engine/elements/forces_in_states.hpp"

#include <string>
#include <vector>

namespace ksl::elements {

extern template class forces<double>;
extern template class forces<float>;

/// Why an element has no force at a state; empty if all have one.  v may be null.  Allocates.
template <class S> std::string reason(const model &m, const S *q, const S *v);

/// All elements of a model at one state, in memory of its own; whether they act or not.
class found_forces {
public:
  explicit found_forces(const model &m, double rounding = rounding_of<double>);
  /// v may be null.
  void set(const double *q, const double *v);
  const element_state<double> &operator[](std::size_t i) const { return at_.of(0, static_cast<int>(i)); }

private:
  forces<double> at_;
  std::vector<std::byte> memory_;
};

} // namespace ksl::elements
