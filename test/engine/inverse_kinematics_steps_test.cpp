// Each step of inverse kinematics against the damped least squares that it is said to be, written down once more with Jacobians and poses of
// other algorithms; random starts, and how attempts end.
#include "ksl/inverse_kinematics.hpp"
#include "robots.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

namespace {

using numbers = std::vector<double>;
using enum ksl::inverse_kinematics_end;

struct problem {
  std::vector<ksl::wanted_frame> frames;
  std::vector<numbers> start, goal; ///< rows of nq; targets are the poses at the goals
  bool limits = false;
  std::vector<std::size_t> free = {}; ///< coordinates that no limit holds: those of a planar joint before its angle
  std::vector<std::size_t> turning = {}; ///< coordinates with a whole turn between their limits, which go on at the other one
};

struct solution {
  std::vector<numbers> q;
  numbers error; ///< (n, 2)
  std::vector<int> end, iterations, starts;
};

void append_pose(const ksl::SE3<double> &D, numbers &out) {
  for (int r = 0; r < 3; ++r) {
    const double *const R = &D.R.m00, *const t = &D.t.x; // by columns
    out.insert(out.end(), {R[r], R[r + 3], R[r + 6], t[r]});
  }
  out.insert(out.end(), {0, 0, 0, 1});
}

numbers targets_of(const ksl::model &m, const problem &p) {
  ksl::data d(m);
  numbers poses;
  for (const numbers &goal : p.goal)
    for (const ksl::wanted_frame &f : p.frames)
      append_pose(ksl::frame_pose(m, d, goal.data(), f.link), poses);
  return poses;
}

solution solve(const ksl::model &m, const problem &p, const numbers &targets, ksl::inverse_kinematics_options options) {
  const std::size_t n = targets.size() / 16 / p.frames.size(), nq = static_cast<std::size_t>(m.nq());
  numbers start, q(n * nq, NAN);
  for (const numbers &row : p.start)
    start.insert(start.end(), row.begin(), row.end());
  solution s;
  s.error.assign(2 * n, NAN), s.end.assign(n, -1), s.iterations.assign(n, -1), s.starts.assign(n, -1);
  options.frames_n = static_cast<int>(p.frames.size()), options.frames = p.frames.data(), options.limits = p.limits;
  ksl::inverse_kinematics_batch<double> batch;
  batch.n = n, batch.target = {targets.data(), static_cast<std::ptrdiff_t>(16 * p.frames.size())}, batch.q = {q.data(), m.nq()};
  if (!start.empty())
    batch.start = {start.data(), m.nq()};
  batch.error = {s.error.data(), 2}, batch.end = s.end.data(), batch.iterations = s.iterations.data(), batch.starts = s.starts.data();
  ksl::inverse_kinematics(m, options, batch, 1);
  for (std::size_t k = 0; k < n; ++k)
    s.q.emplace_back(q.begin() + static_cast<std::ptrdiff_t>(k * nq), q.begin() + static_cast<std::ptrdiff_t>((k + 1) * nq));
  return s;
}

ksl::inverse_kinematics_options limited_to(int iterations, int starts = 1) {
  ksl::inverse_kinematics_options o;
  o.iterations = iterations, o.starts = starts;
  return o;
}

/// The length of the chain that carries a link, from joint to joint.
double length_to(const ksl::model &m, int link) {
  double length = 0;
  ksl::vec3<double> t = {0, 0, 0};
  for (int j = m.joint_above(link); j >= 0 && m.joints()[static_cast<std::size_t>(j)].description >= 0; j = m.joint_above(link)) {
    const ksl::joint_row &row = m.joints()[static_cast<std::size_t>(j)];
    const ksl::SE3<double> &at = m.description().joints[static_cast<std::size_t>(row.description)].placement;
    const ksl::mat3x3<double> &R = at.R;
    if (row.kind == ksl::joint_kind::fixed) {
      t = {R.m00 * t.x + R.m01 * t.y + R.m02 * t.z + at.t.x, R.m10 * t.x + R.m11 * t.y + R.m12 * t.z + at.t.y,
           R.m20 * t.x + R.m21 * t.y + R.m22 * t.z + at.t.z};
    } else {
      length += std::hypot(t.x, t.y, t.z);
      t = at.t;
    }
    link = row.parent_link;
  }
  return length + std::hypot(t.x, t.y, t.z);
}

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

/// 2 sin(θ/2) times the axis of a rotation by less than half a turn.
std::array<double, 3> turn_of(const ksl::mat3x3<double> &R) {
  const std::array<double, 3> sines = {R.m21 - R.m12, R.m02 - R.m20, R.m10 - R.m01}; // 2 sin θ times the axis
  const double sine = std::hypot(sines[0], sines[1], sines[2]) / 2, angle = std::atan2(sine, (R.m00 + R.m11 + R.m22 - 1) / 2);
  const double scale = sine > 0 ? std::sin(angle / 2) / sine : 0;
  return {scale * sines[0], scale * sines[1], scale * sines[2]};
}

struct errors {
  numbers J, e; ///< weighted: rows of 6 for each frame, with a column for each coordinate; and the errors
  double position = 0, orientation = 0, cost = 0;
};

errors errors_at(const ksl::model &m, const problem &p, const numbers &q, const double *target) {
  ksl::data d(m);
  errors out;
  for (const ksl::wanted_frame &f : p.frames) {
    const ksl::SE3<double> at = ksl::frame_pose(m, d, q.data(), f.link);
    ksl::SE3<double> wanted = {{target[0], target[4], target[8], target[1], target[5], target[9], target[2], target[6], target[10]},
                               {target[3], target[7], target[11]}}, D;
    target += 16;
    ksl::algebra<double>::product_dinvd(&at, &wanted, &D);
    const double weight[2] = {f.position_weight * 20 / length_to(m, f.link), f.orientation_weight};
    const std::array<double, 3> turn = turn_of(D.R);
    const double e[6] = {D.t.x, D.t.y, D.t.z, turn[0], turn[1], turn[2]};
    numbers J(static_cast<std::size_t>(6 * m.nv()));
    ksl::jacobian(m, d, q.data(), f.link, {}, J.data());
    for (std::size_t i = 0; i < J.size(); ++i)
      out.J.push_back(weight[i >= J.size() / 2] * J[i]);
    for (int i = 0; i < 6; ++i)
      out.e.push_back(weight[i / 3] * e[i]), out.cost += out.e.back() * out.e.back();
    if (f.position_weight > 0)
      out.position = std::fmax(out.position, std::hypot(e[0], e[1], e[2]));
    if (f.orientation_weight > 0)
      out.orientation = std::fmax(out.orientation, std::hypot(e[3], e[4], e[5]));
  }
  return out;
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
  numbers A(n * n), b(n);
  double trace = 0;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t r = 0; r < rows; ++r) {
      b[i] += x.J[r * n + i] * x.e[r];
      trace += x.J[r * n + i] * x.J[r * n + i];
      for (std::size_t j = 0; j < n; ++j)
        A[i * n + j] += x.J[r * n + i] * x.J[r * n + j];
    }
  const double epsilon = 0x1p-52;
  for (std::size_t i = 0; i < n; ++i)
    A[i * n + i] += 0.2 * x.cost + 64 * epsilon * trace + epsilon;
  numbers step = solved(A, b), moved(q.size());
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

/// Positions that differ from state to state, all joints moved.
std::vector<numbers> positions(const ksl::model &m, int n, double wide, double phase) {
  std::vector<numbers> all;
  for (int k = 0; k < n; ++k) {
    numbers q(static_cast<std::size_t>(m.nq()));
    ksl::neutral(m, q.data());
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] += wide * std::sin(phase + 1.7 * k + 0.9 * static_cast<double>(i * i));
    robots::normalize_quaternions(m, q.data());
    all.push_back(q);
  }
  return all;
}

