// KSL: helical joint, a screw: q is the angle about the axis, rad, and the body advances along it by pitch × q, m.  A positive
// pitch (m/rad) is right-handed.
#pragma once

#include "ksl/engine/model/joints/one_axis.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <> struct joint<joint_kind::helical> : one_axis_joint<true, true> {
  static constexpr const char *name = "helical", *other_name = "screw";
};

} // namespace KSL_ISA
} // namespace ksl
