// What one force element does at one state, over any scalar.
#pragma once

#include "engine/model/vectors.hpp"
#include "ksl/engine/lanes/of_precision.hpp"
#include "ksl/engine/model/description.hpp"

#include <cmath>
#include <limits>

namespace ksl::elements {

using vectors::cross;
using vectors::dot;
using vectors::scaled;
using vectors::sum;

/// Why an element has no force.
enum class fault : unsigned char { none, coincide, below, above };

/// What forces of states in S are computed in.
template <class S> struct computed_in { using type = S; };
template <> struct computed_in<float> { using type = double; };

/// What elements do at one state.
template <class R> struct element_state {
  R why;                ///< a number of `fault`
  vec3<R> arm1, arm2;   ///< from the links' origins to the points, in world axes
  vec3<R> apart, rate;  ///< p₂ − p₁ and its rate
  vec3<R> lost;         ///< what rounding has taken from p₂ − p₁, in single precision
  vec3<R> u;            ///< zero where the points coincide
  R length, speed;      ///< l and dl/dt
  R tension;            ///< NaN where there is none
  R density;            ///< tension / length
  R stiffness;          ///< ∂f/∂l
  R elastic, potential; ///< what of the tension has a potential, and this

  fault found() const { return static_cast<fault>(static_cast<int>(why)); }
};

/// A spring of no free length, and nothing else: its force is stiffness (p₂ − p₁), with or without a direction.
inline bool is_linear(const force_element_numbers &x) {
  return x.free_length == 0 && x.preload == 0 && x.damping == 0 && !x.lower && !x.upper;
}

/// A number of `fault`.  near: up to this length the points coincide.  rounding: relative, of positions.
template <class R> R fault_of(const force_element_numbers &x, const R &length, const R &near, double rounding) {
  const double share = std::fmax(1e-9, rounding);
  R why(static_cast<int>(fault::none));
  if (x.stop_stiffness == 0 && x.upper)
    why = math<R>::select(length > R(*x.upper * (1 + share)), R(static_cast<int>(fault::above)), why);
  if (x.stop_stiffness == 0 && x.lower)
    why = math<R>::select(length < R(*x.lower * (1 - share)), R(static_cast<int>(fault::below)), why);
  return is_linear(x) ? why : math<R>::select(length <= near, R(static_cast<int>(fault::coincide)), why);
}

/// Is all of it in single precision?  The engine's own forces are in double.
template <class R> bool is_single() { return static_cast<bool>(of_precision<R>(0, 1) == R(1)); }

/// What rounding has taken from a + b (Knuth, The Art of Computer Programming 2, section 4.2.2).
template <class R> R lost_in(const R &a, const R &b) {
  const R all = a + b, of_b = all - a;
  return (a - (all - of_b)) + (b - of_b);
}
template <class R> vec3<R> lost_in(const vec3<R> &a, const vec3<R> &b) {
  return {lost_in(a.x, b.x), lost_in(a.y, b.y), lost_in(a.z, b.z)};
}

/// What rounding has taken from the length, of which differences with other lengths are left.  After u.
template <class R> R rest_of_length(const element_state<R> &e) {
  return is_single<R>() ? algebra<R>::angle_rest(&e.apart, e.length) + dot(e.u, e.lost) : R(0);
}

/// Sets what follows from apart, rate and the arms; reach: how far the points are from the world's origin.
///
///     f │              ╱     k + k_stop, beyond `upper`         Without the preload f is zero at l = l₀.  Stops without a stiffness are not
///       │        _..··       k, between the limits              there: an element beyond them has no force (fault_of).
///       │   _..··
///       │  ╱                 k + k_stop, below `lower`
///       └──┴─────────┴─── l
template <class R>
void evaluate(const force_element_numbers &x, const R &reach, double rounding, element_state<R> &e) {
  const R zero(0), near = R(rounding) * reach;
  e.length = vectors::length(e.apart);
  e.why = fault_of(x, e.length, near, rounding);
  const auto unless_near = [&](const R &there, const R &otherwise) {
    return math<R>::select(e.length <= near, otherwise, there);
  };
  const vec3<R> along = scaled(R(1) / e.length, e.apart);
  e.u = {unless_near(along.x, zero), unless_near(along.y, zero), unless_near(along.z, zero)};
  e.speed = dot(e.u, e.rate);
  const auto longer_than = [&, rest = unless_near(rest_of_length(e), zero)](double length) {
    return is_single<R>() ? (e.length - R(length)) + rest : e.length - R(length);
  };
  R beyond = zero;
  if (x.lower)
    beyond = math<R>::select(e.length < R(*x.lower), longer_than(*x.lower), beyond);
  if (x.upper)
    beyond = math<R>::select(e.length > R(*x.upper), longer_than(*x.upper), beyond);
  // f = preload + k (l − l₀) + k_stop (l − limit, beyond it) + damping dl/dt, of which all but the last has a potential, its integral over l.
  // density = f / l: the force on point 1 is density (p₂ − p₁), which a spring of no free length has where its points coincide, too.
  const R stretch = longer_than(x.free_length), k(x.stiffness), of_stops(x.stop_stiffness);
  e.elastic = R(x.preload) + k * stretch + of_stops * beyond;
  e.stiffness = k + math<R>::select(beyond == zero, zero, of_stops);
  e.potential = R(x.preload) * stretch + k * stretch * stretch / R(2) + of_stops * beyond * beyond / R(2);
  e.tension = e.elastic + R(x.damping) * e.speed;
  e.density = unless_near(e.tension / e.length, k);
  const auto is_there = e.why == zero;
  for (R *number : {&e.tension, &e.density, &e.elastic, &e.potential})
    *number = math<R>::select(is_there, *number, R(std::numeric_limits<double>::quiet_NaN()));
}

} // namespace ksl::elements
