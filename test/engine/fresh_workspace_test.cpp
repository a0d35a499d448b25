// In a debug build a fresh workspace is NaN throughout, so that what reads before it writes is seen.
#include "robots.hpp"

#include "ksl/engine/forward_dynamics.hpp"
#include "ksl/engine/reactions.hpp"

#include <doctest/doctest.h>

#include <cmath>

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
  double out[20];
  {
    ksl::data d(m);
    ksl::arena pieces(d.memory());
    const auto w = pieces.take_workspace<ksl::reactions_workspace<double>>(m.view());
    ksl::inverse_dynamics<double>(m.view(), w.dynamics, q, v, a, {}, out);
    ksl::reactions<double>(m.view(), w, {}, request, out + 2);
  }
  for (double x : out)
    CHECK(std::isfinite(x));
}
