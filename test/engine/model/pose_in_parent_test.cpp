// Rotations about coordinate axes, and poses of bodies composed of them, against products with full matrices.
#include "ksl/engine/model/pose_in_parent.hpp"

#include "ksl/engine/model/joints.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <vector>

namespace {

using A = ksl::algebra<double>;
using rotation = ksl::plane_rotation<double>;
using vector = ksl::vec3<double>;
using matrix = ksl::mat3x3<double>;
constexpr matrix unit = {1, 0, 0, 0, 1, 0, 0, 0, 1};

struct numbers {
  std::mt19937 random{17};
  double number() { return std::normal_distribution<double>()(random); }
  rotation angle() {
    const double x = number();
    return {std::sin(x), std::cos(x)};
  }
  vector three() {
    const double x = number(), y = number(), z = number();
    return {x, y, z};
  }
  matrix axes() {
    double q[4] = {number(), number(), number(), number()};
    return ksl::rotation_of(q);
  }
  ksl::spatial_inertia<double> inertia() {
    return {number(), three(), number(), number(), number(), number(), number(), number()};
  }
};

/// The numbers of a struct of doubles differ by rounding at most.
template <class V> bool near(const V &x, const V &y) {
  const double *a = reinterpret_cast<const double *>(&x), *b = reinterpret_cast<const double *>(&y);
  for (std::size_t i = 0; i < sizeof(V) / sizeof(double); ++i)
    if (!(std::fabs(a[i] - b[i]) < 1e-12))
      return false;
  return true;
}

// Rx and Rz, element by element: the definition.
matrix about_x(const rotation &a) {
  matrix R = unit;
  R.m11 = a.cosine, R.m12 = -a.sine, R.m21 = a.sine, R.m22 = a.cosine;
  return R;
}
matrix about_z(const rotation &a) {
  matrix R = unit;
  R.m00 = a.cosine, R.m01 = -a.sine, R.m10 = a.sine, R.m11 = a.cosine;
  return R;
}
vector times(const matrix &R, const vector &v) {
  return {R.m00 * v.x + R.m01 * v.y + R.m02 * v.z, R.m10 * v.x + R.m11 * v.y + R.m12 * v.z,
          R.m20 * v.x + R.m21 * v.y + R.m22 * v.z};
}
vector times_back(const matrix &R, const vector &v) {
  return {R.m00 * v.x + R.m10 * v.y + R.m20 * v.z, R.m01 * v.x + R.m11 * v.y + R.m21 * v.z,
          R.m02 * v.x + R.m12 * v.y + R.m22 * v.z};
}
matrix of_columns(const vector &x, const vector &y, const vector &z) {
  return {x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z};
}
matrix times(const matrix &R, const matrix &Q) {
  return of_columns(times(R, vector{Q.m00, Q.m10, Q.m20}), times(R, vector{Q.m01, Q.m11, Q.m21}),
                    times(R, vector{Q.m02, Q.m12, Q.m22}));
}
matrix times_back(const matrix &R, const matrix &Q) { // R Qᵀ
  const vector x = {Q.m00, Q.m01, Q.m02}, y = {Q.m10, Q.m11, Q.m12}, z = {Q.m20, Q.m21, Q.m22};
  return of_columns(times(R, x), times(R, y), times(R, z));
}
/// R I Rᵀ of the second moments, and R h.
ksl::spatial_inertia<double> times(const matrix &R, const ksl::spatial_inertia<double> &I) {
  const matrix J = {I.Ixx, I.Ixy, I.Izx, I.Ixy, I.Iyy, I.Iyz, I.Izx, I.Iyz, I.Izz};
  const matrix K = times_back(times(R, J), R);
  return {I.m, times(R, I.h), K.m00, K.m11, K.m22, K.m10, K.m21, K.m20};
}

ksl::body<double> random_body(numbers &random, bool no_offset) {
  ksl::body<double> b{};
  b.no_offset = no_offset;
  b.offset = no_offset ? ksl::no_rotation : random.angle();
  b.alpha = random.angle();
  b.alpha_of_tensor = ksl::of_tensor(b.alpha);
  b.placement = {times(about_z(b.offset), about_x(b.alpha)), random.three()};
  return b;
}

/// The pose D, whose orientation is R, applied to everything that it can be applied to.
template <class Pose> void check_pose(const Pose &D, const matrix &R, numbers &random) {
  CHECK(near(D.axes(), R));
  const vector u = random.three(), v = random.three();
  vector a = u, b = v;
  D.to_parent(a, b);
  CHECK(near(a, times(R, u)));
  CHECK(near(b, times(R, v)));
  D.to_body(a, b);
  CHECK(near(a, u));
  CHECK(near(b, v));
  const ksl::spatial_inertia<double> I = random.inertia();
  ksl::spatial_inertia<double> J = I;
  D.to_parent(J);
  CHECK(near(J, times(R, I)));
  const matrix parent = random.axes();
  matrix axes = parent;
  D.rotate_axes(axes);
  CHECK(near(axes, times(parent, R)));
  D.rotate_axes_back(axes);
  CHECK(near(axes, parent));
  const ksl::SE3<double> world = {parent, random.three()}, body = ksl::composed(world, D);
  const vector moved = times(parent, D.t);
  CHECK(near(body.R, times(parent, R)));
  CHECK(near(body.t, vector{world.t.x + moved.x, world.t.y + moved.y, world.t.z + moved.z}));
  CHECK(near(ksl::composed_back(body, D), world));
}

} // namespace

TEST_CASE("rotations about coordinate axes are those of full matrices") {
  numbers random;
  for (int k = 0; k < 5; ++k) {
    const rotation a = random.angle(), b = random.angle();
    CHECK(near(about_z(ksl::product(a, b)), times(about_z(a), about_z(b))));
    CHECK(near(about_z(ksl::inverse(a)), of_columns({a.cosine, -a.sine, 0}, {a.sine, a.cosine, 0}, {0, 0, 1})));
    const vector v = random.three();
    vector x = v, z = v;
    ksl::rotate_x(a, x);
    ksl::rotate_z(a, z);
    CHECK(near(x, times(about_x(a), v)));
    CHECK(near(z, times(about_z(a), v)));
    x = z = v;
    ksl::rotate_back_x(a, x);
    ksl::rotate_back_z(a, z);
    CHECK(near(x, times_back(about_x(a), v)));
    CHECK(near(z, times_back(about_z(a), v)));
    const ksl::spatial_inertia<double> I = random.inertia();
    ksl::spatial_inertia<double> J = I, K = I;
    ksl::rotate_x(a, ksl::of_tensor(a), J);
    ksl::rotate_z(a, K);
    CHECK(near(J, times(about_x(a), I)));
    CHECK(near(K, times(about_z(a), I)));
  }
}

TEST_CASE("the pose of a body on an axis is Rz(offset) Rx(alpha) Rz(theta), with and without an offset") {
  numbers random;
  for (int k = 0; k < 6; ++k) {
    const ksl::body<double> b = random_body(random, k % 2 == 0);
    const rotation theta = random.angle();
    check_pose(ksl::axis_pose<double>{b, theta, random.three()}, times(b.placement.R, about_z(theta)), random);
  }
}

TEST_CASE("the pose of a body without an axis is any") {
  numbers random;
  for (int k = 0; k < 3; ++k) {
    const ksl::free_pose<double> D = {random.axes(), random.three()};
    check_pose(D, D.R, random);
  }
}
