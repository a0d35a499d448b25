// Finite arguments give finite results, or an error that says why.  C++, one state and batches, and the statuses of C.
#include "robots.hpp"

#include "ksl/batch.hpp"
#include "ksl/engine.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace {

/// Its first link has no mass: where it is straight, the shoulder moves none.
ksl::model bars() { return ksl::model(robots::double_pendulum(0, 1, 2, 1)); }

constexpr double pi = 3.14159265358979323846;

} // namespace

TEST_CASE("finite results: overflow is an error of one state and of batches, NaN in is NaN out") {
  const ksl::model m(robots::double_pendulum(1, 1, 1, 1));
  ksl::data d(m);
  const double q[2] = {0.3, 0.4}, v[2] = {1e200, 1}, a[2] = {0, 0}, nan[2] = {std::nan(""), 0};
  double tau[2];
  ksl::inverse_dynamics(m, d, q, v, a, tau); // of one state in C++ it isn't looked for, since it would take time
  CHECK(!std::isfinite(tau[0]));
  CHECK_THROWS_WITH_AS(ksl::forward_dynamics(m, d, q, v, a, tau), doctest::Contains("forward_dynamics: a[0] is"), ksl::result_error);
  ksl::inverse_dynamics(m, d, q, nan, a, tau); // arguments of C++ calls are not checked
  CHECK(std::isnan(tau[0]));
  const float qf[2] = {0.3f, 0.4f}, vf[2] = {1e30f, 1}, af[2] = {0, 0};
  float tauf[2];
  CHECK_THROWS_WITH_AS(ksl::forward_dynamics(m, d, qf, vf, af, tauf), doctest::Contains("single precision"), ksl::result_error);

  const std::size_t n = 300;
  std::vector<double> Q(2 * n, 0.1), V(2 * n, 0.2), out(2 * n);
  V[2 * 217] = 1e200;
  ksl::batch_view<double> b;
  b.n = n, b.q = {Q.data(), 2}, b.v = {V.data(), 2}, b.result[0] = {out.data(), 2};
  for (int threads : {1, 3}) {
    try {
      ksl::inverse_dynamics_batch(m, b, threads);
      FAIL("no error");
    } catch (const ksl::result_error &e) {
      CHECK(e.state == 217);
      CHECK(e.joint == -1);
      CHECK(std::string(e.what()).find("state 217: tau[0] is") != std::string::npos);
    }
  }
  V[2 * 217] = std::numeric_limits<double>::infinity();
  ksl::inverse_dynamics_batch(m, b, 1);
  V[2 * 217] = 0.2;
  ksl::inverse_dynamics_batch(m, b, 1);
}

TEST_CASE("finite results: a joint that moves no mass at one position is named") {
  const ksl::model m = bars();
  ksl::data d(m);
  CHECK(m.massless_joint() == -1);
  double v[2] = {1, 2}, a[2];
  for (double angle : {0.0, pi, -pi}) {
    const double q[2] = {0.4, angle}, tau[2] = {1, -1};
    try {
      ksl::forward_dynamics(m, d, q, v, tau, a);
      FAIL("no error");
    } catch (const ksl::result_error &e) {
      CHECK(m.joints()[static_cast<std::size_t>(e.joint)].name == "shoulder");
      CHECK(std::string(e.what()).find("joint shoulder, at this position, can move without moving any mass") != std::string::npos);
    }
    double in_place[2] = {1, -1};
    CHECK_THROWS_AS(ksl::forward_dynamics(m, d, q, v, in_place, in_place), ksl::result_error);
  }
  const double good[2] = {0.4, 1.2}, tau[2] = {1, -1};
  ksl::forward_dynamics(m, d, good, v, tau, a);
  CHECK(std::isfinite(a[0]));
}

TEST_CASE("finite results: a mechanism with a joint that moves no mass is refused by C++, too") {
  ksl::robot_description r = robots::double_pendulum(1, 1, 1, 1);
  r.links.push_back(robots::link("tool"));
  r.joints.push_back(robots::joint("wrist", ksl::joint_kind::revolute, 2, 3, {0.1, 0, 0}, {1, 0, 0}));
  const ksl::model m(r);
  ksl::data d(m);
  REQUIRE(m.description().warnings.size() == 1);
  CHECK(m.description().warnings[0].find("forward dynamics are refused: joint wrist can move without moving any mass") == 0);
  CHECK(ksl::model(m.description()).description().warnings.size() == 1);
  const double q[3] = {0.1, 0.2, 0.3}, zero[3] = {0, 0, 0};
  double a[3];
  CHECK_THROWS_WITH_AS(ksl::forward_dynamics(m, d, q, zero, zero, a), doctest::Contains("joint wrist can move without moving any mass"), ksl::result_error);
}

TEST_CASE("finite results: the status of C") {
  ksl_model_t *m = nullptr;
  ksl_data_t *d = nullptr;
  REQUIRE(ksl_model_load(KSL_EXAMPLES "/robots/panda.urdf", nullptr, &m) == KSL_OK);
  REQUIRE(ksl_data_create(m, &d) == KSL_OK);
  const int nv = ksl_model_nv(m);
  std::vector<double> q(static_cast<std::size_t>(nv), 0.3), v(static_cast<std::size_t>(nv), 1e200), out(static_cast<std::size_t>(nv));
  CHECK(ksl_bias(m, d, q.data(), v.data(), nullptr, out.data()) == KSL_NOT_FINITE);
  CHECK(std::string(ksl_error_message()).find("bias: tau[") == 0);
  CHECK(ksl_bias_batch(m, 1, q.data(), nv, v.data(), nv, out.data(), nv, 1) == KSL_NOT_FINITE);
  CHECK(std::string(ksl_error_message()).find("bias: tau[") == 0);
  CHECK(ksl_bias(m, d, q.data(), q.data(), nullptr, out.data()) == KSL_OK);
  ksl_data_free(d);
  ksl_model_free(m);
}
