// Finite arguments give finite results, or an error that says why.  C++, one state and batches, and the statuses of C.
#include "allocation.hpp"
#include "robots.hpp"

#include "batch/compute_batch.hpp"
#include "batch/threads.hpp"
#include "engine/kernels/algorithm_rows.hpp"
#include "ksl/batch.hpp"
#include "ksl/engine.h"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <thread>
#include <vector>

namespace {

/// Its first link has no mass: where it is straight, the shoulder moves none.
ksl::model bars() { return ksl::model(robots::double_pendulum(0, 1, 2, 1)); }

constexpr double pi = 3.14159265358979323846;

/// A palm on a wrist, and a finger on each side of it; the right one mimics the left one, with factor −1.
ksl::robot_description hand(double left_mass, double right_mass) {
  const auto finger = [](const char *name, double m) {
    return m > 0 ? robots::link(name, robots::solid(m, {0, 0, 0.1}, 0.1, 0.1, 0.1)) : robots::link(name);
  };
  ksl::robot_description r;
  r.name = "hand";
  r.links = {robots::link("ground"), robots::link("palm", robots::solid(1, {0.1, 0, 0}, 1, 1, 1)),
             finger("left", left_mass), finger("right", right_mass)};
  r.joints = {robots::joint("wrist", ksl::joint_kind::continuous, 0, 1, {0, 0, 0}, {0, 1, 0}),
              robots::joint("finger", ksl::joint_kind::continuous, 1, 2, {0, 0.1, 0.2}, {1, 0, 0}),
              robots::joint("other", ksl::joint_kind::continuous, 1, 3, {0, -0.1, 0.2}, {1, 0, 0})};
  r.joints[2].mimic = ksl::mimic_description{"finger", -1, 0, {}};
  return r;
}

const std::string &name_of_joint(const ksl::model &m, int joint) {
  return m.joints()[static_cast<std::size_t>(joint)].name;
}

/// Arguments of any algorithm for n states of a robot whose q and v have the same length, and room for its results.
template <class S> struct any_batch {
  std::vector<S> q, v, wrench;
  std::vector<std::vector<S>> result;
  int link;
  ksl::external_rows<S> external;
  ksl::batch_view<S> batch;

  any_batch(const ksl::algorithm_row &row, const ksl::model &m, std::size_t n, int of_link)
      : q(n * static_cast<std::size_t>(m.nq()), S(0.3)), v(n * static_cast<std::size_t>(m.nv()), S(0.2)),
        wrench(6 * n, S(1)), link(of_link), external{of_link, {wrench.data(), 6}} {
    batch.n = n, batch.q = {q.data(), m.nq()}, batch.v = batch.a = batch.tau = {v.data(), m.nv()};
    batch.external_n = 1, batch.external = &external;
    batch.links = {1, &link};
    for (int r = 0; r < row.results; ++r) {
      const std::ptrdiff_t width =
          ksl::numbers_of(row.result[r], {m.nq(), m.nv(), 1, 0, m.tree_elements(), static_cast<int>(m.links().size())});
      result.emplace_back(n * static_cast<std::size_t>(width));
      batch.result[r] = {result.back().data(), width};
    }
  }
  bool has_nan() const {
    return std::any_of(result.begin(), result.end(), [](const std::vector<S> &x) {
      return std::any_of(x.begin(), x.end(), [](S y) { return std::isnan(y); });
    });
  }
};

/// The joint that the error of a batch names, or −2 where there is no error.
template <class S>
int joint_of_error(const ksl::algorithm_row &row, const ksl::model &m, const ksl::batch_view<S> &batch) {
  try {
    ksl::compute_batch(row, m, batch, 1);
  } catch (const ksl::result_error &e) {
    return e.joint;
  }
  return -2;
}

template <class S> void expect_undetermined(const ksl::model &m) {
  const int finger = m.find_joint("finger");
  for (const ksl::algorithm_row *row : ksl::rows::all)
    for (const std::size_t n : {1u, 11u}) {
      if (!row->needs_mass || row->loops == ksl::loops_by::plan || row->mimic == ksl::mimic_by::refusal)
        continue;
      CAPTURE(row->name);
      CAPTURE(n);
      any_batch<S> x(*row, m, n, m.find_link("palm"));
      CHECK(joint_of_error(*row, m, x.batch) == finger);
      CHECK(x.has_nan());
    }
}

} // namespace

