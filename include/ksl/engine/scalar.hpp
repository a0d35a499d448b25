// KSL: what the engine asks of the scalar T that an algorithm is instantiated with.
//
// There are three kinds.  Plain numbers, double and float: the bodies of one state may lie in lanes.  Packs of them: a state
// in each lane.  Any other type that meets the concept below, for example dual<n> (ksl/dual.hpp), or a type that counts or
// records operations: bodies come one after the other.  docs/scalars.md shows how to write one.
#pragma once

#include "ksl/pack.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Is T a plain number?  Then bodies can lie in lanes.
template <class T> inline constexpr bool is_number = false;
template <class T> inline constexpr bool is_number<const T> = is_number<T>;
template <> inline constexpr bool is_number<double> = true;
template <> inline constexpr bool is_number<float> = true;

template <class T> inline constexpr bool is_pack = false;
template <class T, int W> inline constexpr bool is_pack<pack<T, W>> = true;

/// + − × ÷, and constants: from the numbers that models hold (scalar_of_trait says which), and from literals.
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

/// What a comparison gives is the type's own choice: a bool, a mask, a recorded condition.  Choices are made by select.
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
  T(math<T>::sqrt(math<T>::epsilon)); // a number that becomes T by itself, or a T
  T(math<T>::fabs(a));
  T(math<T>::sqrt(a));
  T(math<T>::sin(a));
  T(math<T>::cos(a));
  T(math<T>::atan2(a, b));
};

/// math<T>::sine_cosine(angle, sine, cosine).  KSL's own kernel is for plain numbers and packs only: it rounds to integers by
/// adding a large number, which another scalar would differentiate or record away.
template <class T>
concept has_sine_cosine = is_number<T> || is_pack<T> || requires(const T &angle, T &sine, T &cosine) {
  math<T>::sine_cosine(angle, sine, cosine);
};

/// A type that every algorithm of the engine accepts.  Objects are copied as their bytes are in arrays of structs, so a scalar
/// can be default constructed and copied, and has no alignment beyond its members'.
template <class T>
concept scalar = has_arithmetic<T> && has_choice<T> && has_functions<T> && has_sine_cosine<T>;

} // namespace KSL_ISA
} // namespace ksl
