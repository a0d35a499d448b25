// KSL: sine and cosine together, one kernel for every scalar and every width.
//
// The angle is reduced to hi + lo, |hi| ≤ π/4, by multiples of π/2: in double by three parts whose products with
// |k| < 2²⁰ are exact (Cody and Waite 1980), in float by the same in double.  Then the polynomials of K. C. Ng (fdlibm,
// double) or S. Moshier (Cephes, float).  Error below 1 ulp for |x| ≤ 10⁶ (test/engine/sine_cosine_test.cpp); beyond,
// digits are lost as |x| grows, and where none is left (beyond about 10¹⁵) both are NaN.
#pragma once

#include "ksl/pack.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

/// Constants of the kernel for one kind of number.
template <class S> struct trigonometry;

template <> struct trigonometry<double> {
  static constexpr double two_over_pi = 6.36619772367581382433e-01;
  static constexpr double half_pi[3] = {1.57079632673412561417e+00, 6.07710050630396597660e-11, 2.02226624879595063154e-21};
  static constexpr double round = 6755399441055744.0; ///< 1.5 × 2⁵²: adding and taking it off rounds to an integer
  static constexpr double sine[6] = {-1.66666666666666324348e-01, 8.33333333332248946124e-03,  -1.98412698298579493134e-04,
                                     2.75573137070700676789e-06,  -2.50507602534068634195e-08, 1.58969099521155010221e-10};
  static constexpr double cosine[6] = {4.16666666666666019037e-02,  -1.38888888888741095749e-03, 2.48015872894767294178e-05,
                                       -2.75573143513906633035e-07, 2.08757232129817482790e-09,  -1.13596475577881948265e-11};
};

template <> struct trigonometry<float> {
  static constexpr float round = 12582912.0f; ///< 1.5 × 2²³
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

KSL_LANES reduced_angle<float> reduce(float x, const float &) {
  const reduced_angle<double> r = reduce(static_cast<double>(x), 0.0);
  const float hi = static_cast<float>(r.hi);
  return {static_cast<float>(r.k), hi, static_cast<float>(r.hi - hi)};
}

template <int W> KSL_LANES reduced_angle<pack<float, W>> reduce(pack<float, W> x, const float &) {
  using half = typename vector_of<float, W / 2>::type; // as many floats as a register holds doubles
  using wide = typename vector_of<double, W / 2>::type;
  half in[2], k[2], hi[2], lo[2];
  __builtin_memcpy(in, &x, sizeof x);
  for (int i = 0; i < 2; ++i) {
    const reduced_angle<pack<double, W / 2>> r = reduce(pack<double, W / 2>(__builtin_convertvector(in[i], wide)), 0.0);
    k[i] = __builtin_convertvector(r.k.lanes, half);
    hi[i] = __builtin_convertvector(r.hi.lanes, half);
    lo[i] = __builtin_convertvector(r.hi.lanes - __builtin_convertvector(hi[i], wide), half);
  }
  reduced_angle<pack<float, W>> out;
  __builtin_memcpy(&out.k, k, sizeof k);
  __builtin_memcpy(&out.hi, hi, sizeof hi);
  __builtin_memcpy(&out.lo, lo, sizeof lo);
  return out;
}

template <class T, std::size_t n> KSL_LANES T polynomial(const scalar_of<T> (&c)[n], T x) {
  T sum = T(c[n - 1]);
  for (std::size_t i = n - 1; i-- > 0;)
    sum = sum * x + T(c[i]);
  return sum;
}

/// sine and cosine of x, by select and never by branch.
template <class T> KSL_LANES void sine_cosine(T x, T &sine, T &cosine) {
  using S = scalar_of<T>;
  using C = trigonometry<S>;
  const reduced_angle<T> r = reduce(x, S());
  const T one = T(S(1)), half = T(S(0.5)), round = T(C::round);

  const T z = r.hi * r.hi, half_z = half * z;
  const T s = r.hi + (z * r.hi * polynomial<T>(C::sine, z) + (r.lo - half_z * r.lo));
  const T v = one - half_z;
  const T c = v + (((one - v) - half_z) + (z * z * polynomial<T>(C::cosine, z) - r.hi * r.lo));

  // k quarter turns: n = k mod 4 in −2 … 2 swaps the two where it is odd, and turns signs
  const T n = r.k - T(S(4)) * ((r.k * T(S(0.25)) + round) - round);
  const auto odd = n * n == one;
  const auto reducible = math<T>::fabs(r.hi) < one;
  const T none = T(S(__builtin_nan("")));
  const T sine_n = math<T>::select(reducible, math<T>::select(odd, c, s), none);
  const T cosine_n = math<T>::select(reducible, math<T>::select(odd, s, c), none);
  sine = math<T>::select(math<T>::fabs(n - half) > one, -sine_n, sine_n);
  cosine = math<T>::select(math<T>::fabs(n + half) > one, -cosine_n, cosine_n);
}

} // namespace KSL_ISA
} // namespace ksl