TEST_CASE("finite results: overflow is an error of one state and of batches, NaN in is NaN out") {
  const ksl::model m(robots::double_pendulum(1, 1, 1, 1));
  ksl::data d(m);
  const double q[2] = {0.3, 0.4}, v[2] = {1e200, 1}, a[2] = {0, 0}, nan[2] = {std::nan(""), 0};
  double tau[2];
  ksl::inverse_dynamics(m, d, q, v, a, tau); // of one state in C++ it isn't looked for, since it would take time
  CHECK(!std::isfinite(tau[0]));
  CHECK_THROWS_WITH_AS(ksl::forward_dynamics(m, d, q, v, a, tau), doctest::Contains("forward_dynamics: a[0] is"),
                       ksl::result_error);
  ksl::inverse_dynamics(m, d, q, nan, a, tau); // arguments of C++ calls are not checked
  CHECK(std::isnan(tau[0]));
  const float qf[2] = {0.3f, 0.4f}, vf[2] = {1e30f, 1}, af[2] = {0, 0};
  float tauf[2];
  CHECK_THROWS_WITH_AS(ksl::forward_dynamics(m, d, qf, vf, af, tauf), doctest::Contains("single precision"),
                       ksl::result_error);

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

TEST_CASE("finite results: an upper triangle, and a centre of mass, that single precision can't hold") {
  const ksl::model m(robots::double_pendulum(1, 1e25, 1, 1e25)), far(robots::pendulum(1, 1e39));
  const float q[4] = {0.3f, 0.4f, 0.3f, 0.4f};
  float M[8], c[6];
  ksl::batch_view<float> batch;
  batch.n = 2, batch.q = {q, 2}, batch.result[0] = {M, 4};
  CHECK_THROWS_WITH_AS(ksl::mass_matrix_upper_batch(m, batch, 1),
                       doctest::Contains("mass_matrix_upper: state 0: M[0] is"), ksl::result_error);
  batch.q = {q, 1}, batch.result[0] = {c, 3};
  CHECK_THROWS_WITH_AS(ksl::center_of_mass_batch(far, batch, 1),
                       doctest::Contains("too large or too small for single precision"), ksl::result_error);
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
      CHECK(std::string(e.what()).find("joint shoulder, at this position, can move without moving any mass") !=
            std::string::npos);
    }
    double in_place[2] = {1, -1}, position[2] = {q[0], q[1]};
    CHECK_THROWS_AS(ksl::forward_dynamics(m, d, q, v, in_place, in_place), ksl::result_error);
    try { // the position is not known any more, so that no joint is named, and large numbers pass
      ksl::forward_dynamics(m, d, position, v, tau, position);
      CHECK(std::fabs(position[0]) > 1e10);
    } catch (const ksl::result_error &e) {
      CHECK(e.joint == -1);
      CHECK_FALSE(std::isfinite(position[0]));
    }
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
  CHECK(m.description().warnings[0].find(
            "forward dynamics are refused: joint wrist can move without moving any mass") == 0);
  CHECK(ksl::model(m.description()).description().warnings.size() == 1);
  const double q[3] = {0.1, 0.2, 0.3}, zero[3] = {0, 0, 0};
  double a[3];
  CHECK_THROWS_WITH_AS(ksl::forward_dynamics(m, d, q, zero, zero, a),
                       doctest::Contains("joint wrist can move without moving any mass"), ksl::result_error);
}

TEST_CASE("finite results: fingers without mass that move together leave nothing determined: NaN, and an error that "
          "names the leader") {
  const ksl::model m(hand(0, 0));
  REQUIRE(m.massless_joint() == m.find_joint("finger"));
  expect_undetermined<double>(m);
  expect_undetermined<float>(m);
}

