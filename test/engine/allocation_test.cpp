// No algorithm allocates: every way to get memory is counted while they run.
#include "ksl/dynamics.hpp"
#include "ksl/engine.h"

#include <doctest/doctest.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <new>
#include <vector>

namespace {
std::atomic<long> allocations{0};
}

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define COUNTS_MALLOC
extern "C" {
void *__libc_malloc(std::size_t);
void *__libc_calloc(std::size_t, std::size_t);
void *__libc_realloc(void *, std::size_t);
void *__libc_memalign(std::size_t, std::size_t);
void *malloc(std::size_t n) {
  ++allocations;
  return __libc_malloc(n);
}
void *calloc(std::size_t n, std::size_t size) {
  ++allocations;
  return __libc_calloc(n, size);
}
void *realloc(void *p, std::size_t n) {
  ++allocations;
  return __libc_realloc(p, n);
}
void *aligned_alloc(std::size_t alignment, std::size_t n) {
  ++allocations;
  return __libc_memalign(alignment, n);
}
int posix_memalign(void **p, std::size_t alignment, std::size_t n) {
  ++allocations;
  *p = __libc_memalign(alignment, n);
  return *p ? 0 : ENOMEM;
}
}
#endif

TEST_CASE("the algorithms allocate nothing") {
#ifdef COUNTS_MALLOC
  const ksl::model m = ksl::load(KSL_EXAMPLES "/robots/ur5.urdf");
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
  const double push[6] = {1, 2, 3, 4, 5, 6};
  const ksl::external_wrenches<double> external = {1, &links.back(), push};
  double kinetic = 0, potential = 0, sum = 0, poses[32];
  std::vector<double> M(nv * nv), J(6 * nv);

  long before = allocations;
  void *volatile block = std::malloc(100);
  std::free(block);
  REQUIRE(allocations > before); // the counter counts

  ksl::inverse_dynamics(m, d, q.data(), v.data(), a.data(), tau.data()); // the first call chooses the instruction set
  before = allocations;
  for (int k = 0; k < 100; ++k) {
    ksl::inverse_dynamics(m, d, q.data(), v.data(), a.data(), tau.data(), external);
    ksl::reactions(m, d, request, wrenches.data(), external);
    ksl::inverse_dynamics_with_reactions(m, d, q.data(), v.data(), a.data(), tau.data(), request, wrenches.data(), external);
    ksl::forward_dynamics(m, d, q.data(), v.data(), tau.data(), a.data(), external);
    ksl::mass_matrix(m, d, q.data(), M.data());
    ksl::bias(m, d, q.data(), v.data(), tau.data(), external);
    ksl::gravity_torque(m, d, q.data(), tau.data(), external);
    ksl::jacobian(m, d, q.data(), links[0], {}, J.data());
    ksl::integrate(m, d, q.data(), v.data(), tau.data());
    ksl::difference(m, d, q.data(), v.data(), tau.data());
    ksl::interpolate(m, d, q.data(), v.data(), push, tau.data());
    ksl::integrate_jacobians(m, d, q.data(), v.data(), M.data(), M.data());
    ksl::difference_jacobians(m, d, q.data(), v.data(), M.data(), M.data());
    ksl::energy(m, d, q.data(), v.data(), &kinetic, &potential);
    ksl::frame_poses(m, d, q.data(), 2, links.data(), poses);
    ksl::external_power(m, d, q.data(), v.data(), &kinetic, external);
    sum += kinetic + ksl::frame_pose(m, d, q.data(), links[0]).t.x;
  }
  CHECK(allocations == before);
  CHECK(sum == sum);
#else
  MESSAGE("malloc can't be counted with this C library or sanitizer");
#endif
}

TEST_CASE("the algorithms allocate nothing where joints follow others") {
#ifdef COUNTS_MALLOC
  const ksl::model m = ksl::load(KSL_COUPLED);
  REQUIRE(m.followers() > 0);
  ksl::data d(m);
  std::vector<double> q(static_cast<std::size_t>(m.nq()), 0.3), v(static_cast<std::size_t>(m.nv()), 0.2), tau = v, M(v.size() * v.size());
  std::vector<double> poses(16 * m.links().size());
  std::vector<int> links;
  for (const ksl::joint_row &j : m.joints())
    links.push_back(j.link);
  ksl::inverse_dynamics(m, d, q.data(), v.data(), v.data(), tau.data());
  const long before = allocations;
  ksl::inverse_dynamics(m, d, q.data(), v.data(), v.data(), tau.data());
  ksl::mass_matrix(m, d, q.data(), M.data());
  ksl::forward_dynamics(m, d, q.data(), v.data(), tau.data(), v.data());
  ksl::frame_poses(m, d, q.data(), static_cast<int>(m.links().size()), links.data(), poses.data());
  ksl::difference_jacobians(m, d, q.data(), q.data(), M.data(), M.data());
  CHECK(allocations == before);
#endif
}

TEST_CASE("the calls of the C interface that compute allocate nothing") {
#ifdef COUNTS_MALLOC
  ksl_model_t *m = nullptr;
  ksl_data_t *d = nullptr;
  REQUIRE(ksl_model_load(KSL_EXAMPLES "/robots/ur5.urdf", nullptr, &m) == KSL_OK);
  REQUIRE(ksl_data_create(m, &d) == KSL_OK);
  const double x[6] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  double tau[6], wrenches[48], poses[32], M[36], J[36], kinetic, potential;
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
    fine &= ksl_inverse_dynamics_with_reactions(m, d, x, x, x, nullptr, tau, 8, joints, nullptr, wrenches) == KSL_OK;
    fine &= ksl_forward_dynamics(m, d, x, x, x, nullptr, tau) == KSL_OK;
    fine &= ksl_mass_matrix(m, d, x, M) == KSL_OK;
    fine &= ksl_bias(m, d, x, x, nullptr, tau) == KSL_OK;
    fine &= ksl_gravity_torque(m, d, x, nullptr, tau) == KSL_OK;
    fine &= ksl_external_power(m, d, x, x, nullptr, &kinetic) == KSL_OK;
    fine &= ksl_jacobian(m, d, x, 3, nullptr, J) == KSL_OK;
    fine &= ksl_integrate(m, d, x, x, tau) == KSL_OK;
    fine &= ksl_difference(m, d, x, x, tau) == KSL_OK;
    fine &= ksl_interpolate(m, d, x, x, x, tau) == KSL_OK;
    fine &= ksl_integrate_jacobians(m, d, x, x, M, M) == KSL_OK;
    fine &= ksl_difference_jacobians(m, d, x, x, M, M) == KSL_OK;
    fine &= ksl_energy(m, d, x, x, &kinetic, &potential) == KSL_OK;
    fine &= ksl_frame_pose(m, d, x, 3, &pose) == KSL_OK;
    fine &= ksl_frame_poses(m, d, x, 2, joints, poses) == KSL_OK; // as many links as joints
  }
  CHECK(allocations == before);
  CHECK(fine);
  ksl_data_free(d);
  ksl_model_free(m);
#endif
}
