// The three large algorithms on nine directions: an ordinary -O2 build of this file is to take less than a minute.
#include "ksl/dual.hpp"
#include "ksl/dynamics.hpp"
#include "ksl/engine/algorithms/forward/forward_dynamics.hpp"
#include "ksl/engine/algorithms/inverse/inverse_dynamics.hpp"
#include "ksl/engine/algorithms/mass/mass_matrix.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <cmath>

using T = ksl::dual<9>;

TEST_CASE("nine directions at once: forward dynamics inverts inverse dynamics in every one") {
  const ksl::model m = ksl::load(robot_file("ur5"));
  std::vector<T> q, v, a, tau(6), found(6), M(36);
  for (int i = 0; i < 6; ++i) { // directions: six accelerations, two angles, a velocity
    a.push_back(T::variable(0.3 - 0.2 * i, i));
    q.push_back(i < 2 ? T::variable(0.4 * i - 1, 6 + i) : T(0.4 * i - 1));
    v.push_back(i == 2 ? T::variable(0.5, 8) : T(0.1 * i));
  }
  ksl::inverse_dynamics<T>(m.view(), *ksl::owned_workspace<ksl::inverse_dynamics_workspace<T>>(m.view()), q.data(),
                           v.data(), a.data(), {}, tau.data());
  ksl::forward_dynamics<T>(m.view(), *ksl::owned_workspace<ksl::forward_dynamics_workspace<T>>(m.view()), q.data(),
                           v.data(), tau.data(), {}, found.data());
  ksl::mass_matrix<T>(m.view(), *ksl::owned_workspace<ksl::mass_matrix_workspace<T>>(m.view()), q.data(), M.data());
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(found[i].value == doctest::Approx(a[i].value).epsilon(1e-11));
    for (std::size_t k = 0; k < 9; ++k)
      CHECK(std::fabs(found[i].derivative[k] - (i == k)) < 1e-11);
    for (std::size_t k = 0; k < 6; ++k)
      CHECK(std::fabs(tau[i].derivative[k] - M[6 * i + k].value) < 1e-13);
  }
}
