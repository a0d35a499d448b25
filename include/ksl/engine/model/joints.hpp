// KSL: the list of all kinds of joints.  A new kind is a file in joints/, a value of joint_kind (joint.hpp), and three lines here: in
// the list of general_joint, in with_joint and in joint_kinds.  The compiler reports what is missing, members of its struct too.
#pragma once

#include "ksl/engine/model/joints/cylindrical.hpp"
#include "ksl/engine/model/joints/fixed.hpp"
#include "ksl/engine/model/joints/floating.hpp"
#include "ksl/engine/model/joints/general.hpp"
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
  J::integrate(q, q, out);                                           // q ⊕ dv
  J::difference(q, q, out);                                          // q1 ⊖ q0
};

/// Members that algorithms need of joints that move; one_axis.hpp explains each.
template <class J>
concept moving_joint =
    requires(const body<double> &b, const pose_workspace<double> &w, const double *q, double *out,
             const coscrew<double> &f, body_motion<double> &m, const per_body<mat3x3, double> &rotation,
             const spatial_inertia<double> &I, const mat3x3<double> &R) {
      { J::computed_pose(b, w, q) } -> std::same_as<decltype(J::kept_pose(b, w))>;
      { J::twist(b, q) } -> std::same_as<screw<double>>;
      J::effort(b, f, out);
      { J::drive(b, q) } -> std::same_as<coscrew<double>>;
      J::add_motion(b, q, q, m);
      J::add_steady_motion(b, rotation, 0, q, m);
      { J::column(coordinate_number<0>(), b, rotation, 0).effort(f) } -> std::same_as<double>;
      { J::column(coordinate_number<0>(), b, R).about(I.h) } -> std::same_as<screw<double>>;
      { J::momentum(coordinate_number<0>(), b, I) } -> std::same_as<coscrew<double>>;
    };

/// Members that the kinds have that move.
template <class J>
concept moving_kind = described_joint<J> && moving_joint<J> && requires(const double *q, double *out) {
  { J::coordinate[0] } -> std::convertible_to<int>; // of each number in v (column.hpp)
  J::integrate_jacobians(q, out, out, 1);
  J::difference_jacobians(q, out, out, 1);
};

/// Does such a joint only rotate about its axis?  Most joints do; algorithms have a fast path for them.
constexpr bool only_turns(joint_kind kind) { return kind == joint_kind::revolute || kind == joint_kind::continuous; }
inline constexpr joint_kind turning_kind = joint_kind::revolute; ///< how all of them move

/// Kinds for which algorithms have no code of their own.  They have that of general_joint.
// clang-format off
template <> struct joint<general_kind> : general_joint<
    joint_kind::helical,
    joint_kind::spherical,
    joint_kind::cylindrical,
    joint_kind::planar,
    joint_kind::translation> {};
// clang-format on

/// Do algorithms have code of its own for a kind?
constexpr bool has_own_code(joint_kind kind) {
  return only_turns(kind) || kind == joint_kind::prismatic || kind == joint_kind::floating;
}

/// How many coordinates the joint of a body has: a constant for kinds with their own code.  most_coordinates: the size of arrays for them.
template <joint_kind K, class S> KSL_LANES int coordinates(const body<S> &b) {
  if constexpr (K == general_kind)
    return b.nv;
  else
    return joint<K>::nv;
}
template <joint_kind K> constexpr int count_most_coordinates() {
  if constexpr (K == general_kind)
    return joint<K>::most_nv;
  else
    return joint<K>::nv;
}
template <joint_kind K> inline constexpr int most_coordinates = count_most_coordinates<K>();

/// Does the joint move the body's origin in its parent?
template <joint_kind K, class S> KSL_LANES bool shifts_origin(const body<S> &b) {
  if constexpr (K == general_kind)
    return joint<K>::row(b).shifts_origin;
  else
    return joint<K>::shifts_origin;
}

/// Calls step(k) for the coordinates of a body's joint, from the first to the last or back.  For kinds with their own code k is a constant,
/// and the loop is unrolled.
template <joint_kind K, class S, class Step> KSL_LANES void for_coordinates(const body<S> &b, Step step) {
  if constexpr (K != general_kind)
    for_each_coordinate<joint<K>::nv>(step);
  else
    for (int k = 0; k < b.nv; ++k)
      step(k);
}
template <joint_kind K, class S, class Step> KSL_LANES void for_coordinates_backwards(const body<S> &b, Step step) {
  if constexpr (K != general_kind)
    for_each_coordinate_backwards<joint<K>::nv>(step);
  else
    for (int k = b.nv - 1; k >= 0; --k)
      step(k);
}

