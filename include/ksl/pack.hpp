// KSL: a pack of lanes is a scalar: algebra<pack<double, 8>> computes eight states at once.
//
// Packs are based on the vector types of gcc and clang, and should have the native width of the instruction set.  Conditions
// are applied by select; there is no conversion to bool.
#pragma once

#include "ksl/algebra.hpp"

#if defined(__AVX__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace ksl {

/// The vector type of W lanes, and the type of its comparisons.  A trait with full specialisations, since gcc 12 ignores a
/// dependent vector_size inside a class template.
template <class T, int W> struct vector_of;

#define KSL_VECTOR_OF(T, W, Integer)                                                                                   \
  template <> struct vector_of<T, W> {                                                                                 \
    typedef T type __attribute__((vector_size(W * sizeof(T))));                                                        \
    typedef Integer mask __attribute__((vector_size(W * sizeof(Integer))));                                            \
  };
KSL_VECTOR_OF(double, 2, long long)
KSL_VECTOR_OF(double, 4, long long)
KSL_VECTOR_OF(double, 8, long long)
KSL_VECTOR_OF(double, 16, long long)
KSL_VECTOR_OF(float, 2, int)
KSL_VECTOR_OF(float, 4, int)
KSL_VECTOR_OF(float, 8, int)
KSL_VECTOR_OF(float, 16, int)
#undef KSL_VECTOR_OF

