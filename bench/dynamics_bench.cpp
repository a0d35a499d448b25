// Times of one state: `dynamics_bench ROBOT.urdf`.  States are random and different, so that nothing is predicted.
#include "ksl/dynamics.hpp"

#include <benchmark/benchmark.h>

#include <cstdio>
#include <random>

namespace {

constexpr std::size_t states = 64;

struct workload {
  ksl::model model;
  ksl::data data{model};
  std::vector<double> q, v, a, tau, wrenches;
  std::vector<int> links;

  explicit workload(const char *path) : model(ksl::load(path, {}, true)) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> angle(-3, 3);
    const auto fill = [&](std::vector<double> &x, int width) {
      x.resize(states * static_cast<std::size_t>(width));
      for (double &value : x)
        value = angle(random);
    };
    fill(q, model.nq());
    fill(v, model.nv());
    fill(a, model.nv());
    tau.resize(static_cast<std::size_t>(model.nv()));
    for (int i = 0; i < model.moving_joints(); ++i)
      links.push_back(model.joints()[static_cast<std::size_t>(i)].link);
    wrenches.resize(6 * links.size());
  }

  void inverse_dynamics(std::size_t k) {
    const std::size_t nq = static_cast<std::size_t>(model.nq()), nv = static_cast<std::size_t>(model.nv());
    ksl::inverse_dynamics(model, data, &q[nq * k], &v[nv * k], &a[nv * k], tau.data());
  }

  void reactions() {
    ksl::reaction_request request;
    request.n = static_cast<int>(links.size());
    request.link = links.data();
    ksl::reactions(model, data, request, wrenches.data());
  }
};

void inverse_dynamics(benchmark::State &state, const char *path) {
  workload w(path);
  for (std::size_t k = 0; auto _ : state) {
    w.inverse_dynamics(k = (k + 1) % states);
    benchmark::DoNotOptimize(w.tau.data());
    benchmark::ClobberMemory();
  }
}

void with_reactions(benchmark::State &state, const char *path) {
  workload w(path);
  for (std::size_t k = 0; auto _ : state) {
    w.inverse_dynamics(k = (k + 1) % states);
    w.reactions();
    benchmark::DoNotOptimize(w.wrenches.data());
    benchmark::ClobberMemory();
  }
}

} // namespace

int main(int argc, char **argv) {
  benchmark::Initialize(&argc, argv);
  if (argc < 2) {
    std::fprintf(stderr, "usage: dynamics_bench ROBOT.urdf...\n");
    return 2;
  }
  std::printf("kernels: %s\n", ksl::instruction_set());
  for (int i = 1; i < argc; ++i) {
    benchmark::RegisterBenchmark((std::string("inverse dynamics, ") + argv[i]).c_str(), inverse_dynamics, argv[i]);
    benchmark::RegisterBenchmark((std::string("inverse dynamics and reactions, ") + argv[i]).c_str(), with_reactions, argv[i]);
  }
  benchmark::RunSpecifiedBenchmarks();
}
