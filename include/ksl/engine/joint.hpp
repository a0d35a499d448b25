// KSL: the kinds of joints, and a table of their properties.  Their kinematics is in joints/, a file for each kind.
#pragma once

#include "ksl/types.h"

namespace ksl {

/// The kind of a joint.  The values are those of ksl_joint_kind_t.
enum class joint_kind : int {
  fixed = KSL_JOINT_FIXED,
  revolute = KSL_JOINT_REVOLUTE,
  prismatic = KSL_JOINT_PRISMATIC,
  helical = KSL_JOINT_HELICAL,
  spherical = KSL_JOINT_SPHERICAL,
  floating = KSL_JOINT_FREE,
  continuous = KSL_JOINT_FREE + 1, ///< moves as a revolute joint; has no position limits
};

/// Properties of a kind for readers of files, the model builder and users.  Made from the kind's struct (joints.hpp, row_of).
struct joint_kind_row {
  joint_kind kind;
  const char *name;       ///< in files and messages
  const char *other_name; ///< a second name in files; null: none
  int nq, nv;             ///< numbers in its position and in its velocity
  bool has_axis;          ///< does it move along or about a single axis, which the description gives
  bool has_pitch;         ///< does the description give an advance along the axis, m/rad
  bool has_limits;        ///< can its position have bounds
  bool is_free;           ///< does it leave its child all six freedoms
  bool has_angle;         ///< does its position begin with an angle about the axis
  int quaternion;         ///< where in its position a unit quaternion [x y z w] begins; −1: none
  int pose_numbers;       ///< how many numbers of its child's pose change with its position, besides a rotation about the axis
};

} // namespace ksl
