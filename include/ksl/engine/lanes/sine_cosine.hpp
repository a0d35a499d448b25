// KSL: sine and cosine together, one kernel for plain numbers and packs of every width.
//
// The angle is reduced to hi + lo, |hi| ≤ π/4, by subtracting a multiple k π/2.  Up to fast_range this takes a few operations in
// lanes.  In double, π/2 is split into three parts whose products with k are exact (Cody and Waite 1980).  In float, each
// difference x − k · part is rounded once.  If a register holds a larger angle, its lanes are computed one by one, and large
// angles are reduced with as many bits of 2/π as they need (large_angle.hpp).  The polynomials are those of K. C. Ng (fdlibm,
// double) and S. Moshier (Cephes, float).
//
// The error is below 1 unit in the last place for every finite angle, in double and in float
// (test/engine/lanes/sine_cosine_test.py).  For infinities and NaN both results are NaN.
#pragma once

#include "ksl/engine/lanes/large_angle.hpp"
#include "ksl/engine/lanes/scalar.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

/// Constants of the kernel for one kind of number.
template <class S> struct trigonometry;

template <> struct trigonometry<double> {
  /// 2¹⁸: beyond it, three parts of π/2 may not be accurate enough for a small hi
  static constexpr double fast_range = 262144.0;
  static constexpr double two_over_pi = 6.36619772367581382433e-01;
  static constexpr double half_pi[3] = {1.57079632673412561417e+00, 6.07710050630396597660e-11,
                                        2.02226624879595063154e-21};
  static constexpr double round = 6755399441055744.0; ///< 1.5 × 2⁵²: adding and subtracting it rounds to an integer
  static constexpr double sine[6] = {-1.66666666666666324348e-01, 8.33333333332248946124e-03,
                                     -1.98412698298579493134e-04, 2.75573137070700676789e-06,
                                     -2.50507602534068634195e-08, 1.58969099521155010221e-10};
  static constexpr double cosine[6] = {4.16666666666666019037e-02, -1.38888888888741095749e-03,
                                       2.48015872894767294178e-05, -2.75573143513906633035e-07,
                                       2.08757232129817482790e-09, -1.13596475577881948265e-11};
};

template <> struct trigonometry<float> {
  static constexpr float fast_range = 262144.0f;
  static constexpr float two_over_pi = 6.36619772367581382433e-01f;
  static constexpr float half_pi[3] = {0x1.921fb6p+0f, -0x1.777a5cp-25f, -0x1.ee59dap-50f}; ///< 24 bits each
  static constexpr float round = 12582912.0f;                                               ///< 1.5 × 2²³
  static constexpr float sine[3] = {-1.6666654611e-1f, 8.3321608736e-3f, -1.9515295891e-4f};
  static constexpr float cosine[3] = {4.166664568298827e-2f, -1.388731625493765e-3f, 2.443315711809948e-5f};
};

/// x = k π/2 + hi + lo.
template <class T> struct reduced_angle { T k, hi, lo; };

template <class T> KSL_LANES reduced_angle<T> reduce(T x, const double &) {
  using C = trigonometry<double>;
  const T round = T(C::round), k = (x * T(C::two_over_pi) + round) - round;
  const T a = x - k * T(C::half_pi[0]), u = k * T(C::half_pi[1]), w = k * T(C::half_pi[2]);
  const T b = a - u, hi = b - w;
  return {k, hi, ((b - hi) - w) + ((a - b) - u)};
}

