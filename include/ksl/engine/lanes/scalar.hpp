// KSL: the requirements on the scalar T that an algorithm is instantiated with.
//
// There are three kinds of scalars:
// - plain numbers, double and float.  Several bodies of one state may be computed in lanes.
// - packs of plain numbers, with a state in each lane.
// - any other type that meets the concept below, for example dual<n> (ksl/dual.hpp), or a type that counts or records
//   operations.  Bodies are computed one after the other.  docs/scalars.md shows how to write such a type.
#pragma once

#include "ksl/pack.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Is T a plain number?  Then several bodies can be computed in lanes.
template <class T> inline constexpr bool is_number = false;
template <class T> inline constexpr bool is_number<const T> = is_number<T>;
template <> inline constexpr bool is_number<double> = true;
template <> inline constexpr bool is_number<float> = true;

template <class T> inline constexpr bool is_pack = false;
template <class T, int W> inline constexpr bool is_pack<pack<T, W>> = true;

/// Is T a pack of states of 32 bytes at most?  Steps that wait for another body then gain by standing beside steps that don't.  With larger
/// registers they don't gain (docs/decisions/0019-speed-everywhere.md).
template <class T> inline constexpr bool in_narrow_lanes = is_pack<T> && sizeof(T) <= 32;

/// The operators + − × ÷, and constants made from the numbers that models hold (see scalar_of_trait) and from literals.
template <class T>
concept has_arithmetic = requires(const T &a, const T &b, const scalar_of<T> &number) {
  T(number);
  T(0);
  T(0.5);
  T(a + b);
  T(a - b);
  T(a * b);
  T(a / b);
  T(-a);
};

/// Comparisons.  Their result may be of any type: a bool, a mask, a recorded condition.  It is only passed to select.
template <class T>
concept has_choice = requires(const T &a, const T &b) {
  T(math<T>::select(a < b, a, b));
  T(math<T>::select(a <= b, a, b));
  T(math<T>::select(a > b, a, b));
  T(math<T>::select(a == b, a, b));
};

/// The algebra's functions: math<T> specialised.
template <class T>
concept has_functions = requires(const T &a, const T &b) {
  T(math<T>::sqrt(math<T>::epsilon)); // a T, or a number that converts to T
  T(math<T>::fabs(a));
  T(math<T>::sqrt(a));
  T(math<T>::sin(a));
  T(math<T>::cos(a));
  T(math<T>::atan2(a, b));
};

/// math<T>::sine_cosine(angle, sine, cosine).  KSL's own kernel is for plain numbers and packs only: it rounds to integers by
/// adding and subtracting a large number, which fails for scalars that differentiate or record operations.
template <class T>
concept has_sine_cosine = is_number<T> || is_pack<T> ||
                          requires(const T &angle, T &sine, T &cosine) { math<T>::sine_cosine(angle, sine, cosine); };

/// A type that every algorithm of the engine accepts.  Structs of scalars are read and written as arrays of scalars, so a scalar
/// must be default constructible and copyable, and must have no alignment beyond that of its members.
template <class T>
concept scalar = has_arithmetic<T> && has_choice<T> && has_functions<T> && has_sine_cosine<T>;

} // namespace KSL_ISA
} // namespace ksl
