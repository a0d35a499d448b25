// Inverse kinematics against forward kinematics: what is found has the pose that was asked for, whether or not joints follow others,
// and whatever else of the results is wanted.  Branches of solutions and random starts: test/laws/inverse_kinematics_test.py.
#include "inverse_kinematics_problems.hpp"

#include "batch/threads.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace {

using inverse_kinematics_problems::numbers, inverse_kinematics_problems::pose;

ksl::robot_description with_limits(ksl::robot_description r, std::size_t joint, double lower, double upper) {
  r.joints[joint].kind = ksl::joint_kind::revolute;
  r.joints[joint].lower = lower, r.joints[joint].upper = upper;
  return r;
}

/// Two pendulums in a row, the second of which follows the first.
ksl::robot_description following(double multiplier, double offset) {
  ksl::robot_description r = robots::double_pendulum(1, 0.7, 1, 0.5);
  r.joints[1].kind = ksl::joint_kind::continuous;
  r.joints[1].mimic = {r.joints[0].name, multiplier, offset, {}};
  return r;
}

struct found {
  numbers q = {};
  double error[2] = {-1, -1};
  int end = -1, iterations = -1, starts = -1;
};

/// From a start to a pose of the last link.
found solve(const ksl::model &m, const numbers &start, const std::array<double, 16> &target, bool only_q = false,
            bool limits = true) {
  const ksl::wanted_frame frame = {m.view().links - 1, 1, 1};
  ksl::inverse_kinematics_options options;
  options.frames_n = 1, options.frames = &frame, options.limits = limits;
  found f;
  f.q.assign(start.size(), NAN);
  ksl::inverse_kinematics_batch<double> batch;
  batch.n = 1, batch.start = {start.data(), m.nq()}, batch.target = {target.data(), 16}, batch.q = {f.q.data(), m.nq()};
  if (!only_q)
    batch.error = {f.error, 2}, batch.end = &f.end, batch.iterations = &f.iterations, batch.starts = &f.starts;
  ksl::inverse_kinematics(m, options, batch, 1);
  return f;
}

void check_pose(const ksl::model &m, const numbers &q, const std::array<double, 16> &target) {
  const std::array<double, 16> reached = pose(m, q, m.view().links - 1);
  for (std::size_t i = 0; i < 16; ++i)
    CHECK(std::fabs(reached[i] - target[i]) < 2e-6);
}

} // namespace

TEST_CASE(
    "inverse kinematics: a robot with every kind of joint, some of which follow others; results that nobody wants") {
  for (const char *path : {every_kind_file, coupled_file}) {
    const ksl::model m = ksl::load(path);
    numbers start(static_cast<std::size_t>(m.nq())), near;
    ksl::neutral(m, start.data());
    near = start;
    for (std::size_t i = 0; i < near.size(); ++i)
      near[i] += 0.1 * std::sin(1.0 + static_cast<double>(i));
    robots::normalize_quaternions(m, near.data());
    const std::array<double, 16> target = pose(m, near, m.view().links - 1);
    const found all = solve(m, start, target), alone = solve(m, start, target, true);
    CHECK(all.end == static_cast<int>(ksl::inverse_kinematics_end::converged));
    CHECK((all.iterations > 0 && all.starts == 1 && all.error[0] <= 1e-6 && all.error[1] <= 1e-6));
    check_pose(m, all.q, target);
    CHECK(alone.q == all.q);
    const found beyond =
        solve(m, start, {1, 0, 0, 1e4, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}); // further starts begin near the given one
    CHECK((beyond.starts >= 1 && std::isfinite(beyond.q[0])));
  }
}

