// Each kind of joint against its bases in ksl/joint_space.h, against published cases, and its positions as a manifold.
#include "ksl/engine/model/joints.hpp"

#include "robots.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

namespace {

using A = ksl::algebra<double>;
constexpr double pitch = 0.3;

// kinds whose unit twists are constant in the child's axes, and some that have none: a pin in a slot, two rotations
static_assert(ksl::is_group<0, 1>() && ksl::is_group<5, 2>() && ksl::is_group<0, 1, 2, 5>());
static_assert(!ksl::is_group<0, 5>() && !ksl::is_group<3, 4>() && !ksl::is_group<0, 1, 4>());

/// step(joint<K>()) for every kind that bodies have.
template <class Step> void for_each_kind_of_body(Step step) {
  for (const ksl::joint_kind kind : ksl::joint_kinds)
    ksl::with_joint(kind, [&]<class J>(J j) {
      if constexpr (ksl::moving_joint<J>) {
        const std::string name = J::name;
        CAPTURE(name);
        step(j, kind);
      }
    });
}

/// step(joint<K>()) for every kind that moves.
template <class Step> void for_each_moving_kind(Step step) {
  for (const ksl::joint_kind kind : ksl::joint_kinds)
    ksl::with_joint(kind, [&]<class J>(J j) {
      if constexpr (J::nv > 0) {
        const std::string name = J::name;
        CAPTURE(name);
        step(j, kind);
      }
    });
}

/// The published bases of a kind in its canonical frame: its axis is z.  A continuous joint's are a revolute one's, and a
/// translation's are among those of a free joint.
struct published_bases {
  explicit published_bases(ksl::joint_kind kind) : angle_first(kind == ksl::joint_kind::cylindrical) {
    const ksl::joint_kind listed = kind == ksl::joint_kind::continuous    ? ksl::joint_kind::revolute
                                   : kind == ksl::joint_kind::translation ? ksl::joint_kind::floating
                                                                          : kind;
    n = A::joint_space_set(&bases, static_cast<int>(listed), 2, pitch, 0);
  }
  /// Numbers of coordinates in the published order, which slides before it turns, or back; zero where the kind has none.
  std::vector<double> ordered(std::vector<double> x) const {
    x.resize(static_cast<std::size_t>(n));
    if (angle_first)
      std::swap(x[0], x[1]);
    return x;
  }
  ksl::joint_space<double> bases;
  int n;
  bool angle_first;
};

double largest_difference(const double *x, const double *y, int n) {
  double worst = 0;
  for (int i = 0; i < n; ++i)
    worst = std::fmax(worst, std::fabs(x[i] - y[i]));
  return worst;
}

std::vector<double> normal_numbers(std::mt19937_64 &random, int n) {
  std::normal_distribution<double> normal;
  std::vector<double> x(static_cast<std::size_t>(n));
  for (double &e : x)
    e = normal(random);
  return x;
}

/// A position with quaternions of unit length.
std::vector<double> random_position(std::mt19937_64 &random, const ksl::joint_kind_row &row) {
  std::vector<double> q = normal_numbers(random, row.nq);
  if (row.quaternion >= 0) {
    double *x = q.data() + row.quaternion;
    const double length = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]);
    for (int i = 0; i < 4; ++i)
      x[i] /= length;
  }
  return q;
}

} // namespace

