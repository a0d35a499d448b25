// KSL: a mechanism as the algorithms see it: flat arrays, immutable once built, shared between threads.
//
// Links welded by fixed joints are one body.  Body 0 is the ground with all links welded to it; joint i carries body i > 0.
// Bodies are numbered depth first: parents come before their children, and the bodies of a subtree follow each other, as do their
// joints' numbers in q and v.
//
// The frame of a body is *canonical*: its origin is the joint's, z is along the joint's axis, and x is normal to z and to the
// axis of the first joint on the body that isn't parallel to z (Denavit and Hartenberg's choice).  The ground, and bodies whose
// joints have no axis, keep the axes of their links.  Nothing that a user sees is expressed in canonical frames.
//
// A *line* is a sequence of bodies i, i + 1, … that move, each of which is the parent of the next.  The coordinates of its joints
// follow each other in v, so that loops over the bodies that carry a body go line by line, and within a line by increments.
#pragma once

#include "ksl/algebra.hpp"
#include "ksl/engine/model/joint.hpp"
#include "ksl/engine/model/plane_rotation.hpp"

namespace ksl {

template <class T> struct loop_view;

/// A body and the joint that carries it.  offset, alpha and theta0 are Denavit and Hartenberg's: the parent's axes become the
/// body's by Rz(offset) Rx(alpha) Rz(theta), theta = theta0 + joint angle.
template <class T> struct body {
  joint_kind kind;      ///< of the joint, as it moves: revolute for continuous ones; fixed for body 0
  joint_kind described; ///< of the joint, as the description gives it
  int parent;           ///< body; −1 for body 0
  int q_index, v_index; ///< where the joint's numbers begin in q and in v, those of followers included
  int nv;               ///< how many it has in v
  int v_end;            ///< where the numbers of all joints of the subtree end in v
  int angle_index;      ///< index in q of the joint's rotation about z; −1: it has none
  int chain_start;      ///< first body of the part of its line that has revolute joints only and ends here
  int line_start;       ///< first body of the longest line that ends here
  int ancestors;        ///< how many coordinates in v belong to the joints that carry this one
  int pose_index;       ///< where its numbers begin in pose_workspace::moved: those of its pose that depend on q
  int link;             ///< the joint's child link; −1 for a ground without links, and inside a universal joint
  bool follows;         ///< does its joint follow another one: a mimic joint
  bool has_children;    ///< does it carry other bodies
  bool ends_universal;  ///< is its joint the second of a universal one, and its parent the massless body inside
  bool is_base;         ///< is it the base: the ground, or a body that floats on it (base_axes.hpp)
  bool no_offset;       ///< is `offset` the identity, as for most bodies
  int last_branch; ///< the last of the bodies that it carries, if that isn't the one after it; 0: it is, or there is none
  SE3<T> placement; ///< of the joint in the parent's canonical frame: R = Rz(offset) Rx(alpha) where it has an axis
  plane_rotation<T> offset, alpha, theta0;
  tensor_rotation<T> alpha_of_tensor; ///< alpha, for symmetric matrices
  T pitch;                            ///< advance along the axis, m/rad; of helical joints
};

/// Leads from a body's canonical axes to those of a link, if one of the link's coordinate axes is the joint's axis, in either
/// direction.  It rotates about z, then by half a turn about x if the directions are opposite, and then lists the three numbers in
/// the order of the link's axes.
template <class T> struct axis_permutation {
  plane_rotation<T> about_z;
  T sign;      ///< 1 or −1
  int slot[3]; ///< positions of the three numbers in the link's order
};

/// A link and its pose in its body.
template <class T> struct link {
  int body;
  int parent;                   ///< link on the other side of the joint that carries this one; −1 for the root
  bool carried_by_moving_joint; ///< is it the child of its body's joint (body 0: the root), not welded to such a link
  bool axis_aligned;            ///< is the joint's axis one of the link's own, at the same origin
  axis_permutation<T> permutation; ///< valid if axis_aligned
  SE3<T> pose;                     ///< of the link's frame in the body's canonical frame
  spatial_inertia<T> inertia;      ///< of this link alone, in the body's canonical frame
};

/// What a motor supplies at one coordinate besides the transmitted effort (joint_physics.hpp).  SI units, of the joint's side.
template <class T> struct coordinate_physics {
  T armature;                 ///< inertia of the rotor as the coordinate feels it, kg m² or kg
  T damping;                  ///< N m s/rad or N s/m
  T friction, friction_width; ///< N m or N; rad/s or m/s
  T stiffness, rest;          ///< of a spring, N m/rad or N/m, and the position where it is slack
  int q_index;                ///< where the coordinate's position is in q, if it has a spring
  bool is_rotor;              ///< does it move a rotor, which is a body; what it transmits is then the rotor's part
};

/// All arrays of a mechanism; bodies and links in topological order, parents first.
template <class T> struct model_view {
  int bodies, links; ///< how many, ground and root included
  int nq, nv;
  int pose_numbers; ///< how many numbers pose_workspace::moved holds
  int longest_path; ///< the largest number of coordinates in v on a path from the ground to a body
  int tree_elements; ///< number of elements of a symmetric matrix that the shape of the tree lets differ from zero (tree_rows.hpp)
  vec3<T> gravity; ///< m/s², in world axes
  const ksl::body<T> *body;
  const ksl::link<T> *link;
  const T *inertia;                    ///< spatial_inertia of each body with all welded links (body_lanes.hpp)
  const spatial_inertia<T> *augmented; ///< augmented inertia of each body (subtree_inertia.hpp)
  /// body::theta0 for each number in q that is an angle, 0 and 1 for others; padded as
  /// pose_workspace::sine
  const T *theta0_sine, *theta0_cosine;
  const int *tree_row;         ///< (nv + 1) index of the first element of each row in compressed_rows (tree_rows.hpp)
  int first_angle, angles_end; ///< the range of indices in q that contains all joint angles
  const T *lower, *upper;      ///< limits of the numbers in q; infinite where there are none
  const coordinate_physics<T> *physics; ///< (nv), or null: a motor supplies the transmitted effort
  const loop_view<T> *loops;            ///< null: a tree, or loops without a plan (loop_view.hpp)
};

} // namespace ksl
