// Each step of inverse kinematics against the damped least squares that it is said to be, written down once more with Jacobians and poses of
// other algorithms.
#include "inverse_kinematics_problems.hpp"
#include "matrices.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <utility>

namespace {

using namespace inverse_kinematics_problems;
using enum ksl::inverse_kinematics_end;

/// x of A x = b, by elimination with pivots.
numbers solved(numbers A, numbers b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t p = k;
    for (std::size_t i = k; i < n; ++i)
      p = std::fabs(A[i * n + k]) > std::fabs(A[p * n + k]) ? i : p;
    for (std::size_t j = 0; j < n; ++j)
      std::swap(A[k * n + j], A[p * n + j]);
    std::swap(b[k], b[p]);
    for (std::size_t i = 0; i < n; ++i)
      if (const double f = A[i * n + k] / A[k * n + k]; i != k) {
        for (std::size_t j = k; j < n; ++j)
          A[i * n + j] -= f * A[k * n + j];
        b[i] -= f * b[k];
      }
  }
  for (std::size_t k = 0; k < n; ++k)
    b[k] /= A[k * n + k];
  return b;
}

/// The step (Jᵀ J + λ) x = Jᵀ e, λ being a fifth of the squared error, of 1 rad or m at most; joints stay within limits.
numbers stepped(const ksl::model &m, const problem &p, const numbers &q, const double *target) {
  errors x = errors_at(m, p, q, target);
  const std::size_t n = static_cast<std::size_t>(m.nv()), rows = x.e.size();
  const ksl::model_view<double> view = m.view();
  if (p.limits) // of joints whose positions have as many numbers as their velocities
    for (std::size_t c = 0; c < n; ++c) {
      if (std::count(p.free.begin(), p.free.end(), c) || std::count(p.turning.begin(), p.turning.end(), c))
        continue;
      double slope = 0;
      for (std::size_t r = 0; r < rows; ++r)
        slope += x.J[r * n + c] * x.e[r];
      if ((q[c] <= view.lower[c] && slope < 0) || (q[c] >= view.upper[c] && slope > 0))
        for (std::size_t r = 0; r < rows; ++r)
          x.J[r * n + c] = 0;
    }
  const numbers transposed = matrices::transposed(x.J, rows);
  numbers A = matrices::product(transposed, x.J, rows);
  double trace = 0;
  for (std::size_t i = 0; i < n; ++i)
    trace += A[i * n + i];
  const double epsilon = 0x1p-52;
  for (std::size_t i = 0; i < n; ++i)
    A[i * n + i] += 0.2 * x.cost + 64 * epsilon * trace + epsilon;
  numbers step = solved(A, matrices::product(transposed, x.e, rows)), moved(q.size());
  double longest = 1;
  for (double each : step)
    longest = std::fmax(longest, std::fabs(each));
  for (double &each : step)
    each /= longest;
  ksl::data d(m);
  ksl::integrate(m, d, q.data(), step.data(), moved.data());
  const double turn = 2 * std::acos(-1.0);
  for (std::size_t c : p.turning)
    moved[c] += moved[c] >= view.upper[c] ? -turn : moved[c] <= view.lower[c] ? turn : 0;
  if (p.limits)
    for (std::size_t c = 0; c < n; ++c)
      moved[c] = std::fmin(std::fmax(moved[c], view.lower[c]), view.upper[c]);
  return moved;
}

/// Positions after one, two and three steps, their errors, and what is said about them, for all targets at once.
void check_steps(const ksl::model &m, const problem &p, double tolerance = 1e-9) {
  const numbers targets = targets_of(m, p);
  const std::size_t stride = 16 * p.frames.size();
  std::vector<numbers> expected = p.start;
  for (int steps = 1; steps <= 3; ++steps) {
    const solution s = solve(m, p, targets, limited_to(steps));
    for (std::size_t k = 0; k < p.start.size(); ++k) {
      expected[k] = stepped(m, p, expected[k], &targets[k * stride]);
      for (std::size_t i = 0; i < expected[k].size(); ++i)
        CHECK(std::fabs(s.q[k][i] - expected[k][i]) < tolerance);
      const errors left = errors_at(m, p, s.q[k], &targets[k * stride]);
      CHECK(s.error[2 * k] == doctest::Approx(left.position).epsilon(1e-9));
      CHECK(s.error[2 * k + 1] == doctest::Approx(left.orientation).epsilon(1e-9));
      const bool near_enough = left.position <= 1e-6 && left.orientation <= 1e-6;
      CHECK((s.end[k] == static_cast<int>(converged)) == near_enough);
      CHECK((s.starts[k] == 1 && (near_enough || s.iterations[k] == steps)));
    }
  }
}

} // namespace

TEST_CASE(
    "steps of inverse kinematics are damped least squares: chains with less, as many and more joints than errors") {
  for (int joints : {3, 5, 6, 7, 9}) {
    const ksl::model m(chain(joints));
    check_steps(m, {{{joints, 1, 1}}, positions(m, 11, 0.5, 0), positions(m, 11, 0.9, 1)});
    check_steps(m, {{{joints, 0.3, 2}}, positions(m, 3, 0.5, 2), positions(m, 3, 0.2, 1)});
  }
  const ksl::model m(chain(7));
  check_steps(m, {{{7, 0, 1}}, positions(m, 3, 0.5, 0), positions(m, 3, 0.9, 1)});
  check_steps(m, {{{6, 1, 0}}, positions(m, 3, 0.5, 0), positions(m, 3, 0.9, 1)});
}