/// A chain of hinges that turn about x, y and z by turns, with limits.
ksl::robot_description chain(int joints, double lower = -2, double upper = 2.5) {
  ksl::robot_description r;
  r.links.push_back(robots::link("ground"));
  for (int k = 0; k < joints; ++k) {
    r.links.push_back(robots::link(("link" + std::to_string(k)).c_str(), robots::solid(1, {0.1, 0, 0}, 0.1, 0.1, 0.1)));
    const double axis[5] = {0, 0, 1, 0, 0};
    r.joints.push_back(robots::joint(("joint" + std::to_string(k)).c_str(), ksl::joint_kind::revolute, k, k + 1, {0.1, 0.2, 0.3 - 0.02 * k},
                                     {axis[2 - k % 3], axis[3 - k % 3], axis[4 - k % 3]}));
    r.joints.back().lower = lower - 0.01 * k, r.joints.back().upper = upper + 0.02 * k;
  }
  return r;
}

/// A chain of joints with one to three numbers, each with limits of its own.
ksl::robot_description several_numbers() {
  using enum ksl::joint_kind;
  ksl::robot_description r = chain(6, -0.3, 0.4);
  const ksl::joint_kind kinds[6] = {revolute, cylindrical, universal, planar, translation, prismatic};
  for (std::size_t k = 0; k < 6; ++k) {
    ksl::joint_description &j = r.joints[k];
    j.kind = kinds[k];
    j.axis2 = {j.axis.y, j.axis.z, j.axis.x};
    const int numbers = ksl::row_of(j.kind).nq;
    for (int c = 1; c < numbers; ++c)
      j.further[static_cast<std::size_t>(c - 1)] = {-0.2 - 0.03 * c, 0.25 + 0.04 * c};
  }
  return r;
}

} // namespace

