// What the dampers of a model take from it.
#pragma once

#include "engine/elements/forces.hpp"

namespace ksl::elements {

/// Does a model have elements with damping that act?
bool has_dampers(const model &m);

/// What they take from the mechanism, for one state.
class dampers {
public:
  explicit dampers(const model &m)
      : m_(m), at_(m), forces_(m.force_elements().size()), unit_(static_cast<std::size_t>(m.nv())) {}
  /// Not positive.
  double power(const double *q, const double *v);
  /// Adds their efforts to out (nv).
  void add_efforts(const double *q, const double *v, double *out);

private:
  const model &m_;
  found_forces at_;
  std::vector<double> forces_, unit_;
};

} // namespace ksl::elements