TEST_CASE("finite results: where the acceleration of a joint without mass is given, the others are determined") {
  const ksl::model m(hand(0, 0));
  ksl::data d(m);
  const double q[2] = {0.3, 0.4}, v[2] = {0.5, -0.6}, a[2] = {0, 0.7}, tau[2] = {1.5, 0};
  const int finger = m.find_link("left");
  double found[2], efforts[2], expected[2];
  ksl::hybrid_dynamics(m, d, q, v, a, tau, 1, &finger, found, efforts);
  CHECK(found[1] == 0.7);
  CHECK(efforts[0] == 1.5);
  ksl::inverse_dynamics(m, d, q, v, found, expected);
  CHECK(expected[0] == doctest::Approx(1.5).epsilon(1e-14));
  CHECK(efforts[1] == doctest::Approx(expected[1]).epsilon(1e-14));
}

TEST_CASE("finite results: one finger with mass is enough, whichever it is, and only large results are results") {
  for (const auto &[left, right] : {std::pair{0.0, 1.0}, {1.0, 0.0}}) {
    const ksl::model m(hand(left, right));
    CHECK(m.massless_joint() == -1);
    ksl::data d(m);
    const double q[2] = {0.3, 0.4}, v[2] = {0, 0}, tau[2] = {1e15, -1e15};
    double a[2], back[2];
    ksl::forward_dynamics(m, d, q, v, tau, a); // large, so that each is examined
    CHECK(std::fabs(a[1]) > 1e12);
    ksl::inverse_dynamics(m, d, q, v, a, back);
    CHECK(back[0] == doctest::Approx(1e15).epsilon(1e-12));
    CHECK(back[1] == doctest::Approx(-1e15).epsilon(1e-12));
  }
}

TEST_CASE("finite results: with mimic joints, too, a joint that moves no mass at one position is named") {
  for (const double length : {1.0, 0.37, 0.61, 1.83, 0.05}) {
    ksl::robot_description r = robots::double_pendulum(0, length, 1.7, length);
    r.links.push_back(robots::link("left", robots::solid(1, {0, 0, 0.1}, 1, 1, 1)));
    r.links.push_back(robots::link("right", robots::solid(1, {0, 0, 0.1}, 1, 1, 1)));
    r.joints.push_back(robots::joint("finger", ksl::joint_kind::continuous, 0, 3, {1, 0, 0}, {1, 0, 0}));
    r.joints.push_back(robots::joint("other", ksl::joint_kind::continuous, 0, 4, {-1, 0, 0}, {1, 0, 0}));
    r.joints[3].mimic = ksl::mimic_description{"finger", 1, 0, {}};
    const ksl::model m(r);
    CHECK(m.massless_joint() == -1);
    REQUIRE(m.nv() == 3);
    for (const double angle :
         {0.0, pi}) { // stretched, turns of 1 and −2 leave the point where it is; folded, it lies on the shoulder
      CAPTURE(length);
      CAPTURE(angle);
      any_batch<double> x(ksl::rows::forward_dynamics, m, 9, 0);
      x.batch.external_n = 0;
      x.q[4 * 3 + 1] = angle;
      const int joint = joint_of_error(ksl::rows::forward_dynamics, m, x.batch);
      REQUIRE(joint >= 0);
      CHECK((name_of_joint(m, joint) == "shoulder" || name_of_joint(m, joint) == "elbow"));
    }
  }
}

