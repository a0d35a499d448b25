// In a debug build a fresh workspace is NaN throughout, so that what reads before it writes is seen.  That no algorithm does is
// tested for every row in algorithms_test.cpp (faces.hpp).
#include "../robots.hpp"

#include "ksl/engine/algorithms/forward/forward_dynamics.hpp"
#include "ksl/engine/algorithms/inverse/reactions.hpp"

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
