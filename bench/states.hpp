// Random states of a model, all different, so that branch prediction can't learn them.
#pragma once

#include "peer.h"

#include <cmath>
#include <random>
#include <vector>

struct states {
  std::vector<double> q, v, a, tau;
  size_t n;

  states(const bench_model &m, size_t count, unsigned seed) : n(count) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> angle(-3, 3);
    std::normal_distribution<double> normal;
    for (size_t k = 0; k < n; ++k) {
      for (int i = 0; i < m.joints; ++i) {
        const bench_joint &j = m.joint[i];
        const int quaternion = j.nq > j.nv ? 4 : 0;
        for (int e = 0; e < j.nq - quaternion; ++e)
          q.push_back(j.kind == bench_prismatic ? 0.1 * angle(random) : angle(random));
        if (quaternion)
          rotation(normal, random);
      }
      for (int i = 0; i < m.nv; ++i)
        v.push_back(normal(random)), a.push_back(normal(random));
    }
    tau.assign(v.size(), 0.0);
  }

  bench_states view() const { return {n, q.data(), v.data(), a.data(), tau.data()}; }

private:
  template <class Normal, class Random> void rotation(Normal &normal, Random &random) {
    double x[4], square = 0;
    for (double &e : x)
      e = normal(random), square += e * e;
    for (double e : x)
      q.push_back(e / std::sqrt(square));
  }
};
