// KSL: the workspace of one computation, the only thing that changes.  Allocated once (ksl::data); no algorithm
// allocates.  One thread, one workspace.
#pragma once

#include "ksl/engine/model.hpp"

namespace ksl {

/// How a body moves, which is all that its laws of motion ask for.
template <class T> struct body_motion {
  vec3<T> angular_velocity, angular_acceleration;
  vec3<T> acceleration; ///< classical, of the frame's origin, minus gravity
};

/// What forward dynamics keeps for each body, about its frame's origin, in the axes of the base (Featherstone, RBDA
/// (2008), section 7.3).
template <class T> struct articulated_state {
  coscrew<T> column; ///< U = A S; of joints with one coordinate
  T inverse;         ///< 1 / (Sᵀ U)
  T effort;          ///< u = τ − Sᵀ p
  screw<T> gain;     ///< acceleration beyond that of the motion without joint accelerations
};

/// Where the axis of a joint lies: its direction, and the origin of the joint.
template <class T> struct joint_axis { vec3<T> z, origin; };

/// Arrays over bodies, coordinates or links; each algorithm says which of them it leaves filled.  Those of numbers hold
/// what is named, in the order of body_lanes.hpp.
template <class T> struct data_view {
  SE3<T> *in_parent;            ///< pose of each body in its parent, what its joint moves of it: as pose_in_parent keeps it
  SE3<T> *in_world;             ///< pose of each body
  T *sine, *cosine;             ///< of the joints' turns, body.after included; room_for_angles(nq), used where q holds angles
  T *motion;                    ///< body_motion of each body
  T *wrench;                    ///< coscrew of each body
  T *rotation;                  ///< mat3x3 of each body: its axes in those of the base
  T *inertia;                   ///< articulated_inertia of each body in the axes of the base, or spatial_inertia of what
                                ///< hangs on it in its own
  vec3<T> *offset;              ///< from the parent's origin to that of each body, in the axes of the base
  joint_axis<T> *axis;          ///< of each body's joint, in the frame of the base
  screw<T> *twist;              ///< of each body, in its frame
  articulated_state<T> *articulated;
  coscrew<T> *link_wrench;      ///< through the joint that carries each link, in its body's frame
};

inline namespace KSL_ISA {

/// Room for n numbers in whole registers of any instruction set.
constexpr int padded(int n) { return (n + 15) / 16 * 16; }

/// The same where registers may begin at any of the n.
constexpr int room_for_angles(int nq) { return padded(nq) + padded(1); }

} // namespace KSL_ISA

/// Wrenches that the environment exerts on links: linear first, at the link's origin, in the link's axes.
template <class T> struct external_wrenches {
  int n = 0;
  const int *link = nullptr;  ///< (n)
  const T *wrench = nullptr;  ///< (n, 6)
};

} // namespace ksl
