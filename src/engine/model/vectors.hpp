// Vectors, twists and wrenches as values, for code that isn't of the inner loops of algorithms; the first of them over any scalar.
#pragma once

#include "ksl/algebra.hpp"

#include <type_traits>

namespace ksl::vectors {

template <class R> vec3<R> cross(const vec3<R> &a, const vec3<R> &b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class R> R dot(const vec3<R> &a, const vec3<R> &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
template <class R> vec3<R> sum(const vec3<R> &a, const vec3<R> &b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
template <class R> vec3<R> scaled(std::type_identity_t<R> s, const vec3<R> &a) { return {s * a.x, s * a.y, s * a.z}; }
inline vec3<double> difference(const vec3<double> &a, const vec3<double> &b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class R> R length(const vec3<R> &a) { return math<R>::sqrt(dot(a, a)); }
inline vec3<double> turned(const mat3x3<double> &R, const vec3<double> &x) {
  vec3<double> y;
  algebra<double>::product_drv(&R, &x, &y);
  return y;
}
inline vec3<double> turned_back(const mat3x3<double> &R, const vec3<double> &x) {
  vec3<double> y;
  algebra<double>::product_drinvv(&R, &x, &y);
  return y;
}
inline SE3<double> product(const SE3<double> &a, const SE3<double> &b) {
  SE3<double> c;
  algebra<double>::product_dd(&a, &b, &c);
  return c;
}
inline screw<double> screw_of(const double *x) { return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}}; }
inline screw<double> difference(const screw<double> &a, const screw<double> &b) {
  return {difference(a.lin, b.lin), difference(a.ang, b.ang)};
}
/// a × b of twists: (ω_a × v_b + v_a × ω_b, ω_a × ω_b)
inline screw<double> cross(const screw<double> &a, const screw<double> &b) {
  return {sum(cross(a.ang, b.lin), cross(a.lin, b.ang)), cross(a.ang, b.ang)};
}
/// Ad(D⁻¹) s = (Rᵀ (v + ω × t), Rᵀ ω).
/// A twist in world axes about the world's origin, at a frame and in its axes.
inline screw<double> at_frame(const SE3<double> &D, const screw<double> &s) {
  return {turned_back(D.R, sum(s.lin, cross(s.ang, D.t))), turned_back(D.R, s.ang)};
}
inline double work(const coscrew<double> &f, const screw<double> &s) { return dot(f.lin, s.lin) + dot(f.ang, s.ang); }
/// A bound of the terms of `work`, whatever the directions.
inline double magnitude(const coscrew<double> &f, const screw<double> &s) {
  return length(f.lin) * length(s.lin) + length(f.ang) * length(s.ang);
}
inline screw<double> scaled(double s, const screw<double> &a) { return {scaled(s, a.lin), scaled(s, a.ang)}; }
inline screw<double> sum(const screw<double> &a, const screw<double> &b) {
  return {sum(a.lin, b.lin), sum(a.ang, b.ang)};
}

} // namespace ksl::vectors
