// KSL: what mutated code calls.  It is included before every file of a mutated build.
//
// All mutants of a build are compiled at once.  The one whose number is in ksl_mutant is active; 0 is none.  A mutated
// expression passes its operands and its number here, and gets the result of the active variant.  Evaluation by the
// compiler (constant expressions) is never mutated.
#pragma once

#if __cplusplus >= 202002L // not where CMake tries the compiler
#include <type_traits>

extern "C" {
extern int ksl_mutant;
extern unsigned char ksl_mutant_reached[]; ///< by number: was the expression evaluated where its mutant would differ?
}

namespace ksl_mutate {

constexpr bool on(int id) {
  if (__builtin_is_constant_evaluated())
    return false;
  ksl_mutant_reached[id] = 1;
  return ksl_mutant == id;
}

template <class A> inline constexpr bool whole =
    std::is_integral_v<std::remove_cvref_t<A>> && !std::is_same_v<std::remove_cvref_t<A>, bool>;

// Sums of integers are indices, mostly: the mutant leaves out the second operand, which stays within the array.
// Sums of pointers likewise.  Of numbers it changes the sign.
template <class A, class B> constexpr auto add(int id, const A &a, const B &b) -> std::remove_cvref_t<decltype(a + b)> {
  using R = std::remove_cvref_t<decltype(a + b)>;
  if constexpr (std::is_pointer_v<std::decay_t<A>> || (whole<A> && whole<B>)) {
    if (on(id))
      return static_cast<R>(a);
  } else if constexpr (std::is_pointer_v<std::decay_t<B>>) {
    if (on(id))
      return static_cast<R>(b);
  } else if constexpr (requires { R(a - b); }) {
    if (on(id))
      return R(a - b);
  }
  return a + b;
}
template <class A, class B> constexpr auto subtract(int id, const A &a, const B &b)
    -> std::remove_cvref_t<decltype(a - b)> {
  using R = std::remove_cvref_t<decltype(a - b)>;
  if constexpr (whole<A> && whole<B>) {
    if (on(id))
      return static_cast<R>(a);
  } else if constexpr (std::is_pointer_v<std::decay_t<A>> && whole<B>) {
    if (on(id))
      return a;
  } else if constexpr (std::is_pointer_v<std::decay_t<A>> && std::is_pointer_v<std::decay_t<B>>) {
    if (on(id)) // there is no sum of two
      return R();
  } else if constexpr (requires { R(a + b); }) {
    if (on(id))
      return R(a + b);
  }
  return a - b;
}
template <class A, class B> constexpr auto multiply(int id, const A &a, const B &b)
    -> std::remove_cvref_t<decltype(a * b)> {
  using R = std::remove_cvref_t<decltype(a * b)>;
  if constexpr (whole<A> && whole<B>) {
    if (on(id))
      return static_cast<R>(a);
  } else if constexpr (requires { R(a / b); }) {
    if (on(id))
      return R(a / b);
  }
  return a * b;
}
template <class A, class B> constexpr auto divide(int id, const A &a, const B &b)
    -> std::remove_cvref_t<decltype(a / b)> {
  using R = std::remove_cvref_t<decltype(a / b)>;
  if constexpr (whole<A> && whole<B>) {
    if (on(id))
      return static_cast<R>(a);
  } else if constexpr (requires { R(a * b); }) {
    if (on(id))
      return R(a * b);
  }
  return a / b;
}
template <class A, class B> constexpr auto remainder(int id, const A &a, const B &b)
    -> std::remove_cvref_t<decltype(a % b)> {
  if (on(id))
    return a / b;
  return a % b;
}
template <class A> constexpr auto negative(int id, const A &a) -> std::remove_cvref_t<decltype(-a)> {
  if (on(id))
    return a;
  return -a;
}

// Comparisons have two mutants: number `id` is the opposite, and id + 1 moves the boundary.  Moving it between numbers
// that are not integers is no change that a test could notice.
#define KSL_COMPARISON(name, op, opposite, moved)                                                                      \
  template <class A, class B>                                                                                          \
  constexpr auto name(int id, const A &a, const B &b) -> std::remove_cvref_t<decltype(a op b)> {                       \
    if constexpr (requires { a opposite b; })                                                                          \
      if (on(id))                                                                                                      \
        return a opposite b;                                                                                           \
    if constexpr (whole<A> && whole<B>)                                                                                \
      if (on(id + 1))                                                                                                  \
        return a moved b;                                                                                              \
    return a op b;                                                                                                     \
  }
KSL_COMPARISON(less, <, >=, <=)
KSL_COMPARISON(greater, >, <=, >=)
KSL_COMPARISON(at_most, <=, >, <)
KSL_COMPARISON(at_least, >=, <, >)
#undef KSL_COMPARISON
template <class A, class B> constexpr auto equal(int id, const A &a, const B &b)
    -> std::remove_cvref_t<decltype(a == b)> {
  if constexpr (requires { a != b; })
    if (on(id))
      return a != b;
  return a == b;
}
template <class A, class B> constexpr auto unequal(int id, const A &a, const B &b)
    -> std::remove_cvref_t<decltype(a != b)> {
  if constexpr (requires { a == b; })
    if (on(id))
      return a == b;
  return a != b;
}

// In the condition of a loop: the last pass is left out.  The opposite would never enter it or never leave it.
template <class A, class B> constexpr bool loop_less(int id, const A &a, const B &b) {
  if constexpr (whole<A> && whole<B>)
    if (on(id))
      return a < b && a + 1 < b;
  return a < b;
}
template <class A, class B> constexpr bool loop_at_most(int id, const A &a, const B &b) {
  if constexpr (whole<A> && whole<B>)
    if (on(id))
      return a < b;
  return a <= b;
}
template <class A, class B> constexpr bool loop_greater(int id, const A &a, const B &b) {
  if constexpr (whole<A> && whole<B>)
    if (on(id))
      return a > b && a - 1 > b;
  return a > b;
}
template <class A, class B> constexpr bool loop_at_least(int id, const A &a, const B &b) {
  if constexpr (whole<A> && whole<B>)
    if (on(id))
      return a > b;
  return a >= b;
}

/// a && b is flip(flip(a) || flip(b)), without evaluating b where it isn't to be.
constexpr bool flip(int id, bool x) { return on(id) != x; }

template <class I> constexpr auto index(int id, const I &i) {
  if constexpr (whole<I>) {
    return on(id) ? I(0) : i;
  } else {
    return i;
  }
}

#define KSL_ASSIGNMENT(name, op, other)                                                                                \
  template <class A, class B> constexpr A &name(int id, A &&a, const B &b) = delete;                                   \
  template <class A, class B> constexpr A &name(int id, A &a, const B &b) {                                            \
    if constexpr (whole<A>) {                                                                                          \
      if (on(id))                                                                                                      \
        return a;                                                                                                      \
    } else if constexpr (requires { a other b; }) {                                                                    \
      if (on(id)) {                                                                                                    \
        a other b;                                                                                                     \
        return a;                                                                                                      \
      }                                                                                                                \
    }                                                                                                                  \
    a op b;                                                                                                            \
    return a;                                                                                                          \
  }
KSL_ASSIGNMENT(add_assign, +=, -=)
KSL_ASSIGNMENT(subtract_assign, -=, +=)
KSL_ASSIGNMENT(multiply_assign, *=, /=)
KSL_ASSIGNMENT(divide_assign, /=, *=)
#undef KSL_ASSIGNMENT
// of truth values: the other of "and" and "or"
template <class A, class B> constexpr A &and_assign(int id, A &a, const B &b) {
  if (on(id))
    a |= b;
  else
    a &= b;
  return a;
}
template <class A, class B> constexpr A &or_assign(int id, A &a, const B &b) {
  if (on(id))
    a &= b;
  else
    a |= b;
  return a;
}

} // namespace ksl_mutate
#endif
