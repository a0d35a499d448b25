// KSL: the workspace of one computation, the only thing that changes.  Allocated once (ksl::data); no algorithm
// allocates.  One thread, one workspace.
#pragma once

#include "ksl/engine/model.hpp"

namespace ksl {

/// What inverse dynamics leaves behind for each body; vectors in the body's canonical frame.
template <class T> struct body_state {
  SE3<T> in_parent;       ///< pose in the parent's frame
  vec3<T> angular_velocity, angular_acceleration;
  vec3<T> acceleration;   ///< classical, of the frame's origin, minus gravity
  coscrew<T> wrench;      ///< that the parent exerts through the joint, about the frame's origin
};

/// What forward dynamics keeps for each body, in its canonical frame (Featherstone, RBDA (2008), section 7.3).
template <class T> struct articulated_state {
  articulated_inertia<T> inertia; ///< A
  coscrew<T> wrench;              ///< bias wrench p
  screw<T> bias;                  ///< c = v × S q̇
  coscrew<T> column;              ///< U = A S; of joints with one coordinate
  T inverse;                      ///< 1 / (Sᵀ U)
  T effort;                       ///< u = τ − Sᵀ p
  screw<T> acceleration;          ///< minus gravity
};

/// Arrays over bodies, coordinates or links; each algorithm says which of them it leaves filled.
template <class T> struct data_view {
  body_state<T> *body;
  T *sine, *cosine;                ///< of each number in q, padded to `padded(nq)`
  SE3<T> *in_world;                ///< pose of each body
  SE3<T> *in_base;                 ///< the same in the frame of the base: the ground, or the floating root
  screw<T> *twist;                 ///< of each body, in its frame
  screw<T> *unit_twist;            ///< for each number in v, in the frame of the base
  spatial_inertia<T> *composite;   ///< of each body and all that hangs on it, in the frame of the base
  articulated_state<T> *articulated;
  coscrew<T> *link_wrench;         ///< through the joint that carries each link, in its body's frame
};

inline namespace KSL_ISA {

/// Room for n numbers in whole registers of any instruction set.
constexpr int padded(int n) { return (n + 15) / 16 * 16; }

} // namespace KSL_ISA

/// Wrenches that the environment exerts on links: linear first, at the link's origin, in the link's axes.
template <class T> struct external_wrenches {
  int n = 0;
  const int *link = nullptr;  ///< (n)
  const T *wrench = nullptr;  ///< (n, 6)
};

} // namespace ksl
