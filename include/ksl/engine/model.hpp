// KSL: a mechanism as the algorithms see it: flat arrays, immutable after build, shared between threads.
//
// Links welded by fixed joints are one body.  Body 0 is the ground and all that is welded to it; body i > 0 hangs on
// joint i.  The frame of a body is *canonical*: at the joint's origin, z along the joint's axis, x normal to z and to
// the axis of the first joint on the body that isn't parallel (Denavit and Hartenberg's choice).  The ground, and bodies
// whose joints have no axis, keep their links' axes.  Nothing a user sees is expressed in canonical frames.
#pragma once

#include "ksl/algebra.hpp"
#include "ksl/engine/joint.hpp"
#include "ksl/engine/plane_rotation.hpp"

namespace ksl {

/// A body and the joint that carries it.  offset, alpha and theta0 are Denavit and Hartenberg's: the parent's axes become the
/// body's by Rz(offset) Rx(alpha) Rz(theta), theta = theta0 + joint angle.
template <class T> struct body {
  joint_kind kind;           ///< of the joint; revolute for continuous ones, fixed for body 0
  int parent;                ///< body; −1 for body 0
  int q_index, v_index;      ///< where the joint's numbers begin in q and in v
  int nv;                    ///< how many it has in v
  int v_end;                 ///< where those of all joints that hang on this one end in v
  int angle_index;           ///< where in q the joint's rotation about z lies; −1: it has none
  int chain_start;           ///< first body of the unbroken run of revolute joints that ends here; this body for other kinds
  int pose_index;            ///< where what its joint moves of its pose begins in pose_workspace::moved
  int link;                  ///< the joint's child link; −1 for a ground without links
  bool has_children;         ///< does any other body hang on it
  bool is_base;              ///< are its axes those of the base: of the ground, and of a free body on it (base_axes.hpp)
  bool no_offset;            ///< is `offset` no turn at all, as for most bodies
  SE3<T> placement;          ///< of the joint in the parent's canonical frame: R = Rz(offset) Rx(alpha) where it has an axis
  plane_rotation<T> offset, alpha, theta0;
  T pitch;                   ///< advance along the axis, m/rad; of helical joints
};

/// From a body's canonical axes to those of a link of which one is the joint's axis: Rz, then a half turn about x where the
/// axis points the other way, then the numbers in the link's order.
template <class T> struct axis_permutation {
  plane_rotation<T> about_z;
  T sign;      ///< 1 or −1
  int slot[3]; ///< where in the link's order the three numbers come
};

/// A link and how it lies in its body.
template <class T> struct link {
  int body;
  int parent;                    ///< link on the other side of the joint that carries this one; −1 for the root
  bool carried_by_moving_joint;  ///< is it the child of its body's joint (body 0: the root), not welded to such a link
  bool axis_aligned;             ///< is the joint's axis one of the link's own, at the same origin
  axis_permutation<T> permutation; ///< if so
  SE3<T> pose;                   ///< of the link's frame in the body's canonical frame
  spatial_inertia<T> inertia;    ///< of this link alone, in the body's canonical frame
};

/// All arrays of a mechanism; bodies and links in topological order, parents first.
template <class T> struct model_view {
  int bodies, links; ///< how many, ground and root included
  int nq, nv;
  int pose_numbers;  ///< how many numbers pose_workspace::moved holds
  vec3<T> gravity;   ///< m/s², in world axes
  const ksl::body<T> *body;
  const ksl::link<T> *link;
  const T *inertia;                       ///< spatial_inertia of each body with all welded links (body_lanes.hpp)
  const T *theta0_sine, *theta0_cosine;   ///< of the joint that each number in q belongs to, padded as joint_angles
  int first_angle, angles_end;            ///< where in q the first angle of a joint lies, and where the last one ends
};

} // namespace ksl
