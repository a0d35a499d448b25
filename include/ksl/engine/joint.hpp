// KSL: the kinds of joints, and what a table can say of each.  What a kind does is in joints/, a file for each.
#pragma once

#include "ksl/types.h"

namespace ksl {

/// What a joint lets its child do: the values are those of ksl_joint_kind_t.
enum class joint_kind : int {
  fixed = KSL_JOINT_FIXED,
  revolute = KSL_JOINT_REVOLUTE,
  prismatic = KSL_JOINT_PRISMATIC,
  helical = KSL_JOINT_HELICAL,
  spherical = KSL_JOINT_SPHERICAL,
  floating = KSL_JOINT_FREE,
  continuous = KSL_JOINT_FREE + 1, ///< moves as a revolute joint; has no position limits
};

/// What readers, builders and users ask about a kind.  It is made from the kind's struct (joints.hpp, row_of).
struct joint_kind_row {
  joint_kind kind;
  const char *name;       ///< in files and messages
  const char *other_name; ///< that files use as well; null: none
  int nq, nv;             ///< numbers in its position and in its velocity
  bool has_axis;          ///< is its motion along or about one axis, which the description gives
  bool has_pitch;         ///< does the description give an advance along the axis, m/rad
  bool has_limits;        ///< can its position have bounds
  bool is_free;           ///< does it leave its child all six freedoms
  bool has_angle;         ///< does its position begin with an angle about the axis
  int quaternion;         ///< where in its position a unit quaternion [x y z w] begins; −1: none
  int pose_numbers;       ///< how many numbers of its child's pose change with its position, beside a turn about the axis
};

} // namespace ksl