TEST_CASE("finite results: with mimic joints and hundreds of coordinates it is not known which joint moves no mass; "
          "the number is named") {
  ksl::robot_description r = hand(0, 0);
  std::vector<std::string> names;
  for (int k = 0; k < 500; ++k)
    names.push_back("beside" + std::to_string(k));
  for (const std::string &name : names) {
    r.links.push_back(robots::link(name.c_str(), robots::solid(1, {0.1, 0, 0}, 1, 1, 1)));
    r.joints.push_back(robots::joint(("to_" + name).c_str(), ksl::joint_kind::continuous, 0,
                                     static_cast<int>(r.links.size()) - 1, {0, 0, 0}, {0, 0, 1}));
  }
  const ksl::model m(r);
  CHECK(m.massless_joint() == -1);
  any_batch<double> x(ksl::rows::forward_dynamics, m, 1, 0);
  x.batch.external_n = 0;
  CHECK_THROWS_WITH_AS(ksl::forward_dynamics_batch(m, x.batch, 1), doctest::Contains("forward_dynamics: a[0] is nan"),
                       ksl::result_error);
}

TEST_CASE("finite results: a universal joint whose first axis passes through the mass is named") {
  ksl::robot_description r = robots::pendulum(1, 1);
  r.links[1].inertia = robots::solid(1, {1, 0, 0}); // on the first axis, x, unless the joint is turned about the second
  r.joints[0].kind = ksl::joint_kind::universal, r.joints[0].axis = {1, 0, 0}, r.joints[0].axis2 = {0, 1, 0};
  const ksl::model m(r);
  CHECK(m.massless_joint() == -1);
  ksl::data d(m);
  const double q[2] = {0.3, 0}, turned[2] = {0.3, 0.4}, v[2] = {0, 0}, tau[2] = {1, 1};
  double a[2];
  CHECK_THROWS_WITH_AS(ksl::forward_dynamics(m, d, q, v, tau, a), doctest::Contains("joint shoulder, at this position"),
                       ksl::result_error);
  ksl::forward_dynamics(m, d, turned, v, tau, a);
  const double lever = std::sin(0.4), weight = 9.81 * lever * std::sin(0.3); // about the first axis
  CHECK(a[0] == doctest::Approx((1 - weight) / (lever * lever)).epsilon(1e-12));
}

TEST_CASE("finite results: a free joint that carries no inertia is named") {
  ksl::robot_description r = robots::pendulum(1, 1);
  r.links.push_back(robots::link("loose"));
  r.joints.push_back(robots::joint("free", ksl::joint_kind::floating, 0, 2, {0, 0, 0}, {0, 0, 1}));
  const ksl::model without(r);
  REQUIRE(without.massless_joint() >= 0);
  CHECK(name_of_joint(without, without.massless_joint()) == "free");
  r.links.back() = robots::link("loose", robots::solid(1, {0, 0, 0}, 1, 1, 1));
  CHECK(ksl::model(r).massless_joint() == -1);
  r.links.back() = robots::link("loose", robots::solid(1, {0, 0, 1}, 0, 0, 0)); // a point, about which it turns freely
  const ksl::model point(r);
  REQUIRE(point.massless_joint() >= 0);
  CHECK(name_of_joint(point, point.massless_joint()) == "free");
}

#ifdef COUNTS_MALLOC
namespace {

/// Accelerations of a batch whose efforts are ordinary numbers first, and then so large that each result is examined.
template <class S> void expect_no_allocation(const ksl::model &m, std::size_t n, int threads) {
  any_batch<S> x(ksl::rows::forward_dynamics, m, n, 2);
  const auto accelerations = [&] { ksl::forward_dynamics_batch(m, x.batch, threads); };
  accelerations(); // makes threads, and gets the memory that they keep
  std::vector<S> at_rest(x.v.size()), large(x.v.size(), S(1e15));
  x.batch.v = {at_rest.data(), m.nv()}, x.batch.tau = {large.data(), m.nv()};
  const long before = allocations;
  accelerations();
  CHECK(allocations == before);
  CHECK(std::any_of(x.result[0].begin(), x.result[0].end(),
                    [](S a) { return std::fabs(a) > S(1e11); })); // they were examined
}

template <class S> void expect_no_allocation_of_one_state(const ksl::model &m) {
  ksl::data d(m);
  std::vector<S> q(static_cast<std::size_t>(m.nq()), S(0.3)), v(static_cast<std::size_t>(m.nv())),
      tau(v.size(), S(1e15)), a(v.size());
  const long before = allocations;
  ksl::forward_dynamics(m, d, q.data(), v.data(), tau.data(), a.data());
  CHECK(allocations == before);
  CHECK(std::any_of(a.begin(), a.end(), [](S x) { return std::fabs(x) > S(1e11); }));
}

} // namespace