/// x − k p, rounded once, if the difference has 53 bits at most.  Computed by a fused multiply-add or in double; both give the
/// same bits.
KSL_LANES float difference(float x, float k, float p) {
#if defined(__FMA__)
  return __builtin_fmaf(-k, p, x);
#else
  return static_cast<float>(static_cast<double>(x) - static_cast<double>(k) * static_cast<double>(p));
#endif
}
template <int W> KSL_LANES pack<float, W> difference(pack<float, W> x, pack<float, W> k, float p) {
#if defined(__AVX512F__)
  if constexpr (W == 16)
    return _mm512_fnmadd_ps(k.lanes, pack<float, W>(p).lanes, x.lanes);
#endif
#if defined(__FMA__)
  if constexpr (W == 8)
    return _mm256_fnmadd_ps(k.lanes, pack<float, W>(p).lanes, x.lanes);
  if constexpr (W == 4)
    return _mm_fnmadd_ps(k.lanes, pack<float, W>(p).lanes, x.lanes);
#endif
  using wide = typename vector_of<double, W>::type;
  const wide d =
      __builtin_convertvector(x.lanes, wide) - __builtin_convertvector(k.lanes, wide) * static_cast<double>(p);
  return __builtin_convertvector(d, typename vector_of<float, W>::type);
}

/// Subtracts k π/2 in parts of 24 bits.  The first difference is exact; the rounding error of the second one, hi, is added to lo.
template <class T> KSL_LANES reduced_angle<T> reduce(T x, const float &) {
  using C = trigonometry<float>;
  const T round = T(C::round), c = T(C::two_over_pi);
  const T near = (x * c + round) - round,
          left = difference(x, near, C::half_pi[0]); // large products round to a neighbour
  const T more = (left * c + round) - round, k = near + more;
  const T a = difference(left, more, C::half_pi[0]), p = k * T(C::half_pi[1]), rest = difference(p, k, C::half_pi[1]);
  const T hi = a - p, b = hi - a; // Knuth (1969): the error of a sum
  return {k, hi, (((a - (hi - b)) - (p + b)) + rest) - k * T(C::half_pi[2])};
}

/// c₀ + c₁ x + …, evaluated by pairs, then pairs of pairs (Estrin): the chain of dependent operations is shorter than in
/// Horner's form.
template <class T> KSL_LANES T polynomial(const scalar_of<T> (&c)[3], T x) {
  return (T(c[0]) + T(c[1]) * x) + x * x * T(c[2]);
}
template <class T> KSL_LANES T polynomial(const scalar_of<T> (&c)[6], T x) {
  const T xx = x * x;
  return (T(c[0]) + T(c[1]) * x) + xx * ((T(c[2]) + T(c[3]) * x) + xx * (T(c[4]) + T(c[5]) * x));
}

/// Adds k quarter turns to an angle that is given by its sine s and cosine c.  The last bit of k mod 4 swaps the two, the other
/// bit changes signs.
template <class T> KSL_LANES void turn_by_quarters(T k, T &s, T &c) {
  using S = scalar_of<T>;
  const T one = T(S(1)), half = T(S(0.5)), round = T(trigonometry<S>::round), sine = s, cosine = c;
  const T n = k - T(S(4)) * ((k * T(S(0.25)) + round) - round); // k mod 4 in −2 … 2
  const auto odd = n * n == one;
  s = math<T>::select(odd, cosine, sine), c = math<T>::select(odd, sine, cosine);
  s = math<T>::select(math<T>::fabs(n - half) > one, -s, s);
  c = math<T>::select(math<T>::fabs(n + half) > one, -c, c);
}

/// Quarter turns by bit operations on k + 1.5 × 2^(digits − 1), whose last bits are those of k.
template <class S, int W> KSL_LANES void turn_by_quarters(pack<S, W> k, pack<S, W> &s, pack<S, W> &c) {
  using P = pack<S, W>;
  using integers = typename P::mask;
  constexpr int to_sign = 8 * sizeof(S) - 2;
  const P shifted = k + P(trigonometry<S>::round), sine = s, cosine = c;
  integers n, sine_bits, cosine_bits;
  __builtin_memcpy(&n, &shifted, sizeof n);
  const integers odd = (n & 1) != 0;
  const P even_sine = math<P>::select(odd, cosine, sine), even_cosine = math<P>::select(odd, sine, cosine);
  __builtin_memcpy(&sine_bits, &even_sine, sizeof n);
  __builtin_memcpy(&cosine_bits, &even_cosine, sizeof n);
  sine_bits ^= (n & 2) << to_sign;
  cosine_bits ^= ((n + 1) & 2) << to_sign;
  __builtin_memcpy(&s, &sine_bits, sizeof n);
  __builtin_memcpy(&c, &cosine_bits, sizeof n);
}

