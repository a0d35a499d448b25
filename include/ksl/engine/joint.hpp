// KSL: the kinds of joints, a closed set, and the size of each.
#pragma once

#include "ksl/isa.hpp"

namespace ksl {

/// What a joint lets its child do.  The order is that of joint_kinds below.
enum class joint_kind : int { fixed, revolute, continuous, prismatic, floating };

/// A row per kind: its name in files and messages, how many numbers its position and its velocity take.
struct joint_kind_row {
  const char *name;
  int nq, nv;
};

inline namespace KSL_ISA { // kernels call row_of

inline constexpr joint_kind_row joint_kinds[] = {
    {"fixed", 0, 0},      //
    {"revolute", 1, 1},   // angle about the axis, rad
    {"continuous", 1, 1}, // the same without limits; one number, not (cos, sin)
    {"prismatic", 1, 1},  // displacement along the axis, m
    {"floating", 7, 6},   // q = [x y z qx qy qz qw], v = [linear, angular] in the child's frame
};

constexpr const joint_kind_row &row_of(joint_kind kind) { return joint_kinds[static_cast<int>(kind)]; }

/// Does the joint turn its child about one axis?  Most do; kernels have a straight way for them.
constexpr bool turns(joint_kind kind) { return kind == joint_kind::revolute || kind == joint_kind::continuous; }

} // namespace KSL_ISA

} // namespace ksl
