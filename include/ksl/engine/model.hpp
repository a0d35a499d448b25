// KSL: a mechanism as the algorithms see it: flat arrays, immutable after build, shared between threads.
//
// Links welded by fixed joints are one body.  Body 0 is the ground and all that is welded to it; body i > 0 hangs on
// joint i.  The frame of a body is *canonical*: at the joint's origin, z along the joint's axis, x normal to z and to
// the axis of the first joint on the body that isn't parallel (Denavit and Hartenberg's choice).  A floating body and the
// ground keep their links' axes.  Nothing a user sees is expressed in canonical frames.
#pragma once

#include "ksl/algebra.hpp"
#include "ksl/engine/joint.hpp"
#include "ksl/engine/plane_turn.hpp"

namespace ksl {

/// A body and the joint that carries it.
template <class T> struct body {
  joint_kind kind;             ///< of the joint; fixed for body 0
  int parent;                  ///< body; −1 for body 0
  int q_index, v_index;        ///< where the joint's numbers begin in q and in v
  int v_end;                   ///< where those of all joints that hang on this one end in v
  int chain;                   ///< first of the bodies up to this one whose joints turn, each on the body before; or this one
  int link;                    ///< the joint's child link; −1 for a ground without links
  SE3<T> placement;            ///< of the joint in the parent's canonical frame: R = Rz(before) Rx(lean), but if it floats
  plane_turn<T> before, lean;
  plane_turn<T> after;         ///< about z, from there to the canonical frame, at joint position zero
  bool straight;               ///< no turn `before`
  spatial_inertia<T> inertia;  ///< of all welded links, in the canonical frame
};

/// From a body's canonical axes to those of a link of which one is the joint's axis: Rz, then a half turn about x where the
/// axis points the other way, then the numbers in the link's order.
template <class T> struct link_turn {
  plane_turn<T> about_z;
  T sense;     ///< 1 or −1
  int slot[3]; ///< where in the link's order the three numbers come
};

/// A link and how it lies in its body.
template <class T> struct link {
  int body;
  int parent;                  ///< link on the other side of the joint that carries this one; −1 for the root
  bool first;                  ///< is it the child of the body's moving joint (body 0: the root), not welded to such a one
  bool along_axis;             ///< is the joint's axis one of this link's: are these all that differs from the canonical frame
  link_turn<T> turn;           ///< if so
  SE3<T> pose;                 ///< of the link's frame in the body's canonical frame
  spatial_inertia<T> inertia;  ///< of this link alone, in the body's canonical frame
};

/// All arrays of a mechanism; bodies and links in topological order, parents first.
template <class T> struct model_view {
  int bodies, links; ///< how many, ground and root included
  int nq, nv;
  vec3<T> gravity; ///< m/s², in world axes
  const ksl::body<T> *body;
  const ksl::link<T> *link;
  // again, side by side for lanes
  const T *inertia;                    ///< spatial_inertia of each body (body_lanes.hpp)
  const T *after_sine, *after_cosine;  ///< `after` of the joint that each number in q belongs to, padded as data.sine
  int first_angle, angles_end;         ///< where in q the first angle of a joint lies, and where the last one ends
};

} // namespace ksl
