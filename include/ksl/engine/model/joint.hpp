// KSL: the kinds of joints, and a table of their properties.  Their kinematics is in joints/, a file for each kind.
#pragma once

#include "ksl/types.h"

namespace ksl {

/// The kind of a joint.  Values up to KSL_JOINT_FREE are those of ksl_joint_kind_t, which is published.
enum class joint_kind : int {
  fixed = KSL_JOINT_FIXED,
  revolute = KSL_JOINT_REVOLUTE,
  prismatic = KSL_JOINT_PRISMATIC,
  helical = KSL_JOINT_HELICAL,
  spherical = KSL_JOINT_SPHERICAL,
  cylindrical = KSL_JOINT_CYLINDRICAL,
  universal = KSL_JOINT_UNIVERSAL, ///< of joints that users see; two bodies on revolute joints in the model
  planar = KSL_JOINT_PLANAR,
  floating = KSL_JOINT_FREE,
  continuous = KSL_JOINT_FREE + 1, ///< moves as a revolute joint; has no position limits
  translation = KSL_JOINT_FREE + 2,
};

/// A number of a joint's position: what tables call it after the name of the joint, empty where that says it; and its unit, m or rad,
/// empty for numbers of quaternions.
struct position_number { const char *name, *unit; };

/// What tables call a number of its velocity, acceleration and effort.  The unit is that of the coordinate: m stands for m/s, m/s² and N,
/// rad for rad/s, rad/s² and N m.
struct velocity_number { const char *velocity, *acceleration, *effort, *unit; };

/// Properties of a kind for readers of files, the model builder and users.  Made from the kind's struct (joints.hpp, row_of).
struct joint_kind_row {
  joint_kind kind;
  const char *name;       ///< in files and messages
  const char *other_name; ///< a second name in files; null: none
  int nq, nv;             ///< numbers in its position and in its velocity
  bool has_axis;   ///< does the description give an axis: along or about which it moves, or the normal of its plane
  bool has_axis2;  ///< does the description give a second axis, fixed in the child
  bool has_pitch;  ///< does the description give an advance along the axis, m/rad
  bool has_limits; ///< can its position have bounds; joints with one coordinate only
  bool is_free;    ///< does it leave its child all six freedoms
  bool in_urdf;    ///< does URDF itself define it, so that readers of others know it
  bool velocity_is_rate; ///< is its velocity the rate of its position; else it is a twist in the child's axes
  bool canonical_x; ///< is x of its child's frame chosen to suit the neighbours, since no coordinate is along x or y
  int usual_axis;   ///< the axis if the description gives none: 0, 1, 2 for x, y, z
  int angle;        ///< where in its position its angle about the axis is; −1: none
  int quaternion;   ///< where in its position a unit quaternion [x y z w] begins; −1: none
  int pose_numbers; ///< how many numbers of its child's pose change with its position, besides a rotation about the axis
  const position_number *positions;  ///< (nq)
  const velocity_number *velocities; ///< (nv)
};

} // namespace ksl
