// KSL: a pack of lanes is a scalar: algebra<pack<double, 8>> computes eight states at once.
//
// Packs sit on the vector types of gcc and clang and are to be used at the instruction set's native width.  Choices are
// made by select; there is no conversion to bool.
#pragma once

#include "ksl/algebra.hpp"

namespace ksl {

/// The vector type of W lanes, and that of their comparison.  A trait of full specialisations: gcc 12 drops a dependent
/// vector_size inside a class template.
template <class T, int W> struct vector_of;

#define KSL_VECTOR_OF(T, W, Integer)                                                                                   \
  template <> struct vector_of<T, W> {                                                                                 \
    typedef T type __attribute__((vector_size(W * sizeof(T))));                                                        \
    typedef Integer mask __attribute__((vector_size(W * sizeof(Integer))));                                            \
  };
KSL_VECTOR_OF(double, 2, long long)
KSL_VECTOR_OF(double, 4, long long)
KSL_VECTOR_OF(double, 8, long long)
KSL_VECTOR_OF(float, 2, int)
KSL_VECTOR_OF(float, 4, int)
KSL_VECTOR_OF(float, 8, int)
KSL_VECTOR_OF(float, 16, int)
#undef KSL_VECTOR_OF

inline namespace KSL_ISA {

#define KSL_LANES __attribute__((always_inline)) inline

/// W numbers of type T; arithmetic is elementwise.
template <class T, int W> struct pack {
  using vector = typename vector_of<T, W>::type;
  using mask = typename vector_of<T, W>::mask;

  vector lanes;

  pack() = default;
  KSL_LANES pack(vector x) : lanes(x) {}
  KSL_LANES pack(T x) : lanes(x - vector{}) {} // in all lanes

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

/// How many lanes of T the instruction set that is compiled for holds in a register.
#if defined(__AVX512F__)
inline constexpr int vector_bytes = 64;
#elif defined(__AVX__)
inline constexpr int vector_bytes = 32;
#else
inline constexpr int vector_bytes = 16;
#endif
template <class T> inline constexpr int native_lanes = vector_bytes / static_cast<int>(sizeof(T));
template <class T> using native_pack = pack<T, native_lanes<T>>;

/// The scalar that a type's lanes hold: itself, or a pack's.
template <class T> struct scalar_of_trait { using type = T; };
template <class T, int W> struct scalar_of_trait<pack<T, W>> { using type = T; };
template <class T> using scalar_of = typename scalar_of_trait<T>::type;

template <class T, int W> struct math<pack<T, W>> {
  using P = pack<T, W>;
  static constexpr T epsilon = math<T>::epsilon;

  static KSL_LANES P select(typename P::mask condition, P a, P b) { return condition ? a.lanes : b.lanes; }
  static KSL_LANES P fabs(P x) { return select(x < P(T(0)), -x, x); }
  static KSL_LANES P sqrt(P x) { return each(x, math<T>::sqrt); } // the compilers make one instruction of it
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
