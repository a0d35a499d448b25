// The search for closed positions where there is none: what it gives is the best that one of its starts led to.
#include "ksl/builder.hpp"
#include "ksl/loops.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace {

ksl::SE3<double> at(double x, double y) { return {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {x, y, 0}}; }

/// A four-bar linkage whose rod, 0.4 m, would have to be 1.005 m long where crank and rocker point away from each other.
ksl::model linkage() {
  using kind = ksl::joint_kind;
  const ksl::link_mass body = {1.5, {0.1, 0.02, -0.03}, {0.03, 0, 0, 0, 0.04, 0, 0, 0, 0.05}};
  ksl::joint_options about_z;
  about_z.axis = {0, 0, 1};
  ksl::loop_options loop;
  loop.axis = {0, 0, 1};
  ksl::builder b("linkage");
  b.add_link("ground");
  for (const char *name : {"crank", "rod", "rocker"})
    b.add_link(name, body);
  b.add_joint("A", kind::continuous, "ground", "crank", at(0, 0), about_z);
  b.add_joint("B", kind::continuous, "crank", "rod", at(0.2, 0), about_z);
  b.add_joint("E", kind::continuous, "ground", "rocker", at(0.5, 0.1), about_z);
  b.add_loop("D", kind::revolute, "rod", "rocker", at(0.4, 0), at(0.3, 0), loop);
  b.set_drives({"A"});
  return b.build();
}

constexpr double pi = 3.14159265358979323846;

/// The largest component of the loops' error.
double opened(const ksl::model &m, ksl::data &d, const std::vector<double> &q) {
  std::vector<double> error(static_cast<std::size_t>(ksl::loop_rows(m)));
  ksl::loop_error(m, d, q.data(), error.data());
  double most = 0;
  for (const double e : error)
    most = std::max(most, std::fabs(e));
  return most;
}

} // namespace

TEST_CASE("a search that fails gives the best position of its starts") {
  const ksl::model m = linkage();
  ksl::data d(m);
  const std::vector<unsigned char> hold = {1, 0, 1};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> angle(-pi, pi);
  int better = 0;
  for (int k = 0; k < 50; ++k) {
    const std::vector<double> start = {pi, angle(random), 0};
    double before = HUGE_VAL, alone = 0;
    for (const int starts : {1, 2, 4, 8, 32}) {
      CAPTURE(starts);
      std::vector<double> q(3);
      double error = 0;
      CHECK(ksl::close(m, d, start.data(), hold.data(), {.starts = starts}, q.data(), &error) != ksl::closing::closed);
      CHECK(error == opened(m, d, q)); // that of the position that is given
      CHECK((q[0] == start[0] && q[2] == start[2]));
      CHECK(error <= before);
      // 1 m lies between the pins along x, and 0.1 m along y: the rod leaves 0.6 m where it points along x, and 0.602 where it points to the pin
      CHECK(error >= 0.6);
      before = error, alone = starts == 1 ? error : alone;
    }
    CHECK(before < 0.602);
    better += before < alone;
  }
  CHECK(better > 40);
  std::vector<double> q = {pi, 2, 0}; // out may be the start
  double error = 0;
  CHECK(ksl::close(m, d, q.data(), hold.data(), {}, q.data(), &error) != ksl::closing::closed);
  CHECK(error == opened(m, d, q));
}
