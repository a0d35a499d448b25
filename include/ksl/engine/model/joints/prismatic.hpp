// KSL: prismatic joint: q is the displacement along the axis, m.
#pragma once

#include "ksl/engine/model/joints/one_axis.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <> struct joint<joint_kind::prismatic> : one_axis_joint<false, true> {
  static constexpr const char *name = "prismatic";
  static constexpr bool in_urdf = true;
};

} // namespace KSL_ISA
} // namespace ksl
