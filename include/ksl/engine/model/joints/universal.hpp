// KSL: universal joint: two angles, rad.  The first is about an axis u₁ that is fixed on the parent's side, the second about an
// axis u₂ that is fixed in the child.  The angle between the axes is any but zero.
//
// In the model it is two bodies on revolute joints, the first of which has no mass.  Motion subspaces are then constant in their
// bodies, as algorithms need them: u₁ moves in the child.  No body has this kind.
#pragma once

#include "ksl/engine/model/joints/several_axes.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <> struct joint<joint_kind::universal> {
  static constexpr const char *name = "universal", *other_name = nullptr;
  static constexpr int nq = 2, nv = 2, angle = 0, quaternion = -1, pose_numbers = 0, usual_axis = 0;
  static constexpr bool has_axis = true, has_axis2 = true, has_pitch = false, has_limits = false, is_free = false;
  static constexpr bool in_urdf = false, velocity_is_rate = true;
  static constexpr position_number positions[] = {{"angle1", "rad"}, {"angle2", "rad"}};
  static constexpr velocity_number velocities[] = {{"angle1.v", "angle1.a", "angle1", "rad"},
                                                   {"angle2.v", "angle2.a", "angle2", "rad"}};
  static constexpr bool canonical_x = true, shifts_origin = false;

  template <class T> static void integrate(const T *q, const T *dv, T *out) { add_numbers<2>(q, dv, out); }
  template <class T> static void difference(const T *q0, const T *q1, T *dv) { subtract_numbers<2>(q1, q0, dv); }

  /// Moves what the drive of the first angle supplies from the constraint to the actuation part of a wrench, of which the latter
  /// is the moment about u₂.  Both drives then supply the part of the moment in the plane of the axes, and the structure carries
  /// the force and the moment normal to both.  All is in the canonical frame of the second body: z is u₂, and the normal
  /// (cos θ, −sin θ, 0) is the axis about which the parent's z is turned by alpha.
  template <class T>
  static KSL_LANES void move_first_drive(const plane_rotation<T> &theta, coscrew<T> &constraint,
                                         coscrew<T> &actuation) {
    const T normal = theta.cosine * constraint.ang.x - theta.sine * constraint.ang.y;
    const T across = theta.sine * constraint.ang.x + theta.cosine * constraint.ang.y;
    actuation.ang.x = across * theta.sine, actuation.ang.y = across * theta.cosine;
    constraint.ang.x = normal * theta.cosine, constraint.ang.y = -(normal * theta.sine);
  }
};

} // namespace KSL_ISA
} // namespace ksl