TEST_CASE("inverse kinematics: a follower that stands still, and limits of a follower that its leader can't keep") {
  const ksl::model still(following(0, 0.3)); // a joint at 0.3 rad, whatever its leader does
  const std::array<double, 16> target = pose(still, {0.8}, 2);
  check_pose(still, solve(still, {0.1}, target).q, target);
  const found beyond =
      solve(still, {0.1}, {1, 0, 0, 3, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}); // all starts are tried; the best is kept
  CHECK((beyond.end != static_cast<int>(ksl::inverse_kinematics_end::converged) && beyond.starts == 5 &&
         std::isfinite(beyond.q[0])));
  CHECK(beyond.error[0] > 1);
  ksl::robot_description r = with_limits(with_limits(following(1, 0), 0, -1, 1), 1, 2, 3);
  const ksl::model torn(r); // no position keeps both: those of the leader are kept
  CHECK((torn.position_ranges()[0].lower == -1 && torn.position_ranges()[0].upper == 1));
  const found f = solve(torn, {0.1}, pose(torn, {0.9}, 2));
  CHECK(f.end == static_cast<int>(ksl::inverse_kinematics_end::converged));
  CHECK(f.q[0] == doctest::Approx(0.9).epsilon(1e-5));
}

TEST_CASE("inverse kinematics: limits hold the solution, unless they are left aside") {
  const ksl::model m(with_limits(robots::pendulum(1, 0.7), 0, -0.5, 0.5));
  const std::array<double, 16> target = pose(m, {0.8}, 1);
  const found held = solve(m, {0.1}, target);
  CHECK(held.end == static_cast<int>(ksl::inverse_kinematics_end::limits));
  CHECK(held.q[0] == doctest::Approx(0.5));
  CHECK(solve(m, {0.1}, target, false, false).q[0] == doctest::Approx(0.8).epsilon(1e-5));
  CHECK(solve(m, {-2}, pose(m, {-0.3}, 1)).q[0] == doctest::Approx(-0.3).epsilon(1e-5)); // a start beyond the limits
}

TEST_CASE("inverse kinematics: any number of threads finds the same, each in memory of its own") {
  ksl::assume_cores(4);
  const ksl::model m = ksl::load(every_kind_file);
  const std::size_t n = 6000, nq = static_cast<std::size_t>(m.nq());
  numbers start(n * nq), targets;
  for (std::size_t k = 0; k < n; ++k) {
    numbers near(nq);
    ksl::neutral(m, near.data());
    std::copy(near.begin(), near.end(), &start[k * nq]);
    for (std::size_t i = 0; i < nq; ++i)
      near[i] += 0.3 * std::sin(static_cast<double>(k + 3 * i));
    robots::normalize_quaternions(m, near.data());
    const std::array<double, 16> target = pose(m, near, m.view().links - 1);
    targets.insert(targets.end(), target.begin(), target.end());
  }
  const auto solved = [&](int threads) {
    const ksl::wanted_frame frame = {m.view().links - 1, 1, 1};
    ksl::inverse_kinematics_options options;
    options.frames_n = 1, options.frames = &frame;
    numbers q(n * nq, NAN);
    ksl::inverse_kinematics_batch<double> batch;
    batch.n = n, batch.start = {start.data(), m.nq()}, batch.target = {targets.data(), 16},
    batch.q = {q.data(), m.nq()};
    ksl::inverse_kinematics(m, options, batch, threads);
    return q;
  };
  const numbers alone = solved(1);
  for (const int threads : {2, 4, 0})
    CHECK(solved(threads) == alone);
  ksl::assume_cores(0);
}

TEST_CASE("inverse kinematics: a start that is the solution is returned with quaternions of unit length") {
  ksl::robot_description r = robots::pendulum(1, 0.7);
  r.joints[0].kind = ksl::joint_kind::spherical;
  const ksl::model m(r);
  const numbers unit = {0, 0, 0.6, 0.8}, longer = {0, 0, 0.6 * 1.00005, 0.8 * 1.00005};
  const found f = solve(m, longer, pose(m, unit, 1));
  CHECK(f.iterations == 0);
  for (std::size_t i = 0; i < 4; ++i)
    CHECK(f.q[i] == doctest::Approx(unit[i]).epsilon(1e-15));
}
