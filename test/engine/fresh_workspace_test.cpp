// In a debug build a fresh workspace is NaN throughout, so that what reads before it writes is seen.
#include "robots.hpp"

#include "ksl/engine/mass_matrix.hpp"

#include <doctest/doctest.h>

#include <cmath>

#ifdef NDEBUG
#error "this test is a debug build"
#endif

TEST_CASE("every number of a fresh workspace is NaN") {
  const ksl::model m(robots::double_pendulum(1, 1, 1, 1));
  ksl::data d(m);
  const double *const numbers = static_cast<const double *>(d.memory());
  REQUIRE(d.bytes() > 0);
  for (std::size_t i = 0; i < d.bytes() / sizeof(double); ++i)
    CHECK(std::isnan(numbers[i]));
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