/// Two packs whose operations alternate, since those of one wait for each other.  The functions above take it for a scalar.
template <class P> struct twin_packs {
  P a, b;

  twin_packs() = default;
  KSL_LANES twin_packs(P x, P y) : a(x), b(y) {}
  KSL_LANES explicit twin_packs(scalar_of<P> x) : a(x), b(x) {}

  friend KSL_LANES twin_packs operator+(twin_packs x, twin_packs y) { return {x.a + y.a, x.b + y.b}; }
  friend KSL_LANES twin_packs operator-(twin_packs x, twin_packs y) { return {x.a - y.a, x.b - y.b}; }
  friend KSL_LANES twin_packs operator*(twin_packs x, twin_packs y) { return {x.a * y.a, x.b * y.b}; }
};
template <class P> struct scalar_of_trait<twin_packs<P>> : scalar_of_trait<P> {};
template <class P> KSL_LANES bool magnitudes_at_most(const twin_packs<P> &x, scalar_of<P> y) {
  const bool a = magnitudes_at_most(x.a, y), b = magnitudes_at_most(x.b, y); // both: a branch would cost more
  return a && b;
}
template <class P> KSL_LANES twin_packs<P> difference(const twin_packs<P> &x, const twin_packs<P> &k, scalar_of<P> p) {
  return {difference(x.a, k.a, p), difference(x.b, k.b, p)};
}
template <class P> KSL_LANES void turn_by_quarters(const twin_packs<P> &k, twin_packs<P> &s, twin_packs<P> &c) {
  turn_by_quarters(k.a, s.a, c.a);
  turn_by_quarters(k.b, s.b, c.b);
}

/// Sine and cosine of a reduced angle.
template <class T> KSL_LANES void sine_cosine_of_reduced(const reduced_angle<T> &r, T &sine, T &cosine) {
  using C = trigonometry<scalar_of<T>>;
  const T one = T(1), half = T(0.5);
  const T z = r.hi * r.hi, half_z = half * z;
  sine = r.hi + (z * r.hi * polynomial<T>(C::sine, z) + (r.lo - half_z * r.lo));
  const T v = one - half_z;
  cosine = v + (((one - v) - half_z) + (z * z * polynomial<T>(C::cosine, z) - r.hi * r.lo));
  turn_by_quarters(r.k, sine, cosine);
}

/// sine and cosine of x, |x| ≤ fast_range, without branches.
template <class T> KSL_LANES void sine_cosine_in_fast_range(T x, T &sine, T &cosine) {
  sine_cosine_of_reduced(reduce(x, scalar_of<T>()), sine, cosine);
}

/// Sine and cosine of any x; NaN for infinities and NaN.  Not inlined, so that the fast path keeps its registers.
template <class S> __attribute__((noinline, cold)) void sine_cosine_of_any(S x, S &sine, S &cosine) {
  if (math<S>::fabs(x) <= trigonometry<S>::fast_range) { // only another lane of the register is large
    sine_cosine_in_fast_range(x, sine, cosine);
  } else if (x - x == S(0)) { // NOLINT(misc-redundant-expression): not of infinities
    const reduced_large_angle large = reduce_large(static_cast<double>(x));
    const S hi = static_cast<S>(large.numerator), unit = static_cast<S>(large.unit);
    const S lo = static_cast<S>(large.numerator - static_cast<std::int64_t>(hi));
    sine_cosine_of_reduced<S>({static_cast<S>(large.quarters), hi * unit, lo * unit}, sine, cosine);
  } else {
    sine = cosine = x - x; // NOLINT(misc-redundant-expression): NaN
  }
}
template <class S, int W>
__attribute__((noinline, cold)) void sine_cosine_of_any(const pack<S, W> &x, pack<S, W> &sine, pack<S, W> &cosine) {
  for (int i = 0; i < W; ++i) {
    S s, c;
    sine_cosine_of_any(x[i], s, c);
    sine.set(i, s), cosine.set(i, c);
  }
}

