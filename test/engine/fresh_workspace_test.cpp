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
  const auto all_nan = [](const void *memory, std::size_t bytes) {
    const double *x = static_cast<const double *>(memory);
    for (std::size_t i = 0; i < bytes / sizeof(double); ++i)
      if (!std::isnan(x[i]))
        return false;
    return true;
  };
  const auto bodies = static_cast<std::size_t>(m.view().bodies), links = static_cast<std::size_t>(m.view().links);
  const auto positions = static_cast<std::size_t>(ksl::padded(m.nq()));
  ksl::data_workspace<double> v;
  ksl::arena pieces(d.memory());
  v.lay_out(pieces, m.view());
  CHECK(all_nan(v.in_parent, sizeof *v.in_parent * bodies));
  const auto numbers = [&](const double *x, int each, int n) {
    return all_nan(x, sizeof *x * static_cast<std::size_t>(ksl::room_for<double>(each, n)));
  };
  CHECK(numbers(v.motion, 9, m.view().bodies));
  CHECK(numbers(v.wrench, 6, m.view().bodies));
  CHECK(numbers(v.rotation, 9, m.view().bodies));
  CHECK(numbers(v.inertia, 21, m.view().bodies));
  CHECK(all_nan(v.sine, sizeof *v.sine * positions));
  CHECK(all_nan(v.cosine, sizeof *v.cosine * positions));
  CHECK(all_nan(v.in_world, sizeof *v.in_world * bodies));
  CHECK(all_nan(v.axis, sizeof *v.axis * bodies));
  CHECK(all_nan(v.twist, sizeof *v.twist * bodies));
  CHECK(all_nan(v.offset, sizeof *v.offset * bodies));
  CHECK(all_nan(v.articulated, sizeof *v.articulated * bodies));
  CHECK(all_nan(v.link_wrench, sizeof *v.link_wrench * links));
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
    ksl::data_workspace<double> w;
    ksl::arena pieces(d.memory());
    w.lay_out(pieces, m.view());
    ksl::inverse_dynamics<double>(m.view(), w, q, v, a, {}, out);
    ksl::reactions<double>(m.view(), w, {}, request, out + 2);
  }
  for (double x : out)
    CHECK(std::isfinite(x));
}
