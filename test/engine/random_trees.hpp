// Random trees of bodies on joints of all kinds, and random states of robots.
#pragma once

#include "robots.hpp"

#include "ksl/engine/steps/external_wrenches.hpp"

#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace robots {

template <class N> using numbers = std::vector<N>;

/// Where a robot is, how it moves, and what drives and pushes it; another position, and how far to go there.
template <class T> struct state_over {
  numbers<T> q = {}, v = {}, a = {}, tau = {}, push = {},
             q1 = {}; // gcc warns of members without, where a list names some
  numbers<int> pushed = {};
  ksl::expressed_in axes = ksl::expressed_in::frame; ///< of what pushes
  T fraction = T(0.4);

  ksl::external_wrenches<T> external() const {
    return {static_cast<int>(pushed.size()), pushed.data(), push.data(), axes};
  }
};
using state = state_over<double>;

inline numbers<double> random_numbers(int n, std::mt19937 &random) {
  std::normal_distribution<double> normal;
  numbers<double> x(static_cast<std::size_t>(n));
  for (double &y : x)
    y = normal(random);
  return x;
}

inline state random_state(const ksl::model &m, std::mt19937 &random) {
  const int last = m.view().links - 1;
  const auto numbers_of = [&](int n) { return random_numbers(n, random); };
  state s = {numbers_of(m.nq()), numbers_of(m.nv()), numbers_of(m.nv()), numbers_of(m.nv()),
             numbers_of(18),     numbers_of(m.nq()), {last, last / 2, 0}};
  s.axes = static_cast<ksl::expressed_in>(random() % 2);
  normalize_quaternions(m, s.q.data()), normalize_quaternions(m, s.q1.data());
  return s;
}

enum class joints_are { plain, physical };

/// Damping, friction, rotor and spring, each where the kind of joint can have it.
inline void add_physics(ksl::joint_description &joint) {
  const ksl::joint_kind_row row = ksl::row_of(joint.kind);
  if (row.nv > 0)
    joint.damping = 0.3, joint.friction = 0.7, joint.friction_width = 0.5;
  if (row.nv > 0 && !row.is_free)
    joint.armature = 0.2;
  if (row.nv == 1)
    joint.spring_stiffness = 2, joint.spring_rest = 0.1;
}

/// A tree of bodies on joints of all kinds.  Every link has mass, so that every effort accelerates something.
inline ksl::model random_tree(int bodies, std::mt19937 &random, joints_are joints = joints_are::plain) {
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
  const auto vector = [&] {
    const numbers<double> x = random_numbers(3, random);
    return ksl::vec3<double>{x[0], x[1], x[2]};
  };
  ksl::robot_description r;
  r.name = "random tree";
  r.links = {link("link0", solid(2, {0.1, -0.2, 0.3}, 1.5, 1, 1.2))}; // a floating base needs an inertia
  for (int i = 1; i < bodies; ++i) {
    const std::string number = std::to_string(i);
    r.links.push_back(link(("link" + number).c_str(), solid(1, vector(), 1, 1.2, 0.9)));
    const ksl::joint_kind kind = ksl::joint_kinds[below(std::size(ksl::joint_kinds))];
    const int parent = below(3) ? i - 1 : static_cast<int>(below(static_cast<std::size_t>(i)));
    ksl::vec3<double> axis = vector();
    ksl::algebra<double>::vec3_normalize(&axis);
    r.joints.push_back(joint(("joint" + number).c_str(), kind, parent, i, vector(), axis));
    r.joints.back().pitch = 0.3;
    r.joints.back().axis2 = vector();
    ksl::algebra<double>::vec3_normalize(&r.joints.back().axis2);
    if (joints == joints_are::physical)
      add_physics(r.joints.back());
  }
  ksl::model_options options;
  if (joints == joints_are::physical)
    options.physics = ksl::physics_options{.damping = true, .friction = true, .armature = true, .spring = true};
  options.floating_base = below(2) == 0;
  return ksl::model(r, options);
}

} // namespace robots
