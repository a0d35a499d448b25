// Attempts of inverse kinematics: where they start, how they end, and which one is kept.
#include "inverse_kinematics_problems.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <tuple>

namespace {

using namespace inverse_kinematics_problems;
using enum ksl::inverse_kinematics_end;

} // namespace

TEST_CASE("starts beyond the limits begin at the limits, each number at its own") {
  const ksl::model m(several_numbers());
  problem p = {
      {{6, 1, 1}}, {numbers(12, 5), numbers(12, -5), numbers(12, 0.01)}, {numbers(12), numbers(12), numbers(12)}, true};
  const solution s = solve(m, p, targets_of(m, p), limited_to(0));
  for (std::size_t i = 0; i < 12; ++i)
    CHECK((s.q[0][i] == m.view().upper[i] && s.q[1][i] == m.view().lower[i] && s.q[2][i] == 0.01));
  p.limits = false;
  CHECK(solve(m, p, targets_of(m, p), limited_to(0)).q[0] == p.start[0]);
}

TEST_CASE(
    "attempts end: after 8 steps without progress, at the number of iterations, at once where the target is no number") {
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
  CHECK(
      (s.q[0][1] == m.view().upper[1] && std::fabs(s.q[0][0]) < 0.99 && s.q[1][0] == 1 && std::fabs(s.q[1][1]) < 0.99));
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
  for (const auto &[position, orientation, ends] :
       {std::tuple{1.001, 1.001, true}, {0.999, 1.001, false}, {1.001, 0.999, false}}) {
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

TEST_CASE(
    "random starts without limits, and from a start that is given: up to half a turn, or pi metres, to both sides") {
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
  const ksl::model m = ksl::load(every_kind_file);
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

TEST_CASE("random starts of every kind of joint are positions: quaternions have unit length, and numbers are finite") {
  for (const char *path : {every_kind_file, coupled_file}) {
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