TEST_CASE("twist, effort and drive are those of the joint's bases") {
  std::mt19937_64 random(1);
  for_each_kind_of_body([&](auto j, ksl::joint_kind kind) {
    using J = decltype(j);
    const published_bases published(kind);
    const ksl::joint_space<double> &bases = published.bases;
    const int n = published.n;
    ksl::body<double> b{};
    b.pitch = pitch;
    for (int round = 0; round < 20; ++round) {
      const std::vector<double> rates = normal_numbers(random, J::nv), numbers = normal_numbers(random, 6);
      const ksl::coscrew<double> f = {{numbers[0], numbers[1], numbers[2]}, {numbers[3], numbers[4], numbers[5]}};
      ksl::screw<double> expected;
      const std::vector<double> ordered = published.ordered(rates);
      A::joint_space_twist(&bases, n, ordered.data(), &expected);
      const ksl::screw<double> twist = J::twist(b, rates.data());
      CHECK(largest_difference(&twist.lin.x, &expected.lin.x, 6) < 1e-15);

      double effort[J::nv];
      std::vector<double> expected_effort(static_cast<std::size_t>(n));
      J::effort(b, f, effort);
      A::joint_space_efforts(&bases, n, &f, expected_effort.data());
      CHECK(largest_difference(effort, published.ordered(expected_effort).data(), J::nv) < 1e-15);

      ksl::coscrew<double> expected_drive;
      A::joint_space_drive(&bases, n, ordered.data(), &expected_drive);
      const ksl::coscrew<double> drive = J::drive(b, rates.data());
      CHECK(largest_difference(&drive.lin.x, &expected_drive.lin.x, 6) < 1e-15);
    }
  });
}

/// The same bits.
template <class T> bool same(const T &x, const T &y) { return std::memcmp(&x, &y, sizeof(T)) == 0; }