TEST_CASE("steps of inverse kinematics are damped least squares: two frames, of which joints move one or both") {
  for (int joints : {7, 15}) {
    const ksl::model m(chain(joints));
    check_steps(m, {{{joints, 1, 1}, {joints / 2, 0.5, 0.7}}, positions(m, 3, 0.4, 0), positions(m, 3, 0.9, 1)});
  }
}

TEST_CASE("steps of inverse kinematics are damped least squares: every kind of joint, joints that follow others") {
  for (const char *path : {every_kind_file, coupled_file}) {
    const ksl::model m = ksl::load(path);
    const int links = static_cast<int>(m.links().size());
    for (int link : {links - 1, links / 2})
      check_steps(m, {{{link, 1, 1}}, positions(m, 5, 0.3, 0), positions(m, 5, 0.4, 1)});
  }
}

TEST_CASE("steps of inverse kinematics are damped least squares: joints that limits hold") {
  const ksl::model m(chain(7, -0.4, 0.6));
  problem p = {{{7, 1, 1}}, positions(m, 9, 0.35, 0), positions(m, 9, 1.5, 1), true};
  for (std::size_t k = 0; k < p.start.size(); ++k) // some begin at a limit
    for (std::size_t joint : {k % 7, (k + 3) % 7})
      p.start[k][joint] = (k + joint) % 2 ? m.view().lower[joint] : m.view().upper[joint];
  check_steps(m, p);
  const solution to_the_end = solve(m, p, targets_of(m, p), limited_to(40, 3));
  for (std::size_t k = 0; k < p.start.size(); ++k)
    for (std::size_t i = 0; i < 7; ++i)
      CHECK((to_the_end.q[k][i] >= m.view().lower[i] && to_the_end.q[k][i] <= m.view().upper[i]));
}

TEST_CASE("steps of inverse kinematics are damped least squares: limits of joints with several numbers") {
  const ksl::model m(several_numbers());
  problem p = {{{6, 1, 1}}, positions(m, 12, 0.19, 0), positions(m, 12, 0.8, 1), true, {5, 6}};
  for (std::size_t k = 0; k < p.start.size(); ++k)
    p.start[k][k] = m.view().upper[k], p.start[k][(k + 5) % 12] = m.view().lower[(k + 5) % 12];
  check_steps(m, p);
}

TEST_CASE(
    "steps of inverse kinematics are damped least squares: joints with a whole turn between their limits, and with less") {
  ksl::robot_description r = chain(4, -3.3, 3.3);
  r.joints[0].lower = -0.5, r.joints[0].upper = 0.4;
  r.joints[3].lower = -2, r.joints[3].upper = 3.2;
  const ksl::model m(r);
  problem p = {{{4, 1, 1}}, positions(m, 8, 0.3, 0), positions(m, 8, 0.6, 1), true, {}, {1, 2}};
  for (std::size_t k = 0; k < 8; ++k) {
    const std::size_t joint = 1 + k % 2, other = k % 3 ? 3 : 0;
    const bool up = k / 2 % 2;
    p.start[k][joint] = up ? m.view().upper[joint] - 0.01 : m.view().lower[joint] + 0.01;
    p.goal[k][joint] = p.start[k][joint] + (up ? 0.3 : -0.3);
    p.start[k][other] = k % 4 ? m.view().upper[other] : m.view().lower[other];
  }
  check_steps(m, p);
  // A leader doesn't go on at its other limit: its followers would jump.
  r.joints[2].mimic = {r.joints[1].name, 0.25, 0.1, {}};
  const ksl::model coupled(r);
  p = {{{4, 1, 1}},
       {{0.1, 3.29, 0.5}, {0.1, -3.3, 0.5}, {0.4, 3.1, 3.2}},
       {{0.2, 3.6, 0.4}, {0, -3.5, 0.4}, {0.3, 3.5, 3}},
       true};
  const solution s = solve(coupled, p, targets_of(coupled, p), limited_to(3));
  for (std::size_t k = 0; k < p.start.size(); ++k) {
    CHECK((s.end[k] == static_cast<int>(iterations) || s.end[k] == static_cast<int>(limits)));
    CHECK(std::fabs(s.q[k][1]) > 3); // it stays at that end
  }
}

TEST_CASE("a step that would turn a joint by more than a radian is shortened") {
  const ksl::model m(chain(1));
  const problem p = {{{1, 0, 1}}, {{-1.4}, {-1.4}, {1.3}, {0.4}}, {{1.6}, {-1.2}, {-1.7}, {0.3}}};
  check_steps(m, p, 1e-8);
  CHECK(solve(m, p, targets_of(m, p), limited_to(1)).q[0][0] == doctest::Approx(-0.4).epsilon(1e-14));
}

