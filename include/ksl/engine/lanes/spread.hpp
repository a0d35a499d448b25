// KSL: converts constants to another scalar.  A model holds plain numbers.  For packs the conversion is a broadcast to all lanes;
// for plain numbers of the same precision it costs nothing.
#pragma once

#include "ksl/pack.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T, class S> KSL_LANES vec3<T> spread(const vec3<S> &v) { return {T(v.x), T(v.y), T(v.z)}; }

template <class T, class S> KSL_LANES mat3x3<T> spread(const mat3x3<S> &R) {
  return {T(R.m00), T(R.m10), T(R.m20), T(R.m01), T(R.m11), T(R.m21), T(R.m02), T(R.m12), T(R.m22)};
}

template <class T, class S> KSL_LANES SE3<T> spread(const SE3<S> &D) { return {spread<T>(D.R), spread<T>(D.t)}; }

template <class T, class S> KSL_LANES spatial_inertia<T> spread(const spatial_inertia<S> &I) {
  return {T(I.m), spread<T>(I.h), T(I.Ixx), T(I.Iyy), T(I.Izz), T(I.Ixy), T(I.Iyz), T(I.Izx)};
}

} // namespace KSL_ISA
} // namespace ksl