TEST_CASE("steps of inverse kinematics are damped least squares: chains with less, as many and more joints than errors") {
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
  for (const char *path : {KSL_EVERY_KIND, KSL_COUPLED}) {
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

TEST_CASE("steps of inverse kinematics are damped least squares: joints with a whole turn between their limits, and with less") {
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
  p = {{{4, 1, 1}}, {{0.1, 3.29, 0.5}, {0.1, -3.3, 0.5}, {0.4, 3.1, 3.2}}, {{0.2, 3.6, 0.4}, {0, -3.5, 0.4}, {0.3, 3.5, 3}}, true};
  for (const numbers &start : p.start) { // limits of a user's numbers are those of the expanded ones: the follower's are wide
    problem one = {p.frames, {start}, {p.goal[static_cast<std::size_t>(&start - p.start.data())]}, true};
    const solution s = solve(coupled, one, targets_of(coupled, one), limited_to(3));
    CHECK((s.end[0] == static_cast<int>(iterations) || s.end[0] == static_cast<int>(limits)));
    CHECK(std::fabs(s.q[0][1]) > 3); // it stays at that end
  }
}

TEST_CASE("starts beyond the limits begin at the limits, each number at its own") {
  const ksl::model m(several_numbers());
  problem p = {{{6, 1, 1}}, {numbers(12, 5), numbers(12, -5), numbers(12, 0.01)}, {numbers(12), numbers(12), numbers(12)}, true};
  const solution s = solve(m, p, targets_of(m, p), limited_to(0));
  for (std::size_t i = 0; i < 12; ++i)
    CHECK((s.q[0][i] == m.view().upper[i] && s.q[1][i] == m.view().lower[i] && s.q[2][i] == 0.01));
  p.limits = false;
  CHECK(solve(m, p, targets_of(m, p), limited_to(0)).q[0] == p.start[0]);
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
        const double lower = f > 0 ? i ? -0.45 : -0.15 : i ? -0.3 : -0.1, upper = f > 0 ? i ? 0.3 : 0.1 : i ? 0.45 : 0.15;
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
  CHECK((held.end[0] == static_cast<int>(converged) && held.end[1] == static_cast<int>(limits) && held.end[2] == static_cast<int>(limits)));
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
      const ksl::mat3x3<double> R = {c + w * n.x * n.x, w * n.x * n.y + s * n.z, w * n.x * n.z - s * n.y, w * n.x * n.y - s * n.z, c + w * n.y * n.y,
                                     w * n.y * n.z + s * n.x, w * n.x * n.z + s * n.y, w * n.y * n.z - s * n.x, c + w * n.z * n.z};
      const ksl::vec3<double> found = ksl::half_sine_vector(R);
      const double size = 2 * std::sin(angle / 2), sign = found.x * n.x + found.y * n.y + found.z * n.z < 0 && angle > 3.14 ? -1 : 1;
      const double off = std::hypot(sign * found.x - size * n.x, sign * found.y - size * n.y, sign * found.z - size * n.z);
      CHECK(off < (angle < 3.14 ? 1e-12 + 1e-15 / (c + 1) : angle < 3.141 ? 3e-3 : 1e-12)); // near it as if it were half a turn
    }
  }
}

