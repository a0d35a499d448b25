// In a debug build a fresh workspace is NaN throughout, so that what reads before it writes is seen.
#include "robots.hpp"

#include "ksl/engine/energy.hpp"
#include "ksl/engine/forward_dynamics.hpp"
#include "ksl/engine/frame_jacobian.hpp"
#include "ksl/engine/manifold.hpp"
#include "ksl/engine/mass_matrix.hpp"
#include "ksl/engine/reactions.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <type_traits>
#include <vector>

#ifdef NDEBUG
#error "this test is a debug build"
#endif

TEST_CASE("every number of a fresh workspace is NaN") {
  const ksl::model m(robots::double_pendulum(1, 1, 1, 1));
  ksl::data d(m);
  const auto all_nan = [](const void *memory, std::size_t bytes) {
    const double *x = static_cast<const double *>(memory);
    for (std::size_t i = 0; i < bytes / sizeof(double); ++i)
      if (!std::isnan(x[i]))
        return false;
    return true;
  };
  CHECK(d.bytes() >= ksl::workspace_bytes<ksl::reactions_workspace<double>>(m.view()));
  CHECK(d.bytes() >= ksl::workspace_bytes<ksl::forward_dynamics_workspace<double>>(m.view()));
  CHECK(all_nan(d.memory(), d.bytes()));
}

TEST_CASE("and no algorithm reads what it has not written") {
  const ksl::model m(robots::double_pendulum(1.3, 0.7, 0.9, 0.5));
  const double q[2] = {0.8, -1.9}, v[2] = {2.1, -0.6}, a[2] = {-1.7, 0.4};
  const int links[3] = {0, 1, 2};
  ksl::reaction_request request;
  request.n = 3;
  request.link = links;
  request.axes = request.at = ksl::wrench_frame::world;
  const double push[6] = {1, 2, 3, 4, 5, 6};
  const ksl::external_wrenches<double> external = {1, &links[2], push};
  const ksl::model_view<double> view = m.view();
  const auto check = [&]<class Workspace>(std::type_identity<Workspace>, std::size_t numbers, auto algorithm) {
    std::vector<double> out(numbers, NAN);
    ksl::data d(m);
    ksl::arena pieces(d.memory());
    algorithm(pieces.take_workspace<Workspace>(view), out.data());
    for (double x : out)
      CHECK(std::isfinite(x));
  };
  using std::type_identity;
  check(type_identity<ksl::inverse_dynamics_workspace<double>>(), 2,
        [&](const auto &w, double *out) { ksl::inverse_dynamics<double>(view, w, q, v, a, external, out); });
  check(type_identity<ksl::reactions_workspace<double>>(), 20, [&](const auto &w, double *out) {
    ksl::inverse_dynamics<double>(view, w.dynamics, q, v, a, external, out);
    ksl::reactions<double>(view, w, external, request, out + 2);
  });
  check(type_identity<ksl::reactions_workspace<double>>(), 20, [&](const auto &w, double *out) {
    ksl::inverse_dynamics_with_reactions<double>(view, w, q, v, a, external, out, request, out + 2);
  });
  check(type_identity<ksl::forward_dynamics_workspace<double>>(), 2,
        [&](const auto &w, double *out) { ksl::forward_dynamics<double>(view, w, q, v, a, external, out); });
  check(type_identity<ksl::mass_matrix_workspace<double>>(), 4,
        [&](const auto &w, double *out) { ksl::mass_matrix<double>(view, w, q, out); });
  check(type_identity<ksl::forward_kinematics_workspace<double>>(), 48,
        [&](const auto &w, double *out) { ksl::frame_poses<double>(view, w, q, 3, links, out); });
  check(type_identity<ksl::energy_workspace<double>>(), 2,
        [&](const auto &w, double *out) { ksl::energy<double>(view, w, q, v, out, out + 1); });
  check(type_identity<ksl::external_power_workspace<double>>(), 1,
        [&](const auto &w, double *out) { ksl::external_power<double>(view, w, q, v, external, out); });
  check(type_identity<ksl::jacobian_workspace<double>>(), 12,
        [&](const auto &w, double *out) { ksl::jacobian<double>(view, w, q, 2, {}, out); });
  check(type_identity<ksl::manifold_workspace<double>>(), 22, [&](const auto &w, double *out) {
    ksl::integrate<double>(view, w, q, v, out);
    ksl::difference<double>(view, w, q, v, out + 2);
    ksl::interpolate<double>(view, w, q, v, push, out + 4);
    ksl::integrate_jacobians<double>(view, w, q, v, out + 6, out + 10);
    ksl::difference_jacobians<double>(view, w, q, v, out + 14, out + 18);
  });
}
