#include "description/parts/rigid_pose.hpp"

#include "text/words.hpp"

#include <algorithm>
#include <cmath>

namespace ksl {

namespace {

/// The largest element of Rᵀ R − 1.
double distortion(const mat3x3<double> &R) {
  mat3x3<double> E;
  algebra<double>::product_drinvdr(&R, &R, &E);
  const double off[] = {E.m00 - 1, E.m11 - 1, E.m22 - 1, E.m10, E.m20, E.m21};
  double largest = 0;
  for (const double x : off)
    largest = std::isnan(x) ? x : std::max(largest, std::fabs(x));
  return largest;
}

double determinant(const mat3x3<double> &R) {
  const vec3<double> x = {R.m00, R.m10, R.m20}, y = {R.m01, R.m11, R.m21}, z = {R.m02, R.m12, R.m22};
  vec3<double> across;
  algebra<double>::cross_vv(&x, &y, &across);
  return algebra<double>::dot_vv(&across, &z);
}

/// R (3 − Rᵀ R) / 2: a step of Newton's iteration for the orthogonal factor (Higham, Functions of Matrices, 2008,
/// (8.20)).
mat3x3<double> nearer_rotation(const mat3x3<double> &R) {
  mat3x3<double> E, out;
  algebra<double>::product_drinvdr(&R, &R, &E);
  const mat3x3<double> half = {1.5 - E.m00 / 2, -E.m10 / 2, -E.m20 / 2, -E.m01 / 2,     1.5 - E.m11 / 2,
                               -E.m21 / 2,      -E.m02 / 2, -E.m12 / 2, 1.5 - E.m22 / 2};
  algebra<double>::product_drdr(&R, &half, &out);
  return out;
}

} // namespace

SE3<double> rigid_pose(const std::string &what, const SE3<double> &pose) {
  if (!(std::isfinite(pose.t.x) && std::isfinite(pose.t.y) && std::isfinite(pose.t.z)))
    text::refuse({}, 0, what + " is not finite; mend its numbers");
  const double off = distortion(pose.R);
  if (!(off <= 1e-6))
    text::refuse({}, 0,
                 what + " is not rigid, the columns of its rotation are not orthonormal by " + text::shown(off) +
                     "; give a rotation matrix and a translation in metres");
  if (determinant(pose.R) < 0)
    text::refuse({}, 0,
                 what + " is a reflection, the determinant of its rotation is −1; exchange the sign of one axis");
  SE3<double> rigid = pose;
  // it squares the error, ¾ E² for E = Rᵀ R − 1: 1e-6 becomes 1e-12, and then rounding
  if (off > 1e-14) // numbers of few digits, or of single precision
    rigid.R = nearer_rotation(nearer_rotation(rigid.R));
  return rigid;
}

} // namespace ksl
