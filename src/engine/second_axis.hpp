// Second axes of joints.
#pragma once

#include "ksl/engine/description.hpp"

namespace ksl {

// Kinds with a second axis are merged later; until then no description has one.
template <class Row> bool has_second_axis(const Row &row) {
  if constexpr (requires { row.has_axis2; })
    return row.has_axis2;
  return false;
}
template <class Joint> void set_second_axis(Joint &joint, const vec3<double> &axis) {
  if constexpr (requires { joint.axis2; })
    joint.axis2 = axis;
}

} // namespace ksl
