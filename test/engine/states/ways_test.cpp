// Which way computes a row for a model, and that each way has the memory that it says it needs.
#include "engine/run/all_ways.hpp"
#include "ksl/surgery.hpp"
#include "robots.hpp"

#include <doctest/doctest.h>

#include <cstring>
#include <memory>
#include <stdexcept>
#include <vector>

namespace {

using ksl::way;
namespace rows = ksl::rows;

/// A parallelogram, whose last joint is cut: three bars in a chain.  With `follow` the third turns as the first, with `spring` a spring pulls the
/// second to the ceiling, with `loop` the last joint is there.
ksl::model bars(bool follow, bool spring, bool loop) {
  ksl::robot_description r;
  const ksl::spatial_inertia<double> bar = robots::solid(2, {0.1, 0, -0.5}, 0.2, 0.2, 0.01);
  r.links = {robots::link("ceiling"), robots::link("a", bar), robots::link("b", bar), robots::link("c", bar)};
  constexpr auto turns = ksl::joint_kind::continuous;
  r.joints = {robots::joint("A", turns, 0, 1, {0, 0, 0}, {0, 1, 0}),
              robots::joint("B", turns, 1, 2, {0, 0, -1}, {0, 1, 0}),
              robots::joint("C", turns, 2, 3, {1, 0, 0}, {0, 1, 0})};
  if (follow)
    r.joints[2].mimic = {"A", 1, 0, {}};
  if (spring) {
    ksl::force_element_description of;
    of.name = "spring", of.link1 = 0, of.link2 = 2, of.point1 = {0.3, 0, 0.4}, of.point2 = {0, 0.1, -0.6};
    of.numbers.stiffness = 70;
    r.force_elements = {of};
  }
  r.physics.force_elements = true;
  if (!loop)
    return ksl::model(r);
  ksl::loop_description pin;
  pin.name = "D", pin.kind = ksl::joint_kind::revolute, pin.predecessor = 0, pin.successor = 3;
  pin.axis = {0, 1, 0};
  pin.predecessor_pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {1, 0, 0}};
  pin.successor_pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 1}};
  return ksl::model(ksl::with_loops(r, {pin}));
}

TEST_CASE("ways: the highest that has to act computes a row") {
  for (const ksl::algorithm_row *row : rows::all)
    if (row->loops != ksl::loops_by::plan) {
      CHECK(ksl::way_of(*row, bars(false, false, false)) == way::kernels);
      CHECK(ksl::way_of(*row, bars(true, false, false)) == way::mimic);
    }
  const struct {
    const ksl::algorithm_row &row;
    way with_spring, with_all;
  } found[] = {{rows::inverse_dynamics, way::elements, way::loops},
               {rows::energy, way::elements, way::elements},
               {rows::frame_poses, way::kernels, way::mimic},
               {rows::mass_matrix, way::kernels, way::loops}};
  for (const auto &[row, with_spring, with_all] : found) {
    CHECK(ksl::way_of(row, bars(false, true, false)) == with_spring);
    CHECK(ksl::way_of(row, bars(true, true, true)) == with_all);
    CHECK(ksl::way_of(row, bars(true, true, true), way::mimic) == way::mimic);
    CHECK(ksl::way_of(row, bars(false, true, true), way::kernels) == way::kernels);
  }
}

TEST_CASE("ways: what can't be computed is refused by the highest way that refuses") {
  CHECK_NOTHROW(ksl::require_computable(rows::mass_matrix_tree, bars(false, true, false)));
  const auto refused = [](const ksl::algorithm_row &row, const ksl::model &m, const char *words) {
    CHECK_THROWS_WITH_AS(ksl::require_computable(row, m), doctest::Contains(words), std::invalid_argument);
  };
  refused(rows::mass_matrix_tree, bars(true, true, false), "robots with mimic joints");
  refused(rows::mass_matrix_tree, bars(true, true, true), "mechanisms with loops");
  refused(rows::inverse_dynamics_second_derivatives, bars(true, true, false), "force elements between points");
  refused(rows::closed_forward_dynamics, bars(false, false, false), "is private");
}

/// Computes a row in memory of as many bytes as the way says, and returns whether it wrote behind them.
template <class Compute> bool stays_within(std::size_t bytes, Compute compute) {
  constexpr std::size_t behind = 4096;
  std::vector<std::byte> memory(bytes + behind + 64);
  void *begin = memory.data();
  std::size_t space = memory.size();
  std::byte *const first = static_cast<std::byte *>(std::align(64, bytes + behind, begin, space));
  std::memset(first + bytes, 0x5a, behind);
  compute(first);
  for (std::size_t i = 0; i < behind; ++i)
    if (first[bytes + i] != std::byte{0x5a})
      return false;
  return true;
}

TEST_CASE("ways: a way writes nothing behind the bytes that it asks for") {
  for (int which = 0; which < 8; ++which) {
    const ksl::model m = bars(which & 1, which & 2, which & 4);
    constexpr std::size_t n = 5;
    const std::vector<double> zero(n * 3), tau(n * 3, 0.7);
    for (const ksl::algorithm_row *row : {&rows::inverse_dynamics, &rows::forward_dynamics, &rows::gravity_torque,
                                          &rows::effort_parts, &rows::mass_matrix, &rows::energy_derivatives}) {
      const ksl::way_calls<double> &calls = ksl::calls_of<double>(*row, m);
      const std::ptrdiff_t width = row == &rows::effort_parts ? 15 : row == &rows::mass_matrix ? 9 : 3;
      std::vector<double> out(n * 15 * 3);
      if (row == &rows::mass_matrix && (which & 4))
        continue;
      ksl::batch_view<double> batch;
      batch.n = n, batch.q = batch.v = batch.a = {zero.data(), 3}, batch.tau = {tau.data(), 3};
      ksl::state_view<double> state;
      state.q = state.v = state.a = zero.data(), state.tau = tau.data();
      for (int r = 0; r < ksl::computed(*row).results; ++r)
        state.result[r] = out.data() + static_cast<std::ptrdiff_t>(n) * 15 * r;
      for (int r = 0; r < row->results; ++r)
        batch.result[r] = {state.result[r], width};
      CAPTURE(which);
      CAPTURE(row->name);
      CHECK(stays_within(calls.state_bytes(*row, m, {}), [&](void *at) { calls.run_state(*row, m, at, state); }));
      CHECK(stays_within(calls.batch_bytes(*row, m, batch),
                         [&](void *at) { calls.run_batch(*row, m, batch, 0, n, at); }));
    }
  }
}

} // namespace