TEST_CASE("attempts end: after 8 steps without progress, at the number of iterations, at once where the target is no number") {
  const ksl::model m(robots::pendulum(1, 0.5)); // turns about y, hangs down
  problem p = {{{1, 1, 0}}, {{0.0}}, {{0.0}}, false};
  numbers beside = targets_of(m, p);
  beside[7] = 0.1; // beside the plane of its motion: the nearest point is where it starts
  solution s = solve(m, p, beside, limited_to(40));
  CHECK((s.end[0] == static_cast<int>(stuck) && s.iterations[0] == 8 && s.starts[0] == 1));
  CHECK(s.error[0] == doctest::Approx(0.1).epsilon(1e-14));
  s = solve(m, p, beside, limited_to(7));
  CHECK((s.end[0] == static_cast<int>(iterations) && s.iterations[0] == 7));
  s = solve(m, p, beside, limited_to(40, 4));
  CHECK((s.end[0] == static_cast<int>(stuck) && s.starts[0] == 4 && s.iterations[0] >= 4 * 8));
  beside[7] = NAN;
  s = solve(m, p, beside, limited_to(40));
  CHECK((s.end[0] == static_cast<int>(stuck) && s.iterations[0] == 0));
  p.frames[0] = {1, 0, 1}; // positions don't count, so the orientation's distance is all
  p.start = {{1.2}};
  s = solve(m, p, beside, limited_to(40));
  CHECK(s.iterations[0] == 0); // a target that is no number is none even there
}

TEST_CASE("attempts end at limits only if a joint is at one, and limits count") {
  const ksl::model m(chain(2, -1, 1));
  problem p = {{{2, 1, 1}}, {{0.1, 0.2}, {0.1, 0.2}}, {{0.2, 1.6}, {1.5, 0.1}}, true};
  solution s = solve(m, p, targets_of(m, p), limited_to(60));
  CHECK((s.end[0] == static_cast<int>(limits) && s.end[1] == static_cast<int>(limits)));
  CHECK((s.q[0][1] == m.view().upper[1] && std::fabs(s.q[0][0]) < 0.99 && s.q[1][0] == 1 && std::fabs(s.q[1][1]) < 0.99));
  p.limits = false;
  numbers beside = targets_of(m, p);
  for (std::size_t k : {0u, 16u})
    beside[k + 7] += 0.3; // out of reach, and past the limits
  s = solve(m, p, beside, limited_to(60));
  CHECK((s.end[0] == static_cast<int>(stuck) && s.q[0][1] > 1.1));
}

TEST_CASE("of several attempts the best one is kept") {
  const ksl::model m(chain(4));
  problem p = {{{4, 1, 1}}, {}, positions(m, 12, 1, 1), true};
  numbers beyond = targets_of(m, p);
  for (std::size_t k = 0; k < beyond.size(); k += 16)
    beyond[k + 3] += 0.4;
  const auto cost_of = [&](const solution &s, std::size_t k) { return errors_at(m, p, s.q[k], &beyond[16 * k]).cost; };
  int better = 0;
  solution before = solve(m, p, beyond, limited_to(15));
  for (int starts = 2; starts < 7; ++starts) {
    const solution s = solve(m, p, beyond, limited_to(15, starts));
    for (std::size_t k = 0; k < s.q.size(); ++k) {
      CHECK((s.starts[k] == starts && cost_of(s, k) <= cost_of(before, k)));
      better += cost_of(s, k) < 0.99 * cost_of(before, k);
    }
    before = s;
  }
  CHECK(better > 5);
}

TEST_CASE("tolerances: errors at the tolerance are small enough, errors beyond it are not") {
  const ksl::model m(chain(6));
  const problem p = {{{6, 1, 1}}, positions(m, 1, 0.4, 0), positions(m, 1, 0.41, 0)};
  const numbers targets = targets_of(m, p);
  const errors e = errors_at(m, p, p.start[0], targets.data());
  for (const auto &[position, orientation, ends] : {std::tuple{1.001, 1.001, true}, {0.999, 1.001, false}, {1.001, 0.999, false}}) {
    ksl::inverse_kinematics_options o = limited_to(40);
    o.position_tolerance = position * e.position, o.orientation_tolerance = orientation * e.orientation;
    const solution s = solve(m, p, targets, o);
    CHECK((s.end[0] == static_cast<int>(converged) && (s.iterations[0] == 0) == ends));
    CHECK((s.error[0] <= o.position_tolerance && s.error[1] <= o.orientation_tolerance));
  }
}

