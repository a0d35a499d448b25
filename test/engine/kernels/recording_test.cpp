// A scalar that records: the engine never looks at a number, so that one run gives all there is to compute.
#include "recording.hpp"

#include "ksl/dynamics.hpp"
#include "ksl/engine/algorithms/inverse/inverse_dynamics.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <random>

static_assert(ksl::scalar<recording>);

namespace {

/// n inputs from `first` on.
std::vector<recording> inputs(int first, int n) {
  std::vector<recording> x;
  for (int i = 0; i < n; ++i)
    x.push_back(recording::input(first + i));
  return x;
}

/// Efforts of a robot from (q, v, a).
tape recorded_efforts(const ksl::model &m) {
  tape t;
  recording::current = &t;
  const ksl::owned_workspace<ksl::inverse_dynamics_workspace<recording>> w(m.view());
  const std::vector<recording> q = inputs(0, m.nq()), v = inputs(m.nq(), m.nv()), a = inputs(m.nq() + m.nv(), m.nv());
  std::vector<recording> tau(v.size());
  ksl::inverse_dynamics<recording>(m.view(), *w, q.data(), v.data(), a.data(), {}, tau.data());
  for (const recording &x : tau)
    t.outputs.push_back(x.place());
  recording::current = nullptr;
  return t;
}

} // namespace

TEST_CASE("inverse dynamics of the UR5, recorded once, gives the efforts of every state") {
  const ksl::model m = ksl::load(robot_file("ur5"));
  const tape t = recorded_efforts(m), shorter = t.simplified();
  ksl::data d(m);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int turn = 0; turn < 100; ++turn) {
    std::vector<double> x(18), tau(6);
    for (double &y : x)
      y = normal(random);
    const ksl::owned_workspace<ksl::inverse_dynamics_workspace<double>> w(m.view());
    ksl::inverse_dynamics<double>(m.view(), *w, &x[0], &x[6], &x[12], {}, tau.data());
    CHECK(t.play(x) == tau); // to the bit
    CHECK(shorter.play(x) == tau);
  }
  const tape::count all = t.counted(), few = shorter.counted();
  CAPTURE(all.arithmetic);
  CHECK(few.arithmetic <= 486); // + − × ÷; 1,305 as recorded
  CHECK(few.arithmetic > 300);  // something is left to compute
  CHECK(few.negations <= 21);
  CHECK(few.sines == 10); // a pair for each joint but the first, whose axis is vertical
}

TEST_CASE("choices are recorded, not made") {
  tape t;
  recording::current = &t;
  const std::vector<recording> x = inputs(0, 6);
  const ksl::screw<recording> s = {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
  ksl::SE3<recording> D;
  ksl::algebra<recording>::SE3_exp(&s, &D);
  for (const recording &y : {D.R.m00, D.R.m10, D.t.x, D.t.z})
    t.outputs.push_back(y.place());
  recording::current = nullptr;
  for (double size : {0.0, 1e-5, 0.5}) { // near zero there is a series, elsewhere a sine
    const ksl::screw<double> at = {{0.1, 0.2, 0.3}, {size, -size, 2 * size}};
    ksl::SE3<double> exact;
    ksl::algebra<double>::SE3_exp(&at, &exact);
    const std::vector<double> found = t.play({0.1, 0.2, 0.3, size, -size, 2 * size});
    const double expected[4] = {exact.R.m00, exact.R.m10, exact.t.x, exact.t.z};
    for (std::size_t i = 0; i < 4; ++i)
      CHECK(found[i] == doctest::Approx(expected[i]).epsilon(1e-15)); // sin is ours here and libm's there
  }
}
