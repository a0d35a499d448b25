// Reactions written while inverse dynamics passes by are those that are asked for afterwards.
#include "robots.hpp"

#include "ksl/dynamics.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

namespace {

std::vector<double> random_numbers(std::mt19937_64 &random, int n) {
  std::uniform_real_distribution<double> number(-1, 1);
  std::vector<double> x(static_cast<std::size_t>(n));
  for (double &e : x)
    e = number(random);
  return x;
}

std::vector<int> links_of(const ksl::model &m, int joints) {
  std::vector<int> links;
  for (int j = 0; j < joints; ++j)
    links.push_back(m.joints()[static_cast<std::size_t>(j)].link);
  return links;
}

/// Both ways, for one request.
void check(const ksl::model &m, ksl::reaction_request request, const std::vector<int> &links) {
  std::mt19937_64 random(11);
  const std::vector<double> q = random_numbers(random, m.nq()), v = random_numbers(random, m.nv()),
                            a = random_numbers(random, m.nv());
  std::vector<double> tau(static_cast<std::size_t>(m.nv())), at_once(tau);
  std::vector<double> after(6 * links.size()), found(after);
  request.n = static_cast<int>(links.size());
  request.link = links.data();
  ksl::data d(m), e(m);
  ksl::inverse_dynamics(m, d, q.data(), v.data(), a.data(), tau.data());
  ksl::reactions(m, d, request, after.data());
  ksl::inverse_dynamics_with_reactions(m, e, q.data(), v.data(), a.data(), at_once.data(), request, found.data());
  CHECK(tau == at_once);
  CHECK(after == found);
}

} // namespace

TEST_CASE("reactions at once: moving joints, all joints, any order, parts, sides, frames") {
  for (const std::string name : {"ur5", "panda"})
    for (const bool floating : {false, true}) {
      ksl::model_options options;
      options.floating_base = floating;
      const ksl::model m = ksl::load(robot_file(name), options);
      CAPTURE(name);
      CAPTURE(floating);
      const std::vector<int> moving = links_of(m, m.moving_joints()),
                             all = links_of(m, static_cast<int>(m.joints().size()));
      std::vector<int> backwards(moving.rbegin(), moving.rend()), twice = moving;
      twice.insert(twice.end(), moving.begin(), moving.end());
      for (const std::vector<int> &links :
           {moving, all, backwards, twice, std::vector<int>(1, moving[2]), std::vector<int>()})
        for (const ksl::wrench_part part :
             {ksl::wrench_part::total, ksl::wrench_part::constraint, ksl::wrench_part::actuation})
          for (const bool angular_first : {false, true}) {
            ksl::reaction_request request;
            request.part = part;
            request.angular_first = angular_first;
            check(m, request, links);
            request.on = ksl::wrench_side::parent;
            check(m, request, links);
            request.axes = ksl::wrench_frame::world;
            check(m, request, links);
          }
    }
}

TEST_CASE(
    "derivatives of the reaction of a single joint, whose numbers fill no register: single precision and double") {
  // the smallest array of zeros that the kernel writes: 6 numbers of floats, for each of q, v and a
  const ksl::model m(robots::pendulum(1.3, 0.7));
  ksl::data d(m);
  const double q = 0.8, v = 2.1, a = -1.7, h = 1e-6;
  const float qf = 0.8f, vf = 2.1f, af = -1.7f;
  const int link = 1;
  ksl::reaction_request request;
  request.n = 1, request.link = &link, request.axes = ksl::wrench_frame::world;
  double by_q[6], by_v[6], by_a[6], above[6], below[6], tau;
  float by_qf[6], by_vf[6], by_af[6];
  ksl::reactions_derivatives(m, d, &q, &v, &a, request, by_q, by_v, by_a);
  ksl::reactions_derivatives(m, d, &qf, &vf, &af, request, by_qf, by_vf, by_af);
  const auto reaction = [&](double position, double velocity, double acceleration, double *out) {
    ksl::inverse_dynamics(m, d, &position, &velocity, &acceleration, &tau);
    ksl::reactions(m, d, request, out);
  };
  const auto expect = [&](const double *found, const float *single) {
    for (int i = 0; i < 6; ++i) {
      CHECK(found[i] == doctest::Approx((above[i] - below[i]) / (2 * h)).epsilon(1e-7).scale(10));
      CHECK(double(single[i]) == doctest::Approx(found[i]).epsilon(1e-6).scale(10));
    }
  };
  reaction(q + h, v, a, above), reaction(q - h, v, a, below);
  expect(by_q, by_qf);
  reaction(q, v + h, a, above), reaction(q, v - h, a, below);
  expect(by_v, by_vf);
  reaction(q, v, a + h, above), reaction(q, v, a - h, below);
  expect(by_a, by_af);
}