TEST_CASE("random starts are uniform within limits, and further ones lie in other halves of the ranges") {
  constexpr int joints = 7;
  constexpr double lower = -2, upper = 2.5;
  ksl::robot_description r = chain(joints);
  for (ksl::joint_description &j : r.joints)
    j.lower = lower, j.upper = upper;
  const ksl::model m(r);
  problem p = {{{joints, 1, 1}}, {}, std::vector<numbers>(1500, numbers(joints)), true};
  const numbers anywhere = targets_of(m, p);
  const solution first = solve(m, p, anywhere, limited_to(0));
  double mean[joints] = {}, product[joints][joints] = {};
  for (const numbers &q : first.q)
    for (std::size_t i = 0; i < joints; ++i) {
      REQUIRE((q[i] >= lower && q[i] < upper));
      mean[i] += (q[i] - 0.25) / 4.5 / 1500;
      for (std::size_t j = 0; j < joints; ++j)
        product[i][j] += (q[i] - 0.25) * (q[j] - 0.25) / (4.5 * 4.5) / 1500;
    }
  for (int i = 0; i < joints; ++i)
    for (int j = 0; j < joints; ++j) {
      CHECK(std::fabs(mean[i]) < 0.03); // four standard deviations
      CHECK(std::fabs(product[i][j] - (i == j ? 1 / 12.0 : 0)) < 0.01);
    }
  // In halves[turn][pair of coordinates], a half of the range further; and a bit further each time.
  const double halves[5][3] = {{0, 0, 0}, {0.5, 0, 0.5}, {0, 0.5, 0.5}, {0.5, 0.5, 0}, {0, 0, 0}};
  for (int turn = 1; turn < 5; ++turn) {
    for (std::size_t k = 0; k < 20; ++k)
      for (std::size_t i = 0; i < joints; ++i) {
        const double x = (first.q[k][i] - lower) / (upper - lower) + 0.07 * turn + halves[turn][i / 2 % 3];
        p.goal[k][i] = lower + (upper - lower) * (x - std::floor(x));
      }
    const solution further = solve(m, p, targets_of(m, p), limited_to(0, turn + 1));
    for (std::size_t k = 0; k < 20; ++k) {
      CHECK((further.end[k] == static_cast<int>(converged) && further.starts[k] == turn + 1));
      for (std::size_t i = 0; i < joints; ++i)
        CHECK(further.q[k][i] == doctest::Approx(p.goal[k][i]).epsilon(1e-9));
    }
  }
  for (std::size_t k = 0; k < 16; ++k)
    for (std::size_t l = 0; l < k; ++l)
      CHECK(first.q[k] != first.q[l]);
  ksl::inverse_kinematics_options seeded = limited_to(0);
  seeded.seed = 1;
  CHECK(solve(m, p, anywhere, seeded).q[0] != first.q[0]);
}

TEST_CASE("random starts without limits, and from a start that is given: up to half a turn, or pi metres, to both sides") {
  constexpr int joints = 6, n = 1500;
  const double pi = std::acos(-1.0);
  const ksl::model bounded(chain(joints, -3.3, 3.4));
  const auto check_uniform = [&](const std::vector<numbers> &all) {
    for (std::size_t i = 0; i < all[0].size(); ++i) {
      double mean = 0, square = 0;
      for (const numbers &q : all) {
        REQUIRE(std::fabs(q[i]) <= pi);
        mean += q[i] / n, square += q[i] * q[i] / n;
      }
      CHECK(std::fabs(mean) < 0.19); // four standard deviations
      CHECK(std::fabs(square - pi * pi / 3) < 0.31);
    }
  };
  problem p = {{{joints, 1, 1}}, {}, std::vector<numbers>(n, numbers(joints)), true};
  const numbers anywhere = targets_of(bounded, p);
  check_uniform(solve(bounded, p, anywhere, limited_to(0)).q); // within a turn, although the limits are further apart
  p.limits = false;
  const std::vector<numbers> first = solve(bounded, p, anywhere, limited_to(0)).q;
  check_uniform(first);
  const double halves[3] = {0.5, 0, 0.5}; // of the second start
  p.goal.resize(20), p.start = positions(bounded, 20, 1, 0);
  for (std::size_t k = 0; k < 20; ++k)
    for (std::size_t i = 0; i < joints; ++i) {
      const double x = (first[k][i] / pi + 1) / 2 + 0.07 + halves[i / 2 % 3];
      p.goal[k][i] = p.start[k][i] + pi * (2 * (x - std::floor(x)) - 1);
    }
  const solution second = solve(bounded, p, targets_of(bounded, p), limited_to(0, 2));
  for (std::size_t k = 0; k < 20; ++k) {
    CHECK((second.end[k] == static_cast<int>(converged) && second.starts[k] == 2));
    for (std::size_t i = 0; i < joints; ++i)
      CHECK(second.q[k][i] == doctest::Approx(p.goal[k][i]).epsilon(1e-9));
  }
}