TEST_CASE("finite results: large results are examined, and NaN passes, without an allocation") {
  ksl::assume_cores(3);
  const ksl::model straight(robots::double_pendulum(1, 1, 1, 1)), with_mimic(hand(0, 1));
  for (const ksl::model *m : {&straight, &with_mimic})
    for (const auto &[n, threads] : {std::pair{1u, 1}, {2u, 1}, {9u, 1}, {3000u, 3}})
      std::thread([&, n = n, threads = threads] { // a new one, which keeps no memory yet
        expect_no_allocation<double>(*m, n, threads);
        expect_no_allocation<float>(*m, n, threads);
        expect_no_allocation_of_one_state<double>(*m);
        expect_no_allocation_of_one_state<float>(*m);
      })
          .join();

  std::thread([&] { // arguments of C++ calls are not checked
    any_batch<double> x(ksl::rows::inverse_dynamics_with_reactions, straight, 9, 2);
    const int links[2] = {1, 2};
    ksl::reaction_request request;
    request.n = 2, request.link = links;
    std::vector<double> wrenches(9 * 12);
    const ksl::reaction_rows<double> wanted = {request, {wrenches.data(), 12}};
    x.batch.reactions_n = 1, x.batch.reactions = &wanted;
    ksl::inverse_dynamics_with_reactions_batch(straight, x.batch, 1);
    x.v[2 * 7] = std::nan("");
    const long before = allocations;
    ksl::inverse_dynamics_with_reactions_batch(straight, x.batch, 1);
    CHECK(allocations == before);
    CHECK(std::isnan(wrenches[7 * 12]));
    CHECK(std::isfinite(wrenches[6 * 12]));
  })
      .join();
  ksl::assume_cores(0);
}
#endif

TEST_CASE("finite results: the status of C") {
  ksl_model_t *m = nullptr;
  ksl_data_t *d = nullptr;
  REQUIRE(ksl_model_load(robot_file("panda").c_str(), nullptr, &m) == KSL_OK);
  REQUIRE(ksl_data_create(m, &d) == KSL_OK);
  const int nv = ksl_model_nv(m);
  std::vector<double> q(static_cast<std::size_t>(nv), 0.3), v(static_cast<std::size_t>(nv), 1e200),
      out(static_cast<std::size_t>(nv));
  CHECK(ksl_bias(m, d, q.data(), v.data(), nullptr, out.data()) == KSL_NOT_FINITE);
  CHECK(std::string(ksl_error_message()).find("bias: tau[") == 0);
  CHECK(ksl_bias_batch(m, 1, q.data(), nv, v.data(), nv, out.data(), nv, 1) == KSL_NOT_FINITE);
  CHECK(std::string(ksl_error_message()).find("bias: tau[") == 0);
  CHECK(ksl_bias(m, d, q.data(), q.data(), nullptr, out.data()) == KSL_OK);
  ksl_data_free(d);
  ksl_model_free(m);
}

namespace {

/// ur5 from C: n numbers are numbers of q, v, a or wrenches.
struct arm_in_c {
  ksl_model_t *m = nullptr;
  ksl_data_t *d = nullptr;
  std::vector<double> q, v, a, out = std::vector<double>(6);
  std::vector<float> qf, vf, af, outf = std::vector<float>(6);