/// Calls step.operator()<K>() for the kind of a body's joint, or for general_kind.  There is a branch with its own code for each, since
/// values that are merged after a switch are spilled (docs/decisions/0006-bodies-in-lanes.md).
template <class Step> KSL_LANES void by_slower_kind(joint_kind kind, Step step) {
  static_assert(moving_joint<joint<joint_kind::prismatic>> && moving_joint<joint<joint_kind::floating>> &&
                moving_joint<joint<general_kind>>);
  if (kind == joint_kind::prismatic)
    step.template operator()<joint_kind::prismatic>();
  else if (kind == joint_kind::floating)
    step.template operator()<joint_kind::floating>();
  else if (joint<general_kind>::includes(kind)) [[unlikely]]
    step.template operator()<general_kind>();
}
template <class Step> KSL_LANES void by_kind(joint_kind kind, Step step) {
  static_assert(moving_joint<joint<joint_kind::revolute>>);
  if (only_turns(kind)) [[likely]]
    step.template operator()<joint_kind::revolute>();
  else
    by_slower_kind(kind, step);
}

/// Calls a step with the code of each kind, for steps that general_joint does not know.  Kinds that move alike are distinguished if the kind is
/// the one that the description gives.
template <class Step> KSL_LANES void by_every_kind(joint_kind kind, Step step) {
  const auto of = [&]<joint_kind K>() KSL_INLINED {
    static_assert(moving_kind<joint<K>>);
    step.template operator()<K>();
  };
  if (kind == joint_kind::continuous)
    of.template operator()<joint_kind::continuous>();
  else if (joint<general_kind>::includes(kind))
    joint<general_kind>::by_kind(kind, of);
  else if (kind == joint_kind::prismatic)
    of.template operator()<joint_kind::prismatic>();
  else if (kind == joint_kind::floating)
    of.template operator()<joint_kind::floating>();
  else if (kind == joint_kind::revolute)
    of.template operator()<joint_kind::revolute>();
}

/// Calls a step with any kind that a user may name; step is called with a joint<K>.
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

// clang-format off: a line for each, as CONTRIBUTING.md's steps add one
inline constexpr joint_kind joint_kinds[] = {
    joint_kind::fixed,
    joint_kind::revolute,
    joint_kind::continuous,
    joint_kind::prismatic,
    joint_kind::helical,
    joint_kind::cylindrical,
    joint_kind::universal,
    joint_kind::spherical,
    joint_kind::planar,
    joint_kind::translation,
    joint_kind::floating};
// clang-format on

static_assert(
    [] {
      for (joint_kind kind : joint_kinds) // a universal joint is two bodies on revolute joints, a fixed one is none
        if (kind != joint_kind::fixed && kind != joint_kind::universal && !has_own_code(kind) &&
            !joint<general_kind>::includes(kind))
          return false;
      return true;
    }(),
    "a kind of joint is missing in general_joint's list");

/// The properties of a kind.
constexpr joint_kind_row row_of(joint_kind kind) {
  return with_joint(kind, [kind]<class J>(J) -> joint_kind_row {
    static_assert(described_joint<J>);
    // NOLINTBEGIN(bugprone-sizeof-expression): arrays, but for fixed joints
    static_assert(J::nq == 0 || sizeof J::positions == J::nq * sizeof(position_number),
                  "a name and a unit for each number of q");
    static_assert(J::nv == 0 || sizeof J::velocities == J::nv * sizeof(velocity_number),
                  "names and a unit for each number of v");
    // NOLINTEND(bugprone-sizeof-expression)
    return {kind,           J::name,       J::other_name, J::nq,         J::nv,           J::has_axis,
            J::has_axis2,   J::has_pitch,  J::has_limits, J::is_free,    J::in_urdf,      J::velocity_is_rate,
            J::canonical_x, J::usual_axis, J::angle,      J::quaternion, J::pose_numbers, J::positions,
            J::velocities};
  });
}

} // namespace KSL_ISA
} // namespace ksl

#pragma GCC diagnostic pop