TEST_CASE("random starts are uniform within the limits of each number, and independent") {
  constexpr int n = 1500;
  const ksl::model m(several_numbers());
  const problem p = {{{6, 1, 1}}, {}, std::vector<numbers>(n, numbers(12)), true};
  const std::vector<numbers> drawn = solve(m, p, targets_of(m, p), limited_to(0)).q;
  double mean[12] = {}, product[12][12] = {}; // of numbers scaled to -1 … 1
  for (const numbers &q : drawn) {
    double x[12];
    for (std::size_t i = 0; i < 12; ++i) {
      const double lower = m.view().lower[i], upper = m.view().upper[i];
      x[i] = (2 * q[i] - lower - upper) / (upper - lower);
      REQUIRE(std::fabs(x[i]) <= 1);
      mean[i] += x[i] / n;
    }
    for (int i = 0; i < 12; ++i)
      for (int j = 0; j < 12; ++j)
        product[i][j] += x[i] * x[j] / n;
  }
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) {
      CHECK(std::fabs(mean[i]) < 0.06);
      CHECK(std::fabs(product[i][j] - (i == j ? 1 / 3.0 : 0)) < 0.04);
    }
}

TEST_CASE("random starts without limits lie around the neutral position; joints that move no frame stay there") {
  constexpr int n = 1500;
  const ksl::model m = ksl::load(KSL_EVERY_KIND);
  numbers neutral(static_cast<std::size_t>(m.nq()));
  ksl::neutral(m, neutral.data());
  for (int link : {static_cast<int>(m.links().size()) - 1, 1}) {
    const problem p = {{{link, 1, 1}}, {}, std::vector<numbers>(n, neutral), false};
    const std::vector<numbers> drawn = solve(m, p, targets_of(m, p), limited_to(0)).q;
    int still = 0;
    for (std::size_t i = 0; i < neutral.size(); ++i) {
      double mean = 0, square = 0;
      for (const numbers &q : drawn)
        mean += q[i] / n, square += q[i] * q[i] / n;
      const double deviation = std::sqrt(std::fmax(square - mean * mean, 0.0));
      if (deviation < 1e-9) {
        CHECK(mean == doctest::Approx(neutral[i]).epsilon(1e-12));
        ++still;
      } else if (neutral[i] == 0) { // but the number of a quaternion that is one
        CHECK(std::fabs(mean) < 4.5 * deviation / std::sqrt(double(n)));
      }
    }
    CHECK((still > 0 && still < m.nq()));
  }
}

TEST_CASE("random starts of every kind of joint are positions: quaternions have unit length, numbers differ") {
  for (const char *path : {KSL_EVERY_KIND, KSL_COUPLED}) {
    const ksl::model m = ksl::load(path);
    problem p = {{{static_cast<int>(m.links().size()) - 1, 1, 1}}, {}, std::vector<numbers>(40), false};
    for (numbers &goal : p.goal)
      goal.resize(static_cast<std::size_t>(m.nq())), ksl::neutral(m, goal.data());
    for (const bool limits : {false, true}) {
      p.limits = limits;
      const std::vector<numbers> drawn = solve(m, p, targets_of(m, p), limited_to(0)).q;
      for (const numbers &q : drawn) {
        for (const ksl::model::quaternion_in_q &each : m.quaternions()) {
          const double *const x = &q[static_cast<std::size_t>(each.q_index)];
          CHECK(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3] == doctest::Approx(1).epsilon(1e-12));
        }
        for (double each : q)
          CHECK((std::isfinite(each) && std::fabs(each) < 20));
      }
    }
  }
}