  arm_in_c() {
    REQUIRE(ksl_model_load(robot_file("ur5").c_str(), nullptr, &m) == KSL_OK);
    REQUIRE(ksl_data_create(m, &d) == KSL_OK);
    const auto n = static_cast<std::size_t>(ksl_model_nv(m));
    q.assign(n, 0.3), v.assign(n, 0.2), a.assign(n, 0.1), qf.assign(n, 0.3f), vf.assign(n, 0.2f), af.assign(n, 0.1f);
  }
  ~arm_in_c() { ksl_data_free(d), ksl_model_free(m); }
};

void expect_not_finite(ksl_status_t status, const char *words) {
  CHECK(status == KSL_NOT_FINITE);
  CHECK(std::string(ksl_error_message()).find(words) == 0);
  CHECK(std::string(ksl_error_message()).find("although all arguments are finite") != std::string::npos);
}

} // namespace

TEST_CASE("finite results: the status of a section in C") {
  arm_in_c arm;
  const auto in_double = [&](const ksl_section_t &s) {
    return ksl_section_wrench(arm.m, arm.d, arm.q.data(), arm.v.data(), arm.a.data(), nullptr, &s, arm.out.data());
  };
  const auto in_float = [&](const ksl_section_t &s) {
    return ksl_section_wrenchf(arm.m, arm.d, arm.qf.data(), arm.vf.data(), arm.af.data(), nullptr, &s, arm.outf.data());
  };
  const ksl_section_t usual = ksl_section(ksl_model_link(arm.m, "forearm_link"));
  ksl_section_t far = usual, heavy = usual, far_for_float = usual;
  far.point[0] = far.point[1] = 1e308, far_for_float.point[0] = far_for_float.point[1] = 1e38;
  heavy.share = KSL_INERTIA;
  std::fill(heavy.inertia, heavy.inertia + 10, 1e308);
  CHECK(in_double(usual) == KSL_OK);
  CHECK(in_float(usual) == KSL_OK);
  expect_not_finite(in_double(far), "section_wrench: wrench[");
  expect_not_finite(in_double(heavy), "section_wrench: wrench[");
  expect_not_finite(in_float(heavy), "section_wrench: wrench[");
  CHECK(in_double(far_for_float) == KSL_OK);
  expect_not_finite(in_float(far_for_float), "section_wrench: wrench[");
  arm.v[0] = 1e200, arm.vf[0] = 1e30f;
  expect_not_finite(in_double(usual), "section_wrench: wrench[");
  expect_not_finite(in_float(usual), "section_wrench: wrench[");
}

TEST_CASE("finite results: the status of reactions of the last state in C") {
  arm_in_c arm;
  std::vector<double> tau(arm.q.size());
  std::vector<float> tauf(arm.q.size());
  const int joint = 1;
  ksl_reaction_options_t far{};
  for (double &x : far.offset)
    x = 1e308;
  REQUIRE(ksl_inverse_dynamics(arm.m, arm.d, arm.q.data(), arm.v.data(), arm.a.data(), nullptr, tau.data()) == KSL_OK);
  expect_not_finite(ksl_reactions(arm.m, arm.d, 1, &joint, &far, nullptr, arm.out.data()), "reactions: wrenches[");
  CHECK(ksl_reactions(arm.m, arm.d, 1, &joint, nullptr, nullptr, arm.out.data()) == KSL_OK); // the state is still there
  CHECK(std::all_of(arm.out.begin(), arm.out.end(), [](double x) { return std::isfinite(x); }));
  const float *const qf = arm.qf.data(), *const vf = arm.vf.data(), *const af = arm.af.data();
  REQUIRE(ksl_inverse_dynamicsf(arm.m, arm.d, qf, vf, af, nullptr, tauf.data()) == KSL_OK);
  expect_not_finite(ksl_reactionsf(arm.m, arm.d, 1, &joint, &far, nullptr, arm.outf.data()), "reactions: wrenches[");
}

