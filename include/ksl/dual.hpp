// KSL: dual numbers: a value and its derivatives in n directions.  Every operation applies the rules of differentiation
// (forward-mode automatic differentiation), so derivatives are exact up to rounding and need no step width.
//
//   using T = ksl::dual<1>;
//   T x = T::variable(0.5, 0);        // the value 0.5, derivative 1 in direction 0
//   T y = x * x;                      // y.value 0.25, y.derivative[0] 1
//
// Every algorithm of the engine and every function of algebra<T> accepts them (docs/scalars.md).  Nested duals give second
// derivatives: second_order_dual<n>.  Values are the same bits as with S alone.  A sum costs n + 1 operations of S, a product
// 3 n + 1, a quotient 3 n + 2.
//
// Source: Griewank and Walther, Evaluating Derivatives (2008), section 3.1.
#pragma once

#include "ksl/engine/lanes/scalar.hpp"
#include "ksl/engine/lanes/sine_cosine.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// How many plain numbers or packs a scalar holds.
template <class T> inline constexpr int innermost_numbers = 1;
template <int n, class S = double> struct dual;
template <int n, class S> inline constexpr int innermost_numbers<dual<n, S>> = (n + 1) * innermost_numbers<S>;

/// A number of type S and its first derivatives in n directions.  S: double, float, a pack, or a dual.
///
/// If a function has no derivative at a point, the rule is applied all the same: sqrt and atan2 at zero give infinities or NaN,
/// fabs at zero gives the derivative of the argument.  Comparisons use the values only.
template <int n, class S> struct dual {
  static_assert(n > 0, "a dual number has one direction at least");
  using number = scalar_of<S>;

  S value;
  S derivative[n];

  dual() = default; ///< not initialised, as S is not
  /// A constant.
  dual(const S &x) : value(x) {
    for (S &d : derivative)
      d = S(number(0));
  }
  dual(number x)
    requires(!is_number<S>)
      : dual(S(x)) {}
  /// A constant of double precision, rounded to the precision of S.
  template <class U>
    requires(__is_same(U, double) && !__is_same(number, double))
  explicit dual(U x) : dual(static_cast<number>(x)) {}

  /// The variable of a direction: derivative 1 there, 0 elsewhere.
  static dual variable(const S &x, int direction) {
    dual out(x);
    out.derivative[direction] = S(number(1));
    return out;
  }

  friend dual operator-(const dual &a) {
    return result([](const dual &x, const dual &) { return map(-x.value, [&](int i) { return -x.derivative[i]; }); }, a,
                  a);
  }
  friend dual operator+(const dual &a, const dual &b) {
    return result(
        [](const dual &x, const dual &y) {
          return map(x.value + y.value, [&](int i) { return x.derivative[i] + y.derivative[i]; });
        },
        a, b);
  }
  friend dual operator-(const dual &a, const dual &b) {
    return result(
        [](const dual &x, const dual &y) {
          return map(x.value - y.value, [&](int i) { return x.derivative[i] - y.derivative[i]; });
        },
        a, b);
  }
  friend dual operator*(const dual &a, const dual &b) {
    return result(
        [](const dual &x, const dual &y) {
          return map(x.value * y.value, [&](int i) { return x.derivative[i] * y.value + x.value * y.derivative[i]; });
        },
        a, b);
  }
  friend dual operator/(const dual &a, const dual &b) {
    return result(
        [](const dual &x, const dual &y) {
          const S quotient = x.value / y.value, inverse = S(number(1)) / y.value;
          return map(quotient, [&](int i) { return (x.derivative[i] - quotient * y.derivative[i]) * inverse; });
        },
        a, b);
  }
  friend auto operator<(const dual &a, const dual &b) { return a.value < b.value; }
  friend auto operator>(const dual &a, const dual &b) { return a.value > b.value; }
  friend auto operator<=(const dual &a, const dual &b) { return a.value <= b.value; }
  friend auto operator>=(const dual &a, const dual &b) { return a.value >= b.value; }
  friend auto operator==(const dual &a, const dual &b) { return a.value == b.value; }

  /// A value, and derivatives by a function of the direction.
  template <class Rule> static dual map(const S &value, Rule rule) {
    dual out;
    out.value = value;
    for (int i = 0; i < n; ++i)
      out.derivative[i] = rule(i);
    return out;
  }
  /// f(x), from its value and its slope there.
  static dual chain(const S &value, const S &slope, const dual &x) {
    return map(value, [&](int i) { return slope * x.derivative[i]; });
  }

private:
  /// An algorithm is inlined into a single function of thousands of operations.  Operations on more numbers than this are called
  /// instead of inlined, so that compile times don't grow with n.
#if defined(__clang__)
  static constexpr int most_inlined = 16;
#else
  static constexpr int most_inlined =
      8; // gcc's inlined loops are no faster at -O2, and take three times as long to compile
#endif

  template <class Operation> static dual result(Operation operation, const dual &a, const dual &b) {
    if constexpr (innermost_numbers<dual> > most_inlined)
      return called(operation, a, b);
    else
      return operation(a, b);
  }
  template <class Operation>
  __attribute__((noinline)) static dual called(Operation operation, const dual &a, const dual &b) {
    return operation(a, b);
  }
};

/// Second derivatives in n directions: x.derivative[i].derivative[j], with the first ones in x.derivative[i].value and in
/// x.value.derivative[i].  Each operation costs about (n + 1)² times as much as that of S.
template <int n, class S = double> using second_order_dual = dual<n, dual<n, S>>;

/// The variable of a direction, with derivative 1 there in both orders.
template <int n, class S = double> second_order_dual<n, S> second_order_variable(const S &x, int direction) {
  return second_order_dual<n, S>::variable(dual<n, S>::variable(x, direction), direction);
}

/// Models hold plain numbers, which are converted to constant duals.
template <int n, class S> struct scalar_of_trait<dual<n, S>> { using type = scalar_of<S>; };

template <int n, class S> struct math<dual<n, S>> {
  using D = dual<n, S>;
  using number = scalar_of<S>;
  static constexpr number epsilon = math<number>::epsilon;

  template <class Condition> static D select(const Condition &condition, const D &a, const D &b) {
    return D::map(math<S>::select(condition, a.value, b.value),
                  [&](int i) { return math<S>::select(condition, a.derivative[i], b.derivative[i]); });
  }
  static D fabs(const D &x) {
    const auto negative = x.value < S(number(0));
    return D::map(math<S>::fabs(x.value),
                  [&](int i) { return math<S>::select(negative, -x.derivative[i], x.derivative[i]); });
  }
  static D sqrt(const D &x) {
    const S root = math<S>::sqrt(x.value);
    return D::chain(root, S(number(0.5)) / root, x);
  }
  static D atan2(const D &y, const D &x) {
    const S squares = x.value * x.value + y.value * y.value, along_y = x.value / squares, along_x = y.value / squares;
    return D::map(math<S>::atan2(y.value, x.value),
                  [&](int i) { return along_y * y.derivative[i] - along_x * x.derivative[i]; });
  }
  static D sin(const D &x) { return D::chain(math<S>::sin(x.value), math<S>::cos(x.value), x); }
  static D cos(const D &x) { return D::chain(math<S>::cos(x.value), -math<S>::sin(x.value), x); }
  /// Both at once, for the engine.
  static void sine_cosine(const D &x, D &sine, D &cosine) {
    S s, c;
    ksl::sine_cosine(x.value, s, c);
    sine = D::chain(s, c, x), cosine = D::chain(c, -s, x);
  }
};

} // namespace KSL_ISA
} // namespace ksl
