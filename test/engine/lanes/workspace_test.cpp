// What a state needs in memory, as docs/engine.md says; and that a workspace lies within its memory.
#include "robots.hpp"

#include "ksl/engine/algorithms/derivatives/inverse_dynamics_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/reactions_derivatives.hpp"
#include "ksl/engine/algorithms/energy/energy.hpp"
#include "ksl/engine/algorithms/forward/forward_dynamics.hpp"
#include "ksl/engine/algorithms/kinematics/frame_jacobian.hpp"
#include "ksl/engine/algorithms/manifold/manifold.hpp"
#include "ksl/engine/algorithms/mass/mass_matrix.hpp"
#include "ksl/engine/algorithms/parameters/energy_regressor.hpp"
#include "ksl/engine/algorithms/parameters/inverse_dynamics_regressor.hpp"
#include "ksl/engine/algorithms/parameters/reactions_regressor.hpp"
#include "ksl/engine/algorithms/whole_body/center_of_mass.hpp"
#include "ksl/engine/algorithms/whole_body/center_of_mass_motion.hpp"
#include "ksl/engine/algorithms/whole_body/centroidal_momentum.hpp"
#include "ksl/engine/algorithms/whole_body/centroidal_momentum_matrix.hpp"

#include <doctest/doctest.h>

#include <cstdint>
#include <string>

namespace {

/// A chain of revolute joints: `bodies` with the ground.
ksl::model chain(int bodies) {
  ksl::robot_description r;
  r.name = "chain";
  r.links = {robots::link("link0")};
  for (int i = 1; i < bodies; ++i) {
    r.links.push_back(robots::link(("link" + std::to_string(i)).c_str(), robots::solid(1, {0, 0, 0}, 1, 1, 1)));
    r.joints.push_back(robots::joint(("joint" + std::to_string(i)).c_str(), ksl::joint_kind::revolute, i - 1, i,
                                     {1, 0, 0}, {0, 1, 0}));
  }
  return ksl::model(r);
}

/// Numbers for each body that a chain needs more of when it grows by 64 bodies, of packs of states.
template <template <class> class Workspace> double numbers_per_body() {
  using P = ksl::native_pack<double>;
  const ksl::model shorter = chain(65), longer = chain(129);
  return static_cast<double>(ksl::workspace_bytes<Workspace<P>>(longer.view()) -
                             ksl::workspace_bytes<Workspace<P>>(shorter.view())) /
         (64 * sizeof(P));
}

} // namespace

TEST_CASE("numbers for each body") {
  const int passed = ksl::laws_are_late<ksl::native_pack<double>> ? 6 : 0; // wrenches that branches pass on
  CHECK(numbers_per_body<ksl::inverse_dynamics_workspace>() == 17 + passed);
  CHECK(numbers_per_body<ksl::reactions_workspace>() == 29 + 6 + passed);
  CHECK(numbers_per_body<ksl::forward_dynamics_workspace>() == 64);
  CHECK(numbers_per_body<ksl::mass_matrix_workspace>() == 29);
  CHECK(numbers_per_body<ksl::inverse_dynamics_derivatives_workspace>() == 99);
  CHECK(numbers_per_body<ksl::reactions_derivatives_workspace>() == 99 + 28);
  CHECK(numbers_per_body<ksl::forward_kinematics_workspace>() == 14);
  CHECK(numbers_per_body<ksl::jacobian_workspace>() == 2);
  CHECK(numbers_per_body<ksl::manifold_workspace>() == 0);
  CHECK(numbers_per_body<ksl::energy_workspace>() == 20);
  CHECK(numbers_per_body<ksl::external_power_workspace>() == 20);
  CHECK(numbers_per_body<ksl::center_of_mass_workspace>() == 6);
  CHECK(numbers_per_body<ksl::center_of_mass_jacobian_workspace>() == 15);
  CHECK(numbers_per_body<ksl::center_of_mass_velocity_workspace>() == 11);
  CHECK(numbers_per_body<ksl::center_of_mass_acceleration_workspace>() == 14);
  CHECK(numbers_per_body<ksl::centroidal_momentum_workspace>() == 18);
  CHECK(numbers_per_body<ksl::centroidal_momentum_rate_workspace>() == 21);
  CHECK(numbers_per_body<ksl::centroidal_momentum_matrix_workspace>() == 23);
  CHECK(numbers_per_body<ksl::inverse_dynamics_regressor_workspace>() == 23);
  CHECK(numbers_per_body<ksl::reactions_regressor_workspace>() == 23);
  CHECK(numbers_per_body<ksl::energy_regressor_workspace>() == 20);
}

TEST_CASE("arrays follow each other, aligned, within the memory that was measured") {
  const ksl::model m = chain(9);
  const std::size_t bytes = ksl::workspace_bytes<ksl::reactions_workspace<double>>(m.view());
  ksl::data d(m);
  ksl::arena pieces(d.memory());
  const auto w = pieces.take_workspace<ksl::reactions_workspace<double>>(m.view());
  CHECK(pieces.used() == bytes);
  const auto offset = [&](const void *p) {
    return static_cast<const char *>(p) - static_cast<const char *>(d.memory());
  };
  const std::ptrdiff_t at[] = {offset(w.dynamics.pose.sine),     offset(w.dynamics.pose.cosine),
                               offset(w.dynamics.motion.data()), offset(w.dynamics.wrench.through.data()),
                               offset(&w.in_world[0]),           offset(&w.link_wrench[0])};
  for (std::size_t i = 0; i < std::size(at); ++i) {
    CHECK(at[i] % 64 == 0);
    CHECK(at[i] < static_cast<std::ptrdiff_t>(bytes));
    if (i > 0)
      CHECK(at[i] > at[i - 1]);
  }
  CHECK(reinterpret_cast<std::uintptr_t>(d.memory()) % 64 == 0);
}