TEST_CASE("general_joint computes what the struct of each of its kinds computes, to the bit") {
  using general = ksl::joint<ksl::general_kind>;
  std::mt19937_64 random(5);
  int kinds = 0;
  for_each_kind_of_body([&]<class J>(J, ksl::joint_kind kind) {
    if (!general::includes(kind))
      return;
    ++kinds;
    ksl::body<double> b{};
    b.kind = kind, b.nv = J::nv, b.pitch = pitch;
    for (int round = 0; round < 10; ++round) {
      const std::vector<double> v = normal_numbers(random, J::nv), dv = normal_numbers(random, J::nv),
                                x = normal_numbers(random, 40);
      const ksl::coscrew<double> f = {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
      const ksl::vec3<double> r = {x[6], x[7], x[8]};
      const ksl::mat3x3<double> R = {x[9], x[10], x[11], x[12], x[13], x[14], x[15], x[16], x[17]};
      const ksl::spatial_inertia<double> I = {x[18], {x[19], x[20], x[21]}, x[22], x[23], x[24], x[25], x[26], x[27]};
      const ksl::body_motion<double> carried = {{x[28], x[29], x[30]}, {x[31], x[32], x[33]}, {x[34], x[35], x[36]}};
      ksl::articulated_inertia<double> articulated;
      A::spatial_inertia_toArticulated(&I, &articulated);

      CHECK(same(general::twist(b, v.data()), J::twist(b, v.data())));
      CHECK(same(general::drive(b, v.data()), J::drive(b, v.data())));
      double effort[J::nv], expected_effort[J::nv];
      general::effort(b, f, effort), J::effort(b, f, expected_effort);
      CHECK(std::memcmp(effort, expected_effort, sizeof effort) == 0);
      ksl::body_motion<double> motion = carried, expected_motion = carried;
      general::add_motion(b, v.data(), dv.data(), motion), J::add_motion(b, v.data(), dv.data(), expected_motion);
      CHECK(same(motion, expected_motion));
      ksl::for_each_coordinate<J::nv>([&](auto k) {
        CHECK(same(general::momentum(k, b, I), J::momentum(k, b, I)));
        const auto S = general::column(k, b, R);
        const auto expected = J::column(k, b, R);
        ksl::screw<double> a = {f.lin, f.ang}, expected_a = a;
        S.add(x[37], a), expected.add(x[37], expected_a);
        CHECK(same(a, expected_a));
        CHECK(same(S.effort(f), expected.effort(f)));
        CHECK(same(S.twist(r), expected.twist(r)));
        CHECK(same(S.about(r), expected.about(r)));
        CHECK(same(S.momentum(articulated), expected.momentum(articulated)));
      });
      CHECK(ksl::shifts_origin<ksl::general_kind>(b) == J::shifts_origin);
    }
  });
  CHECK(kinds == 5);
}

TEST_CASE("what leads from one position to another leads there") {
  std::mt19937_64 random(2);
  for_each_moving_kind([&](auto j, ksl::joint_kind kind) {
    using J = decltype(j);
    const ksl::joint_kind_row row = ksl::row_of(kind);
    for (int round = 0; round < 50; ++round) {
      const std::vector<double> q = random_position(random, row);
      std::vector<double> dv = normal_numbers(random, J::nv);
      for (double &x : dv)
        x *= 0.4; // less than half a turn
      double moved[J::nq], back[J::nv];
      J::integrate(q.data(), dv.data(), moved);
      J::difference(q.data(), moved, back);
      CHECK(largest_difference(back, dv.data(), J::nv) < 1e-13);
    }
  });
}

TEST_CASE("a fixed joint has no numbers: nothing is read or written") {
  double untouched = 7;
  ksl::joint<ksl::joint_kind::fixed>::integrate<double>(nullptr, nullptr, &untouched);
  ksl::joint<ksl::joint_kind::fixed>::difference<double>(nullptr, nullptr, &untouched);
  CHECK(untouched == 7);
}

TEST_CASE("the drives of a universal joint with axes at a right angle are those of its bases") {
  // the second body's z is the second axis, and theta = 0 makes its x normal to both; the bases have axes x and y
  std::mt19937_64 random(5);
  for (const double angle : {0.0, 0.7, -2.1}) {
    ksl::joint_space<double> bases;
    REQUIRE(A::joint_space_set(&bases, KSL_JOINT_UNIVERSAL, 0, 0, 0) == 2);
    // canonical frame of the second body at theta = angle: z = e_y, x turned back from the normal e_z
    const double s = std::sin(angle), c = std::cos(angle);
    const ksl::mat3x3<double> R = {s, 0, c, c, 0, -s, 0, 1, 0}; // columns x, y, z in the axes of the bases
    for (int round = 0; round < 20; ++round) {
      const std::vector<double> x = normal_numbers(random, 6);
      const ksl::coscrew<double> f = {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
      ksl::coscrew<double> in_body, found, expected;
      A::product_CoAdrinvc(&R, &f, &in_body);
      found = {{0, 0, 0}, {0, 0, in_body.ang.z}}; // the drive of the second angle
      ksl::coscrew<double> held = {in_body.lin, {in_body.ang.x, in_body.ang.y, 0}}, carried;
      ksl::joint<ksl::joint_kind::universal>::move_first_drive(ksl::plane_rotation<double>{s, c}, held, found);
      A::product_CoAdrc(&R, &held, &held);
      A::joint_space_constraint(&bases, 2, &f, &carried);
      CHECK(largest_difference(&held.lin.x, &carried.lin.x, 6) < 1e-14);
      A::product_CoAdrc(&R, &found, &found);
      A::joint_space_actuation(&bases, 2, &f, &expected);
      CHECK(largest_difference(&found.lin.x, &expected.lin.x, 6) < 1e-14);
    }
  }
}

TEST_CASE("the angle of a planar joint takes the short way round") {
  const double q0[3] = {0, 0, 3}, q1[3] = {0, 0, -3};
  double dv[3];
  ksl::joint<ksl::joint_kind::planar>::difference(q0, q1, dv);
  CHECK(dv[2] == doctest::Approx(2 * std::acos(-1.0) - 6).epsilon(1e-14));
}

TEST_CASE("a continuous joint takes the short way round") {
  const double q0 = 3, q1 = -3;
  double dv;
  ksl::joint<ksl::joint_kind::continuous>::difference(&q0, &q1, &dv);
  CHECK(dv == doctest::Approx(2 * std::acos(-1.0) - 6).epsilon(1e-14));
}

// The following numbers were computed at 420 bits, from poses alone, without spatial algebra.

TEST_CASE("positions after a tenth of a second") {
  const auto check = [](auto j, std::vector<double> q, std::vector<double> v, std::vector<double> expected) {
    using J = decltype(j);
    for (double &x : v)
      x *= 0.1;
    double moved[J::nq];
    J::integrate(q.data(), v.data(), moved);
    CHECK(largest_difference(moved, expected.data(), J::nq) < 1e-15);
  };
  check(ksl::joint<ksl::joint_kind::helical>(), {1.2812554481053793}, {-1.98}, {1.0832554481053793});
  check(ksl::joint<ksl::joint_kind::cylindrical>(), {-0.797071183009773, 0.12023282598488372}, {-0.263, 2.482},
        {-0.823371183009773, 0.36843282598488375});
  check(ksl::joint<ksl::joint_kind::universal>(), {0.7613960547684804, -1.3227561578725324}, {0.731, 1.749},
        {0.8344960547684803, -1.1478561578725324});
  check(ksl::joint<ksl::joint_kind::planar>(), {0.4032409817018343, -0.470796889030335, 1.5780047475042736},
        {0.777, -0.683, 0.1}, {0.4705870405252575, -0.39226919215581835, 1.5880047475042736});
  check(ksl::joint<ksl::joint_kind::translation>(), {-0.20820135776744497, 0.27021613149481327, -0.18668628296713008},
        {3.32, 0.559, -0.418}, {0.12379864223255502, 0.3261161314948133, -0.22848628296713008});
  check(ksl::joint<ksl::joint_kind::spherical>(),
        {-0.6057384859894979, -0.7744935128313428, 0.17674595412320598, -0.04473871784478234}, {0.613, 0.278, 0.263},
        {-0.6193526678727955, -0.761229915973011, 0.19135753300610495, -0.01770825763282895});
  check(ksl::joint<ksl::joint_kind::floating>(),
        {0.3041831405019255, 0.11903132840831587, 0.46261695552215865, 0.6141878353084771, 0.17696598753799536,
         0.26427581492711594, -0.722228935904951},
        {1.124, 0.493, -0.204, -1.055, -0.104, -0.383},
        {0.4206672042983105, 0.08339317106795509, 0.48784788471517165, 0.6492764765195576, 0.1782609148797904,
         0.2838175051176996, -0.6827230236730947});
}

TEST_CASE("where a helical joint on a revolute one carries its link") {
  ksl::robot_description r;
  r.name = "screw";
  r.links = {robots::link("world"), robots::link("b00", robots::solid(1, {0, 0, 0}, 1, 1, 1)),
             robots::link("b01", robots::solid(1, {0, 0, 0}, 1, 1, 1))};
  r.joints = {robots::joint("j00", ksl::joint_kind::revolute, 0, 1, {-0.1645, 0.3382, 0.2955},
                            {0.7321866876650546, 0.48842847443429716, 0.47470019988184237}),
              robots::joint("j01", ksl::joint_kind::helical, 1, 2, {-0.0064, -0.2168, -0.3255},
                            {-0.7088489926073881, -0.5780664594032374, -0.40419336238055187})};
  r.joints[0].placement.R = {-0.5852454887743694, 0.7239361215526596,  0.3652454103483601,
                             0.40782556470191,    0.6521239511214205,  -0.6390717183144277,
                             -0.7008323812758778, -0.2250574244167027, -0.6768922580958527};
  r.joints[1].placement.R = {0.51490753885955,     -0.7380179901819989, -0.4361188743832626,
                             0.8556855464485834,   0.4118065334132974,  0.31339691229671,
                             -0.05169595752658146, -0.5345510501400643, 0.8435536158238931};
  r.joints[1].pitch = -0.0776;
  const ksl::model m(r);
  ksl::data d(m);
  const double q[2] = {-1.0017744261111723, 1.2812554481053793};
  const ksl::SE3<double> D = ksl::frame_pose(m, d, q, m.find_link("b01"));
  const double expected[12] = {-0.473366920113245,  -0.7625218605789216, -0.4410035953161384,  -0.7883217045692268,
                               0.14333767430104902, 0.5983336871938894,  -0.39303008669511474, 0.6308840806877489,
                               -0.6689638463229568, -0.3133171854827434, 0.063595934264609,    0.5639721561439568};
  CHECK(largest_difference(&D.R.m00, expected, 12) < 1e-15);
}

TEST_CASE("the robot with every kind of joint has every kind") {
  const ksl::model m = ksl::load(every_kind_file);
  for (const ksl::joint_kind kind : ksl::joint_kinds) {
    const std::string name = ksl::row_of(kind).name;
    CAPTURE(name);
    CHECK(std::any_of(m.joints().begin(), m.joints().end(),
                      [&](const ksl::joint_row &j) { return j.kind == kind && j.name != "base"; }));
  }
}