TEST_CASE("limits of joints that follow others are those of their leaders") {
  const auto ends_at = [](double multiplier, double goal) {
    ksl::robot_description r = chain(4, -1, 1);
    for (std::size_t k : {1u, 3u}) { // 1 follows 0, 3 follows 2
      r.joints[k].mimic = {r.joints[k - 1].name, multiplier, 0.1 * static_cast<double>(k), {}};
      r.joints[k].lower = -0.2 * static_cast<double>(k), r.joints[k].upper = 0.3 * static_cast<double>(k);
    }
    const ksl::model m(r);
    problem p = {{{4, 1, 1}}, {{0.05, 0.02}}, {{goal, goal}}, true};
    return solve(m, p, targets_of(m, p), limited_to(60)).q[0];
  };
  // For -0.2 ≤ f q + 0.1 ≤ 0.3 and -0.6 ≤ f q + 0.3 ≤ 0.9 the leaders are between -0.15 and 0.1, and between -0.45 and 0.3, where f is 2.
  for (double f : {2.0, -2.0})
    for (double far : {0.9, -0.9}) {
      const numbers q = ends_at(f, far);
      for (std::size_t i = 0; i < 2; ++i) {
        const double lower = f > 0 ? i ? -0.45 : -0.15
                             : i   ? -0.3
                                   : -0.1,
                     upper = f > 0 ? i ? 0.3 : 0.1
                             : i   ? 0.45
                                   : 0.15;
        CHECK((std::fabs(q[i] - lower) < 1e-12 || std::fabs(q[i] - upper) < 1e-12)); // all are held at one end
      }
    }
  CHECK(ends_at(2, 0.9)[0] > 0);
  CHECK(ends_at(2, -0.9)[0] < 0);
}

TEST_CASE("a joint with a whole turn between its limits goes on at the other one") {
  const ksl::model m(chain(1, -3.2, 3.2));
  problem p = {{{1, 1, 1}}, {{3.1}, {-3.15}, {3.2}, {-3.2}, {0.1}}, {{-2.9}, {2.6}, {-2.8}, {3.0}, {0.2}}, true};
  const solution s = solve(m, p, targets_of(m, p), limited_to(40));
  for (std::size_t k = 0; k < p.start.size(); ++k) {
    CHECK(s.end[k] == static_cast<int>(converged));
    CHECK(s.iterations[k] < 12);
    CHECK(s.q[k][0] == doctest::Approx(p.goal[k][0]).epsilon(1e-5));
  }
  const ksl::model less(chain(1, -3.0, 3.0)); // with less it does where the same orientation is within the limits
  p.start = {{2.9}, {2.9}, {-2.9}}, p.goal = {{-2.9}, {3.1}, {-3.1}};
  const solution held = solve(less, p, targets_of(less, p), limited_to(40));
  CHECK((held.end[0] == static_cast<int>(converged) && held.end[1] == static_cast<int>(limits) &&
         held.end[2] == static_cast<int>(limits)));
  CHECK((held.q[0][0] == doctest::Approx(-2.9).epsilon(1e-5) && held.q[1][0] == 3 && held.q[2][0] == -3));
}

TEST_CASE("the vector of a rotation is 2 sin(θ/2) times its axis, up to half a turn") {
  for (int k = 0; k < 60; ++k) {
    ksl::vec3<double> n = {std::sin(1.0 + k), std::sin(2.0 + 2.1 * k), std::sin(3.0 + 3.3 * k)};
    if (k < 6) // along x, y and z, to both sides
      n = {k / 2 == 0 ? 1.0 - k % 2 * 2 : 0, k / 2 == 1 ? 1.0 - k % 2 * 2 : 0, k / 2 == 2 ? 1.0 - k % 2 * 2 : 0};
    const double length = std::hypot(n.x, n.y, n.z);
    n = {n.x / length, n.y / length, n.z / length};
    for (double angle : {0.0, 1e-9, 1e-3, 0.7, 2.0, 3.0, 3.139, 3.1405, 3.14159265358979}) {
      const double c = std::cos(angle), s = std::sin(angle), w = 1 - c; // Rodrigues
      const ksl::mat3x3<double> R = {c + w * n.x * n.x,       w * n.x * n.y + s * n.z, w * n.x * n.z - s * n.y,
                                     w * n.x * n.y - s * n.z, c + w * n.y * n.y,       w * n.y * n.z + s * n.x,
                                     w * n.x * n.z + s * n.y, w * n.y * n.z - s * n.x, c + w * n.z * n.z};
      const ksl::vec3<double> found = ksl::half_sine_vector(R);
      const double size = 2 * std::sin(angle / 2),
                   sign = found.x * n.x + found.y * n.y + found.z * n.z < 0 && angle > 3.14 ? -1 : 1;
      const double off =
          std::hypot(sign * found.x - size * n.x, sign * found.y - size * n.y, sign * found.z - size * n.z);
      CHECK(off < (angle < 3.14    ? 1e-12 + 1e-15 / (c + 1)
                   : angle < 3.141 ? 3e-3
                                   : 1e-12)); // near it as if it were half a turn
    }
  }
}
