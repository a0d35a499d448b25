// The engine's templates in another scalar: float, compiled here from the headers alone.
#include "ksl/engine/algorithms/energy/energy.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"
#include "ksl/engine/algorithms/inverse/reactions.hpp"
#include "ksl/dynamics.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <vector>

namespace {

/// Efforts, reactions of all links' joints in world axes, and energies.
template <class T> std::vector<T> everything(const ksl::model_view<T> &m, const std::vector<double> &q,
                                             const std::vector<double> &v, const std::vector<double> &a) {
  const ksl::owned_workspace<ksl::reactions_workspace<T>> w(m);
  const ksl::owned_workspace<ksl::energy_workspace<T>> for_energy(m);
  const std::vector<T> qt(q.begin(), q.end()), vt(v.begin(), v.end()), at(a.begin(), a.end());
  std::vector<int> links;
  for (int l = 0; l < m.links; ++l)
    links.push_back(l);
  ksl::reaction_request request;
  request.n = m.links;
  request.link = links.data();
  request.axes = request.at = ksl::wrench_frame::world;
  const std::size_t nv = v.size(), n = links.size();
  std::vector<T> out(nv + 6 * n + 2);
  const T push[6] = {1, 2, 3, 4, 5, 6};
  const ksl::external_wrenches<T> external = {1, &links.back(), push};
  ksl::inverse_dynamics<T>(m, w->dynamics, qt.data(), vt.data(), at.data(), external, out.data());
  ksl::reactions<T>(m, *w, external, request, out.data() + nv);
  ksl::energy<T>(m, *for_energy, qt.data(), vt.data(), &out[nv + 6 * n], &out[nv + 6 * n + 1]);
  return out;
}

} // namespace

TEST_CASE("float follows double to its own precision, double from headers equals the library") {
  for (const char *robot : {"ur5", "panda"}) {
    const ksl::model m = ksl::load(robot_file(robot));
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    for (int k = 0; k < 20; ++k) {
      std::vector<double> q, v, a;
      for (int i = 0; i < m.nv(); ++i)
        q.push_back(normal(random)), v.push_back(normal(random)), a.push_back(normal(random));
      const std::vector<double> exact = everything<double>(m.view(), q, v, a);
      const std::vector<float> single = everything<float>(m.view_single(), q, v, a);
      double scale = 0, worst = 0;
      for (std::size_t i = 0; i < exact.size(); ++i) {
        scale = std::fmax(scale, std::fabs(exact[i]));
        worst = std::fmax(worst, std::fabs(exact[i] - double(single[i])));
      }
      CHECK(worst < 3e-6 * scale);
      CHECK(worst > 1e-9 * scale); // it was computed in float

      ksl::data d(m);
      std::vector<double> tau(v.size());
      const int last = m.view().links - 1;
      const double push[6] = {1, 2, 3, 4, 5, 6};
      ksl::inverse_dynamics(m, d, q.data(), v.data(), a.data(), tau.data(), {1, &last, push});
      for (std::size_t i = 0; i < tau.size(); ++i)
        CHECK(std::fabs(tau[i] - exact[i]) < 1e-13 * scale);
    }
  }
}
