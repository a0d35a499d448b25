// Reactions written while inverse dynamics passes by are those that are asked for afterwards.
#include "ksl/dynamics.hpp"

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
  const std::vector<double> q = random_numbers(random, m.nq()), v = random_numbers(random, m.nv()), a = random_numbers(random, m.nv());
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
      const ksl::model m = ksl::load(KSL_EXAMPLES "/robots/" + name + ".urdf", options);
      CAPTURE(name);
      CAPTURE(floating);
      const std::vector<int> moving = links_of(m, m.moving_joints()), all = links_of(m, static_cast<int>(m.joints().size()));
      std::vector<int> backwards(moving.rbegin(), moving.rend()), twice = moving;
      twice.insert(twice.end(), moving.begin(), moving.end());
      for (const std::vector<int> &links : {moving, all, backwards, twice, std::vector<int>(1, moving[2]), std::vector<int>()})
        for (const ksl::wrench_part part : {ksl::wrench_part::total, ksl::wrench_part::constraint, ksl::wrench_part::actuation})
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