/// sine and cosine of x, for every x.
template <class T>
  requires(is_number<T> || is_pack<T>)
KSL_LANES void sine_cosine(T x, T &sine, T &cosine) {
  const bool in_range = magnitudes_at_most(x, trigonometry<scalar_of<T>>::fast_range);
  T s, c;
  sine_cosine_in_fast_range(x, s, c);
  if (!in_range) [[unlikely]] {
    T angle = x, any_s, any_c; // copies, since only these need an address
    sine_cosine_of_any(angle, any_s, any_c);
    s = any_s, c = any_c;
  }
  sine = s, cosine = c;
}

/// Sine and cosine of any other scalar, by its own function.
template <class T>
  requires(!is_number<T> && !is_pack<T>)
void sine_cosine(const T &x, T &sine, T &cosine) {
  static_assert(has_sine_cosine<T>, "this scalar has no sine and cosine of its own: "
                                    "give it math<T>::sine_cosine(angle, sine, cosine) (docs/scalars.md)");
  static_assert(scalar<T>,
                "this type is no scalar for KSL: ksl/engine/lanes/scalar.hpp lists what is asked (docs/scalars.md)");
  if constexpr (has_sine_cosine<T>)
    math<T>::sine_cosine(x, sine, cosine);
}

/// Sines and cosines of two angles.  Those of plain numbers are two lanes: one after the other they would take twice the instructions.
template <class T> KSL_LANES void sines_cosines(const T &x, const T &y, T (&sine)[2], T (&cosine)[2]) {
  if constexpr (is_number<T>) {
    pack<T, 16 / static_cast<int>(sizeof(T))> angles(x), s, c;
    angles.set(1, y);
    sine_cosine(angles, s, c);
    sine[0] = s[0], sine[1] = s[1], cosine[0] = c[0], cosine[1] = c[1];
  } else {
    sine_cosine(x, sine[0], cosine[0]);
    sine_cosine(y, sine[1], cosine[1]);
  }
}

/// Of one angle, in lanes also if it is a plain number: a pack is turned by quarters in fewer steps.
template <class T> KSL_LANES void sine_cosine_in_lanes(const T &x, T &sine, T &cosine) {
  if constexpr (is_number<T>) {
    T s[2], c[2];
    sines_cosines(x, x, s, c);
    sine = s[0], cosine = c[0];
  } else {
    sine_cosine(x, sine, cosine);
  }
}

/// math<T> with the sine and the cosine above in place of those of the C library.
template <class T> struct functions_with_own_sines : math<T> {
  static KSL_LANES T sin(const T &x) {
    T s, c;
    sine_cosine(x, s, c);
    return s;
  }
  static KSL_LANES T cos(const T &x) {
    T s, c;
    sine_cosine(x, s, c);
    return c;
  }
  /// Of plain numbers both take the sines of x and of its half: where both are called, compilers find that they are the same.
  static KSL_LANES void sine_with_half(const T &x, T &sine, T &half) {
    T s[2], c[2];
    sines_cosines(T(0.5) * x, x, s, c);
    half = s[0], sine = s[1];
  }
  static KSL_LANES void half_sine_cosine(const T &x, T &sine, T &cosine) {
    if constexpr (is_number<T>) {
      T s[2], c[2];
      sines_cosines(T(0.5) * x, x, s, c);
      sine = s[0], cosine = c[0];
    } else {
      sine_cosine(T(0.5) * x, sine, cosine);
    }
  }
};
/// The algebra with sines whose bits are those of generated code, whatever the C library.
template <class T> using algebra_with_own_sines = algebra<T, functions_with_own_sines<T>>;

} // namespace KSL_ISA
} // namespace ksl
