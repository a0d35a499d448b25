// KSL: the algebra as a template over any scalar: the bodies of the C functions, included once inside algebra<T>.
//
// Types are plain structs with the members and the layout of the C types (ksl/types.h); same_layout converts.  They lie
// outside the instruction set's namespace, since they hold no code.
#pragma once

#include "ksl/isa.hpp"
#include "ksl/types.h"

#include <cfloat>
#include <cstddef>
#include <cstring>

namespace ksl {

template <class T> struct vec3 { T x, y, z; };
template <class T> struct vec4 { T x, y, z, w; };
template <class T> struct quaternion { T x, y, z, w; };
template <class T> struct mat3x3 { T m00, m10, m20, m01, m11, m21, m02, m12, m22; };
template <class T> struct mat4x4 { T m00, m10, m20, m30, m01, m11, m21, m31, m02, m12, m22, m32, m03, m13, m23, m33; };
template <class T> struct SE3 {
  mat3x3<T> R;
  vec3<T> t;
};
template <class T> struct screw { vec3<T> lin, ang; };
template <class T> struct coscrew { vec3<T> lin, ang; };
template <class T> struct inertia {
  T m;
  vec3<T> mt;
  T Ixx, Iyy, Izz, Ixy, Iyz, Izx;
};
template <class T> struct spatial_inertia {
  T m;
  vec3<T> h;
  T Ixx, Iyy, Izz, Ixy, Iyz, Izx;
};
template <class T> struct articulated_inertia {
  T Mxx, Myy, Mzz, Mxy, Myz, Mzx;
  mat3x3<T> H;
  T Ixx, Iyy, Izz, Ixy, Iyz, Izx;
};
template <class T> struct joint_space {
  screw<T> s[6];
  coscrew<T> c[6];
};
template <class T> struct motion { vec3<T> ang, lin; };
template <class T> struct force { vec3<T> ang, lin; };
template <class T> struct plucker {
  mat3x3<T> E;
  vec3<T> r;
};

inline namespace KSL_ISA {

/// The bits of one type read as another of the same size: ksl::vec3<double> and ksl_vec3_t, say.
template <class To, class From> inline To same_layout(const From &from) {
  static_assert(sizeof(To) == sizeof(From));
  To to;
  std::memcpy(&to, &from, sizeof to);
  return to;
}

/// Functions that the bodies need besides + − × ÷ and comparison.  Specialise it for a scalar of your own.
template <class T> struct math;

template <> struct math<double> {
  static constexpr double epsilon = DBL_EPSILON;
  static double sqrt(double x) { return __builtin_sqrt(x); }
  static double fabs(double x) { return __builtin_fabs(x); }
  static double sin(double x) { return __builtin_sin(x); }
  static double cos(double x) { return __builtin_cos(x); }
  static double atan2(double y, double x) { return __builtin_atan2(y, x); }
  static double select(bool condition, double a, double b) { return condition ? a : b; }
};

template <> struct math<float> {
  static constexpr float epsilon = FLT_EPSILON;
  static float sqrt(float x) { return __builtin_sqrtf(x); }
  static float fabs(float x) { return __builtin_fabsf(x); }
  static float sin(float x) { return __builtin_sinf(x); }
  static float cos(float x) { return __builtin_cosf(x); }
  static float atan2(float y, float x) { return __builtin_atan2f(y, x); }
  static float select(bool condition, float a, float b) { return condition ? a : b; }
};

/// The sine of x and of its half, and sine and cosine of the half: in one where Functions have them so.
template <class Functions, class T>
__attribute__((always_inline)) inline void sine_with_half(const T &x, T *sine, T *half) {
  if constexpr (requires { Functions::sine_with_half(x, *sine, *half); })
    Functions::sine_with_half(x, *sine, *half);
  else
    *sine = Functions::sin(x), *half = Functions::sin(T(0.5) * x);
}
template <class Functions, class T>
__attribute__((always_inline)) inline void half_sine_cosine(const T &x, T *sine, T *cosine) {
  if constexpr (requires { Functions::half_sine_cosine(x, *sine, *cosine); })
    Functions::half_sine_cosine(x, *sine, *cosine);
  else
    *sine = Functions::sin(T(0.5) * x), *cosine = Functions::cos(T(0.5) * x);
}

/// Every algebra function of the C headers for scalar T, without prefix and suffix: product_CoAdc, screw_copy, ...  Functions: those that they call.
template <class T, class Functions = ksl::math<T>> struct algebra {
  using real = T;
  using math = Functions;
  using vec3 = ksl::vec3<T>;
  using vec4 = ksl::vec4<T>;
  using quaternion = ksl::quaternion<T>;
  using mat3x3 = ksl::mat3x3<T>;
  using mat4x4 = ksl::mat4x4<T>;
  using SE3 = ksl::SE3<T>;
  using screw = ksl::screw<T>;
  using coscrew = ksl::coscrew<T>;
  using inertia = ksl::inertia<T>;
  using spatial_inertia = ksl::spatial_inertia<T>;
  using articulated_inertia = ksl::articulated_inertia<T>;
  using joint_space = ksl::joint_space<T>;
  using motion = ksl::motion<T>;
  using force = ksl::force<T>;
  using plucker = ksl::plucker<T>;

#define KSL_NAMES KSL_NAMES_TEMPLATE
#include "ksl/detail/names.h"
#include "ksl/detail/vec3.inc"
#include "ksl/detail/vec4.inc"
#include "ksl/detail/trig.inc"
#include "ksl/detail/mat3x3.inc"
#include "ksl/detail/rotation.inc"
#include "ksl/detail/matrix.inc"
#include "ksl/detail/SE3.inc"
#include "ksl/detail/mat4x4.inc"
#include "ksl/detail/exponential.inc"
#include "ksl/detail/jacobian.inc"
#include "ksl/detail/quaternion.inc"
#include "ksl/detail/screw.inc"
#include "ksl/detail/coscrew.inc"
#include "ksl/detail/inertia.inc"
#include "ksl/detail/spatial_inertia.inc"
#include "ksl/detail/articulated_inertia.inc"
#include "ksl/detail/matrix6.inc"
#include "ksl/detail/joint_space.inc"
#include "ksl/detail/plucker.inc"
#include "ksl/detail/poinsot.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"
};

} // namespace KSL_ISA
} // namespace ksl
