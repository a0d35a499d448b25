// KSL: bounds that have one value where numbers are double, and another where they are float.
#pragma once

#include "ksl/isa.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// S: the number that a model holds.  Specialised for scalars whose precision isn't seen from their size.
template <class S> inline S of_precision(double in_double, double in_single) {
  return S(sizeof(S) == sizeof(float) ? in_single : in_double);
}

} // namespace KSL_ISA
} // namespace ksl
