// KSL: the list of all kinds of joints.  A new kind is a file in joints/, a value of joint_kind (joint.hpp), and a line in each of
// the two functions here; the compiler reports the members that its struct lacks.
#pragma once

#include "ksl/engine/model/joints/cylindrical.hpp"
#include "ksl/engine/model/joints/fixed.hpp"
#include "ksl/engine/model/joints/floating.hpp"
#include "ksl/engine/model/joints/helical.hpp"
#include "ksl/engine/model/joints/planar.hpp"
#include "ksl/engine/model/joints/prismatic.hpp"
#include "ksl/engine/model/joints/revolute.hpp"
#include "ksl/engine/model/joints/spherical.hpp"
#include "ksl/engine/model/joints/translation.hpp"
#include "ksl/engine/model/joints/universal.hpp"

#include <concepts>

#pragma GCC diagnostic push
#pragma GCC diagnostic error "-Wswitch"

namespace ksl {
inline namespace KSL_ISA {

/// Members that the struct of every kind has; joint_kind_row explains the constants.
template <class J>
concept described_joint = requires(const double *q, double *out) {
  { J::name } -> std::convertible_to<const char *>;
  { J::other_name } -> std::convertible_to<const char *>;
  { J::nq } -> std::convertible_to<int>;
  { J::nv } -> std::convertible_to<int>;
  { J::has_axis } -> std::convertible_to<bool>;
  { J::has_axis2 } -> std::convertible_to<bool>;
  { J::has_pitch } -> std::convertible_to<bool>;
  { J::has_limits } -> std::convertible_to<bool>;
  { J::is_free } -> std::convertible_to<bool>;
  { J::in_urdf } -> std::convertible_to<bool>;
  { J::velocity_is_rate } -> std::convertible_to<bool>;
  { J::shifts_origin } -> std::convertible_to<bool>; // does the joint move the body's origin in its parent
  { J::canonical_x } -> std::convertible_to<bool>;
  { J::usual_axis } -> std::convertible_to<int>;
  { J::angle } -> std::convertible_to<int>;
  { J::quaternion } -> std::convertible_to<int>;
  { J::pose_numbers } -> std::convertible_to<int>;
  { J::positions } -> std::convertible_to<const position_number *>;  // (nq)
  { J::velocities } -> std::convertible_to<const velocity_number *>; // (nv)
  J::integrate(q, q, out);  // q ⊕ dv
  J::difference(q, q, out); // q1 ⊖ q0
};

/// Members that the algorithms need of kinds that move; one_axis.hpp explains each.
template <class J>
concept moving_joint = described_joint<J> &&
    requires(const body<double> &b, const pose_workspace<double> &w, const double *q, double *out,
             const coscrew<double> &f, body_motion<double> &m, const per_body<mat3x3, double> &rotation,
             const spatial_inertia<double> &I, const mat3x3<double> &R) {
  { J::computed_pose(b, w, q) } -> std::same_as<decltype(J::kept_pose(b, w))>;
  { J::twist(b, q) } -> std::same_as<screw<double>>;
  J::effort(b, f, out);
  { J::drive(q) } -> std::same_as<coscrew<double>>;
  J::add_motion(b, q, q, m);
  J::add_steady_motion(b, rotation, 0, q, m);
  { J::template column<0>(b, rotation, 0).effort(f) } -> std::same_as<double>;
  { J::template column<0>(b, R).about(I.h) } -> std::same_as<screw<double>>;
  { J::template momentum<0>(b, I) } -> std::same_as<coscrew<double>>;
  J::integrate_jacobians(q, out, out, 1);
  J::difference_jacobians(q, out, out, 1);
};

/// Does such a joint only rotate about its axis?  Most joints do; algorithms have a fast path for them.
constexpr bool only_turns(joint_kind kind) { return kind == joint_kind::revolute || kind == joint_kind::continuous; }
inline constexpr joint_kind turning_kind = joint_kind::revolute; ///< how all of them move

/// Calls step.operator()<K>() for the kind of a body's joint.  There is a branch with its own code for each kind, since values
/// that are merged after a switch are spilled (docs/decisions/0006-bodies-in-lanes.md).
template <class Step> KSL_LANES void by_slower_kind(joint_kind kind, Step step) {
  const auto of = [&]<joint_kind K>() KSL_INLINED {
    static_assert(moving_joint<joint<K>>);
    step.template operator()<K>();
  };
  switch (kind) {
  case joint_kind::prismatic: return of.template operator()<joint_kind::prismatic>();
  case joint_kind::helical: return of.template operator()<joint_kind::helical>();
  case joint_kind::spherical: return of.template operator()<joint_kind::spherical>();
  case joint_kind::cylindrical: return of.template operator()<joint_kind::cylindrical>();
  case joint_kind::planar: return of.template operator()<joint_kind::planar>();
  case joint_kind::translation: return of.template operator()<joint_kind::translation>();
  case joint_kind::floating: return of.template operator()<joint_kind::floating>();
  case joint_kind::fixed: // no body has such a joint
  case joint_kind::universal:
  case joint_kind::revolute:
  case joint_kind::continuous: return;
  }
}
template <class Step> KSL_LANES void by_kind(joint_kind kind, Step step) {
  static_assert(moving_joint<joint<joint_kind::revolute>>);
  if (only_turns(kind))
    step.template operator()<joint_kind::revolute>();
  else
    by_slower_kind(kind, step);
}

/// The same for steps that distinguish kinds which move alike, by the kind that the description gives.
template <class Step> KSL_LANES void by_described_kind(joint_kind described, Step step) {
  if (described == joint_kind::continuous)
    step.template operator()<joint_kind::continuous>();
  else
    by_kind(described, step);
}

/// The same for any kind that a user may name; step is called with a joint<K>.
template <class Step> constexpr auto with_joint(joint_kind kind, Step step) {
  switch (kind) {
  case joint_kind::fixed: return step(joint<joint_kind::fixed>());
  case joint_kind::revolute: return step(joint<joint_kind::revolute>());
  case joint_kind::continuous: return step(joint<joint_kind::continuous>());
  case joint_kind::prismatic: return step(joint<joint_kind::prismatic>());
  case joint_kind::helical: return step(joint<joint_kind::helical>());
  case joint_kind::spherical: return step(joint<joint_kind::spherical>());
  case joint_kind::cylindrical: return step(joint<joint_kind::cylindrical>());
  case joint_kind::universal: return step(joint<joint_kind::universal>());
  case joint_kind::planar: return step(joint<joint_kind::planar>());
  case joint_kind::translation: return step(joint<joint_kind::translation>());
  case joint_kind::floating: return step(joint<joint_kind::floating>());
  }
  __builtin_unreachable();
}

inline constexpr joint_kind joint_kinds[] = {
    joint_kind::fixed,       joint_kind::revolute,  joint_kind::continuous, joint_kind::prismatic, joint_kind::helical,
    joint_kind::cylindrical, joint_kind::universal, joint_kind::spherical,  joint_kind::planar,    joint_kind::translation,
    joint_kind::floating};

/// The properties of a kind.
constexpr joint_kind_row row_of(joint_kind kind) {
  return with_joint(kind, [kind]<class J>(J) -> joint_kind_row {
    static_assert(described_joint<J>);
    static_assert(J::nq == 0 || sizeof J::positions == J::nq * sizeof(position_number), "a name and a unit for each number of q");
    static_assert(J::nv == 0 || sizeof J::velocities == J::nv * sizeof(velocity_number), "names and a unit for each number of v");
    return {kind, J::name, J::other_name, J::nq, J::nv, J::has_axis, J::has_axis2, J::has_pitch, J::has_limits, J::is_free,
            J::in_urdf, J::velocity_is_rate, J::canonical_x, J::usual_axis, J::angle, J::quaternion, J::pose_numbers, J::positions,
            J::velocities};
  });
}

} // namespace KSL_ISA
} // namespace ksl

#pragma GCC diagnostic pop
