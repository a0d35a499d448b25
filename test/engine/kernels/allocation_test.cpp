// No algorithm allocates: every way to get memory is counted while they run.  Calls that follow from rows are counted in
// algorithms_test.cpp (faces.hpp); here are those written by hand.
#include "allocation.hpp"

#include "ksl/dynamics.hpp"
#include "ksl/engine.h"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <vector>

TEST_CASE("the calls of C++ that are written by hand allocate nothing") {
#ifdef COUNTS_MALLOC
  const ksl::model m = ksl::load(robot_file("ur5"));
  ksl::data d(m);
  const std::size_t nv = static_cast<std::size_t>(m.nv()), n = m.joints().size();
  std::vector<double> q(nv, 0.3), v(nv, 0.2), a(nv, 0.1), tau(nv), wrenches(6 * n);
  std::vector<int> links;
  for (const ksl::joint_row &j : m.joints())
    links.push_back(j.link); // fixed ones and base too
  ksl::reaction_request request;
  request.n = static_cast<int>(n);
  request.link = links.data();
  request.at = request.axes = ksl::wrench_frame::world;

  long before = allocations;
  void *volatile block = std::malloc(100);
  std::free(block);
  REQUIRE(allocations > before); // the counter counts

  ksl::inverse_dynamics(m, d, q.data(), v.data(), a.data(), tau.data()); // the first call chooses the instruction set
  before = allocations;
  double sum = 0;
  for (int k = 0; k < 100; ++k) {
    ksl::inverse_dynamics(m, d, q.data(), v.data(), a.data(), tau.data());
    ksl::reactions(m, d, request, wrenches.data());
    sum += ksl::frame_pose(m, d, q.data(), links[0]).t.x;
  }
  CHECK(allocations == before);
  CHECK(sum == sum);
#else
  MESSAGE("malloc can't be counted with this C library or sanitizer");
#endif
}

TEST_CASE("and so do those of C") {
#ifdef COUNTS_MALLOC
  ksl_model_t *m = nullptr;
  ksl_data_t *d = nullptr;
  REQUIRE(ksl_model_load(robot_file("ur5").c_str(), nullptr, &m) == KSL_OK);
  REQUIRE(ksl_data_create(m, &d) == KSL_OK);
  const double x[6] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  const double large[6] = {1e15, 0, 0, 0, 0, 0}; // efforts whose accelerations are examined (engine/run/examine.hpp)
  double tau[6], a[6], wrenches[48];
  int joints[8];
  for (int i = 0; i < 8; ++i)
    joints[i] = i;
  ksl_SE3_t pose;
  REQUIRE(ksl_model_joints(m) == 8);
  const long before = allocations;
  bool fine = true;
  for (int k = 0; k < 100; ++k) {
    fine &= ksl_inverse_dynamics(m, d, x, x, x, nullptr, tau) == KSL_OK;
    fine &= ksl_reactions(m, d, 8, joints, nullptr, nullptr, wrenches) == KSL_OK;
    fine &= ksl_frame_pose(m, d, x, 3, &pose) == KSL_OK;
    fine &= ksl_forward_dynamics(m, d, x, x, large, nullptr, a) == KSL_OK && a[0] > 1e12;
  }
  CHECK(allocations == before);
  CHECK(fine);
  ksl_data_free(d);
  ksl_model_free(m);
#endif
}
