// Two models, number by number.
#pragma once

#include "ksl/dynamics.hpp"

#include <doctest/doctest.h>

#include <random>

namespace ksl::test {

/// A state without meaning, but with unit quaternions: q, then v, then a.
inline std::vector<double> some_state(const model &m, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  std::vector<double> x(static_cast<std::size_t>(m.nq() + 2 * m.nv()));
  for (double &each : x)
    each = number(random);
  for (const model::quaternion_in_q &at : m.quaternions()) {
    double *const p = x.data() + at.q_index, length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
    for (int i = 0; i < 4; ++i)
      p[i] /= length;
  }
  return x;
}

/// Efforts and poses of all links at that state.
inline std::vector<double> results_of(const model &m, unsigned seed = 1) {
  const std::vector<double> state = some_state(m, seed);
  const double *const q = state.data(), *const v = q + m.nq(), *const a = v + m.nv();
  data d(m);
  std::vector<double> all(static_cast<std::size_t>(m.nv()) + 16 * m.links().size());
  inverse_dynamics(m, d, q, v, a, all.data());
  std::vector<int> links;
  for (std::size_t l = 0; l < m.links().size(); ++l)
    links.push_back(static_cast<int>(l));
  frame_poses(m, d, q, static_cast<int>(links.size()), links.data(), all.data() + m.nv());
  return all;
}

inline std::vector<std::string> names_of(const model &m) {
  std::vector<std::string> names;
  for (const joint_row &j : m.joints())
    names.push_back(j.name);
  for (const link_description &l : m.links())
    names.push_back(l.name);
  return names;
}

/// Same names in the same order, and the same bits.
inline void check_same(const model &a, const model &b) {
  CHECK(names_of(a) == names_of(b));
  CHECK(results_of(a) == results_of(b));
}

} // namespace ksl::test