TEST_CASE("finite results: the status of inverse kinematics in C, and weights and tolerances that are not finite") {
  arm_in_c arm;
  const auto n = static_cast<std::ptrdiff_t>(arm.q.size());
  std::vector<double> targets(32), found(2 * arm.q.size()), errors(4);
  for (std::size_t i : {0u, 5u, 10u, 15u})
    targets[i] = targets[16 + i] = 1;
  targets[3] = 0.3, targets[16 + 3] = 1e308;
  const std::vector<float> target_of_float = {1, 0, 0, 1e30f, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  std::vector<float> found_float(arm.q.size()), errors_float(2);
  ksl_wanted_frame_t frame = {ksl_model_link(arm.m, "tool0"), 1, 1};
  ksl_inverse_kinematics_options_t options = ksl_inverse_kinematics_options();
  const auto solved = [&](std::size_t first, std::size_t count) {
    return ksl_inverse_kinematics(arm.m, count, 1, &frame, targets.data() + 16 * first, 16, nullptr, 0, &options,
                                  found.data(), n, errors.data(), 2, nullptr, nullptr, nullptr, 1);
  };
  CHECK(solved(0, 1) == KSL_OK);
  expect_not_finite(solved(1, 1), "inverse_kinematics: errors[0] is inf");
  expect_not_finite(solved(0, 2), "inverse_kinematics: state 1: errors[0] is inf");
  expect_not_finite(ksl_inverse_kinematicsf(arm.m, 1, 1, &frame, target_of_float.data(), 16, nullptr, 0, nullptr,
                                            found_float.data(), n, errors_float.data(), 2, nullptr, nullptr, nullptr,
                                            1),
                    "inverse_kinematics: errors[0] is inf");
  for (const double bad : {HUGE_VAL, std::nan("")}) {
    for (double *const weight : {&frame.position_weight, &frame.orientation_weight}) {
      *weight = bad;
      CHECK(solved(0, 1) == KSL_BAD_ARGUMENT);
      CHECK(std::string(ksl_error_message()) == "weights must not be negative, nor infinite");
      *weight = 1;
    }
    for (double *const tolerance : {&options.position_tolerance, &options.orientation_tolerance}) {
      *tolerance = bad;
      CHECK(solved(0, 1) == KSL_BAD_ARGUMENT);
      CHECK(std::string(ksl_error_message()) == "tolerances must be positive and finite");
      *tolerance = 1e-6;
    }
  }
  CHECK(solved(0, 1) == KSL_OK);
}

TEST_CASE("finite results: places and random positions of joints with huge limits, in C") {
  const std::string mass = "'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>"
                           "</inertial></link>",
                    limit = "<axis xyz='1 0 0'/><limit lower='-1.7e308' upper='1.7e308' effort='1' velocity='1'/>"
                            "</joint>",
                    links = "<link name='a" + mass + "<link name='b" + mass + "<link name='c" + mass,
                    slide = " type='prismatic'><parent link=",
                    text = "<robot name='slides'>" + links +                              //
                           "<joint name='j'" + slide + "'a'/><child link='b'/>" + limit + //
                           "<joint name='k'" + slide + "'b'/><child link='c'/>" + limit + "</robot>";
  ksl_model_t *m = nullptr;
  ksl_data_t *d = nullptr;
  REQUIRE(ksl_model_load_memory(text.data(), text.size(), nullptr, &m) == KSL_OK);
  REQUIRE(ksl_data_create(m, &d) == KSL_OK);
  const double far[2] = {1.5e308, 1.5e308}, near[2] = {1, 2}, uniform[2] = {0, 0.75};
  const float uniform_float[2] = {0.5f, 0.75f};
  ksl_SE3_t pose;
  expect_not_finite(ksl_frame_pose(m, d, far, ksl_model_link(m, "c"), &pose), "frame_pose: position[0] is inf");
  CHECK(ksl_frame_pose(m, d, near, ksl_model_link(m, "c"), &pose) == KSL_OK);
  double q[2];
  float qf[2];
  CHECK(ksl_random_position(m, uniform, q) == KSL_OK);
  CHECK(q[0] == 1.7e308);
  CHECK(q[1] == doctest::Approx(-0.85e308));
  expect_not_finite(ksl_random_positionf(m, uniform_float, qf), "random_position: q[1] is -inf");
  ksl_data_free(d);
  ksl_model_free(m);
}