inline namespace KSL_ISA {

#ifdef __OPTIMIZE__ // otherwise the code of whole algorithms would grow tenfold, and compile as slowly
#define KSL_LANES __attribute__((always_inline)) inline
#define KSL_INLINED __attribute__((always_inline)) ///< for lambdas: calls instead would make inner loops a tenth slower
#else
#define KSL_LANES inline
#define KSL_INLINED
#endif
#define KSL_NOT_INLINED __attribute__((noinline))

/// What is in memory is read again from here on.  An operand in memory costs nothing; numbers that wait for their use don't fit in sixteen
/// registers, and would be stored a second time.  `in_memory` is false where they are in registers anyway.
template <bool in_memory = true> KSL_LANES void read_again() {
  if constexpr (in_memory)
    __asm__ volatile("" ::: "memory");
}

/// W numbers of type T; arithmetic is elementwise.
template <class T, int W> struct pack {
  using vector = typename vector_of<T, W>::type;
  using mask = typename vector_of<T, W>::mask;

  vector lanes;

  pack() = default;
  KSL_LANES pack(vector x) : lanes(x) {}
  KSL_LANES pack(T x) : lanes(x - vector{}) {} // in all lanes
  /// A constant, rounded to T: algorithms write T(0.5), whatever T is.
  template <class U>
    requires(__is_same(U, double) && !__is_same(T, double))
  KSL_LANES explicit pack(U x) : pack(static_cast<T>(x)) {}

  KSL_LANES T operator[](int i) const { return lanes[i]; }
  KSL_LANES void set(int i, T x) { lanes[i] = x; }

  friend KSL_LANES pack operator-(pack a) { return -a.lanes; }
  friend KSL_LANES pack operator+(pack a, pack b) { return a.lanes + b.lanes; }
  friend KSL_LANES pack operator-(pack a, pack b) { return a.lanes - b.lanes; }
  friend KSL_LANES pack operator*(pack a, pack b) { return a.lanes * b.lanes; }
  friend KSL_LANES pack operator/(pack a, pack b) { return a.lanes / b.lanes; }
  friend KSL_LANES mask operator<(pack a, pack b) { return a.lanes < b.lanes; }
  friend KSL_LANES mask operator>(pack a, pack b) { return a.lanes > b.lanes; }
  friend KSL_LANES mask operator<=(pack a, pack b) { return a.lanes <= b.lanes; }
  friend KSL_LANES mask operator>=(pack a, pack b) { return a.lanes >= b.lanes; }
  friend KSL_LANES mask operator==(pack a, pack b) { return a.lanes == b.lanes; }
};

/// Size of a register of the instruction set that is compiled for.
#if defined(__AVX512F__)
inline constexpr int vector_bytes = 64;
#elif defined(__AVX__)
inline constexpr int vector_bytes = 32;
#else
inline constexpr int vector_bytes = 16;
#endif
template <class T> inline constexpr int native_lanes = vector_bytes / static_cast<int>(sizeof(T));
template <class T> using native_pack = pack<T, native_lanes<T>>;

/// States of a batch that are computed together.  On Arm these are in two of the thirty-two registers: one instruction loads or stores
/// both, and loops and addresses serve twice as many states.  gcc handles each of the two by way of memory.
#if defined(__aarch64__) && defined(__clang__)
template <class T> inline constexpr int batch_lanes = 2 * native_lanes<T>;
#else
template <class T> inline constexpr int batch_lanes = native_lanes<T>;
#endif
template <class T> using batch_pack = pack<T, batch_lanes<T>>;

/// The first n numbers of `from`, zeros in other lanes; n may be more than there are lanes.  Reads no other memory.  Doesn't copy
/// by way of a buffer, which avoids a store-to-load stall.
template <class T> KSL_LANES native_pack<T> load_first(const T *from, int n) {
  native_pack<T> x(T(0));
  if (n >= native_lanes<T>)
    __builtin_memcpy(&x, from, sizeof x);
  else
    for (int i = 0; i < native_lanes<T> - 1; ++i)
      if (i < n)
        x.set(i, from[i]);
  return x;
}

/// Stores the first n lanes, or all if n is larger.
template <class T> KSL_LANES void store_first(const native_pack<T> &x, T *to, int n) {
  if (n >= native_lanes<T>)
    __builtin_memcpy(to, &x, sizeof x);
  else
    for (int i = 0; i < native_lanes<T> - 1; ++i)
      if (i < n)
        to[i] = x[i];
}

#if defined(__AVX512F__)
template <> KSL_LANES native_pack<double> load_first(const double *from, int n) {
  return n >= 8 ? _mm512_loadu_pd(from) : _mm512_maskz_loadu_pd(static_cast<__mmask8>((1u << n) - 1), from);
}
template <> KSL_LANES native_pack<float> load_first(const float *from, int n) {
  return n >= 16 ? _mm512_loadu_ps(from) : _mm512_maskz_loadu_ps(static_cast<__mmask16>((1u << n) - 1), from);
}
template <> KSL_LANES void store_first(const native_pack<double> &x, double *to, int n) {
  _mm512_mask_storeu_pd(to, n >= 8 ? static_cast<__mmask8>(255) : static_cast<__mmask8>((1u << n) - 1), x.lanes);
}
template <> KSL_LANES void store_first(const native_pack<float> &x, float *to, int n) {
  _mm512_mask_storeu_ps(to, n >= 16 ? static_cast<__mmask16>(65535) : static_cast<__mmask16>((1u << n) - 1), x.lanes);
}
#endif

/// Is |a| ≤ b in every lane, and no lane NaN?  b ≥ 0.  Returns a bool for branches.
KSL_LANES bool magnitudes_at_most(double a, double b) { return __builtin_fabs(a) <= b; }
KSL_LANES bool magnitudes_at_most(float a, float b) { return __builtin_fabsf(a) <= b; }

/// Compares bit patterns as integers: they are ordered as the magnitudes are, with infinities and NaN above.
template <class T, int W> KSL_LANES bool magnitudes_at_most(pack<T, W> a, T b) {
  using integers = typename pack<T, W>::mask;
  integers magnitude, limit;
  const pack<T, W> all_b(b);
  __builtin_memcpy(&magnitude, &a, sizeof a);
  __builtin_memcpy(&limit, &all_b, sizeof a);
  if constexpr (sizeof(T) == 8)
    magnitude &= 0x7fffffffffffffff;
  else
    magnitude &= 0x7fffffff;
#if defined(__AVX512F__)
  if constexpr (sizeof a == 64 && sizeof(T) == 8)
    return _mm512_cmpgt_epi64_mask((__m512i)magnitude, (__m512i)limit) == 0;
  if constexpr (sizeof a == 64 && sizeof(T) == 4)
    return _mm512_cmpgt_epi32_mask((__m512i)magnitude, (__m512i)limit) == 0;
#endif
  const integers beyond = magnitude > limit;
#if defined(__AVX__)
  if constexpr (sizeof a == 32 && sizeof(T) == 8)
    return _mm256_movemask_pd((__m256d)beyond) == 0;
  if constexpr (sizeof a == 32 && sizeof(T) == 4)
    return _mm256_movemask_ps((__m256)beyond) == 0;
#endif
#if defined(__SSE2__)
  if constexpr (sizeof a == 16 && sizeof(T) == 8)
    return _mm_movemask_pd((__m128d)beyond) == 0;
  if constexpr (sizeof a == 16 && sizeof(T) == 4)
    return _mm_movemask_ps((__m128)beyond) == 0;
#endif
  auto any = beyond[0];
  for (int i = 1; i < W; ++i)
    any |= beyond[i];
  return any == 0;
}

/// The scalar that a type's lanes hold: itself, or a pack's.
template <class T> struct scalar_of_trait { using type = T; };
template <class T, int W> struct scalar_of_trait<pack<T, W>> { using type = T; };
template <class T> using scalar_of = typename scalar_of_trait<T>::type;

template <class T, int W> struct math<pack<T, W>> {
  using P = pack<T, W>;
  static constexpr T epsilon = math<T>::epsilon;

  static KSL_LANES P select(typename P::mask condition, P a, P b) { return condition ? a.lanes : b.lanes; }
  static KSL_LANES P fabs(P x) { return select(x < P(T(0)), -x, x); }
  static KSL_LANES P sqrt(P x) { return each(x, math<T>::sqrt); } // compiled to one instruction
  static P atan2(P y, P x) {
    P out;
    for (int i = 0; i < W; ++i)
      out.set(i, math<T>::atan2(y[i], x[i]));
    return out;
  }
  static P sin(P x) { return each(x, math<T>::sin); }
  static P cos(P x) { return each(x, math<T>::cos); }

private:
  template <class Function> static KSL_LANES P each(P x, Function f) {
    P out;
    for (int i = 0; i < W; ++i)
      out.set(i, f(x[i]));
    return out;
  }
};

} // namespace KSL_ISA
} // namespace ksl
