// Robots with mimic joints: what is solved with their mass matrix, against its definition and against central differences.
#include "matrices.hpp"
#include "robots.hpp"

#include "ksl/dynamics.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace {

using matrices::identity, matrices::numbers, matrices::product, matrices::transposed;

constexpr double h = 1e-6; ///< step of central differences

void check_equal(const numbers &found, const numbers &expected, double error) {
  CHECK(matrices::difference(found, expected) <= error);
}

/// A state of the robot, and two wrenches.
struct state {
  const ksl::model m = ksl::load(KSL_COUPLED);
  ksl::data d{m};
  std::size_t nq = static_cast<std::size_t>(m.nq()), nv = static_cast<std::size_t>(m.nv());
  numbers q = numbers(nq), v = numbers(nv), a = numbers(nv), tau = numbers(nv), push = numbers(12);
  int pushed[2] = {4, 7};
  ksl::external_wrenches<double> external{2, pushed, push.data()};

  explicit state(unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (numbers *x : {&q, &v, &a, &tau, &push})
      std::generate(x->begin(), x->end(), [&] { return normal(random); });
    robots::normalize_quaternions(m, q.data());
  }
  state(const state &) = delete;

  numbers moved(std::size_t coordinate, double step) {
    numbers along(nv), to(nq);
    along[coordinate] = step;
    ksl::integrate(m, d, q.data(), along.data(), to.data());
    return to;
  }
  numbers mass_matrix() {
    numbers M(nv * nv);
    ksl::mass_matrix(m, d, q.data(), M.data());
    return M;
  }
  numbers efforts(const numbers &speeds, const numbers &accelerations, const ksl::external_wrenches<double> &wrenches) {
    numbers out(nv);
    ksl::inverse_dynamics(m, d, q.data(), speeds.data(), accelerations.data(), out.data(), wrenches);
    return out;
  }
  numbers accelerations(const numbers &at, const numbers &speeds) {
    numbers out(nv);
    ksl::forward_dynamics(m, d, at.data(), speeds.data(), tau.data(), out.data(), external);
    return out;
  }
  /// By q, v and tau.
  std::vector<numbers> derivatives(const numbers &at, const numbers &speeds) {
    std::vector<numbers> out(3, numbers(nv * nv));
    ksl::forward_dynamics_derivatives(m, d, at.data(), speeds.data(), tau.data(), out[0].data(), out[1].data(),
                                      out[2].data(), external);
    return out;
  }
  /// Jacobians of links below each other.
  numbers jacobians(const std::vector<int> &links) {
    numbers all;
    for (int link : links) {
      numbers J(6 * nv);
      ksl::jacobian(m, d, q.data(), link, {}, J.data());
      all.insert(all.end(), J.begin(), J.end());
    }
    return all;
  }
};

/// The column of central differences of f along a coordinate, which moves q (or v).
template <class F> numbers difference(F f, const numbers &before, const numbers &after) {
  const numbers low = f(before), high = f(after);
  numbers out(low.size());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = (high[i] - low[i]) / (2 * h);
  return out;
}

} // namespace

TEST_CASE(
    "coupled: derivatives of forward dynamics are central differences, and those by efforts invert the mass matrix") {
  for (unsigned seed : {1u, 2u}) {
    state s(seed);
    const std::vector<numbers> found = s.derivatives(s.q, s.v);
    numbers by_q, by_v; // transposed
    for (std::size_t k = 0; k < s.nv; ++k) {
      const auto at_q = [&](const numbers &q) { return s.accelerations(q, s.v); };
      const auto at_v = [&](const numbers &v) { return s.accelerations(s.q, v); };
      numbers less = s.v, more = s.v;
      less[k] -= h, more[k] += h;
      const numbers one = difference(at_q, s.moved(k, -h), s.moved(k, h)), two = difference(at_v, less, more);
      by_q.insert(by_q.end(), one.begin(), one.end()), by_v.insert(by_v.end(), two.begin(), two.end());
    }
    check_equal(found[0], transposed(by_q, s.nv), 1e-7);
    check_equal(found[1], transposed(by_v, s.nv), 1e-7);
    check_equal(product(s.mass_matrix(), found[2], s.nv), identity(s.nv), 1e-10);
  }
}

TEST_CASE("coupled: second derivatives of forward dynamics are central differences of the first") {
  state s(3);
  const std::size_t n = s.nv, cube = n * n * n;
  numbers qq(cube), vv(cube), qv(cube), qtau(cube), expected_qq(cube), expected_vv(cube), expected_qv(cube),
      expected_qtau(cube);
  ksl::forward_dynamics_second_derivatives(s.m, s.d, s.q.data(), s.v.data(), s.tau.data(), qq.data(), vv.data(),
                                           qv.data(), qtau.data(), s.external);
  for (std::size_t k = 0; k < n; ++k) {
    numbers less = s.v, more = s.v;
    less[k] -= h, more[k] += h;
    const std::vector<numbers> low = s.derivatives(s.moved(k, -h), s.v), high = s.derivatives(s.moved(k, h), s.v);
    const std::vector<numbers> slow = s.derivatives(s.q, less), fast = s.derivatives(s.q, more);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) {
        expected_qq[(i * n + j) * n + k] = (high[0][i * n + j] - low[0][i * n + j]) / (2 * h);
        expected_vv[(i * n + j) * n + k] = (fast[1][i * n + j] - slow[1][i * n + j]) / (2 * h);
        expected_qv[(i * n + j) * n + k] = (fast[0][i * n + j] - slow[0][i * n + j]) / (2 * h);
        expected_qtau[(i * n + k) * n + j] = (high[2][i * n + j] - low[2][i * n + j]) / (2 * h);
      }
  }
  check_equal(qq, expected_qq, 1e-6);
  check_equal(vv, expected_vv, 1e-6);
  check_equal(qv, expected_qv, 1e-6);
  check_equal(qtau, expected_qtau, 1e-6);
}

TEST_CASE("coupled: hybrid dynamics keep what is given, and solve the equations of motion") {
  state s(4);
  std::vector<int> links;
  std::vector<bool> is_given(s.nv);
  for (const ksl::joint_row &joint : s.m.joints())
    if (joint.v_index >= 0 && links.size() < 3 && joint.link % 2 == 0) {
      links.push_back(joint.link);
      for (std::size_t i = 0; i < static_cast<std::size_t>(ksl::row_of(joint.kind).nv); ++i)
        is_given[static_cast<std::size_t>(joint.v_index) + i] = true;
    }
  REQUIRE(links.size() == 3);
  for (std::size_t count : {std::size_t(0), std::size_t(1), links.size()}) {
    numbers a(s.nv), tau(s.nv);
    ksl::hybrid_dynamics(s.m, s.d, s.q.data(), s.v.data(), s.a.data(), s.tau.data(), static_cast<int>(count),
                         links.data(), a.data(), tau.data(), s.external);
    check_equal(tau, s.efforts(s.v, a, s.external), 1e-10);
    std::size_t kept_a = 0, kept_tau = 0;
    for (std::size_t i = 0; i < s.nv; ++i)
      kept_a += a[i] == s.a[i], kept_tau += tau[i] == s.tau[i];
    CHECK(kept_a + kept_tau == s.nv); // of each coordinate one is given, and the other one found
    if (count == links.size())
      for (std::size_t i = 0; i < s.nv; ++i)
        CHECK((is_given[i] ? a[i] == s.a[i] : tau[i] == s.tau[i]));
    if (count == 0)
      check_equal(a, s.accelerations(s.q, s.v), 1e-10);
  }
}

TEST_CASE("coupled: impulses change the momentum of each coordinate by what wrenches take from its effort") {
  state s(5);
  numbers jump(s.nv);
  ksl::velocity_jump(s.m, s.d, s.q.data(), jump.data(), s.external);
  const numbers zero(s.nv), with = s.efforts(zero, zero, s.external), without = s.efforts(zero, zero, {});
  numbers impulse(s.nv);
  for (std::size_t i = 0; i < s.nv; ++i)
    impulse[i] = without[i] - with[i];
  check_equal(product(s.mass_matrix(), jump, s.nv), impulse, 1e-11);
}

TEST_CASE("coupled: operational space is what its definitions say") {
  state s(6);
  const std::vector<int> one = {9}, three = {3, 9, 12};
  for (const std::vector<int> &links : {one, three}) {
    const std::size_t rows = 6 * links.size();
    const int n = static_cast<int>(links.size());
    const numbers J = s.jacobians(links), solved = product(s.derivatives(s.q, s.v)[2], transposed(J, rows), s.nv);
    numbers inverse(rows * rows), inertia(rows * rows), again(rows * rows), bias(rows), pseudo_inverse(s.nv * rows);
    double rank = 0, rank_again = 0;
    ksl::operational_space_inertia_inverse(s.m, s.d, s.q.data(), n, links.data(), {}, inverse.data());
    check_equal(inverse, product(J, solved, s.nv), 1e-10);
    ksl::operational_space_inertia(s.m, s.d, s.q.data(), n, links.data(), {}, inertia.data(), &rank);
    check_equal(product(product(inverse, inertia, rows), inverse, rows), inverse, 1e-8); // also where it is singular
    if (rank == static_cast<double>(rows))
      check_equal(product(inertia, inverse, rows), identity(rows), 1e-8);
    ksl::operational_space(s.m, s.d, s.q.data(), s.v.data(), n, links.data(), {}, again.data(), bias.data(),
                           pseudo_inverse.data(), &rank_again, s.external);
    CHECK(rank_again == rank);
    CHECK(rank >= 6);
    check_equal(again, inertia, 1e-12);
    check_equal(pseudo_inverse, product(solved, inertia, rows), 1e-8);

    numbers back(s.nq), forth(s.nq), less(s.nv), more(s.nv); // the rate of J, by which v is multiplied
    for (std::size_t i = 0; i < s.nv; ++i)
      less[i] = -h * s.v[i], more[i] = h * s.v[i];
    ksl::integrate(s.m, s.d, s.q.data(), less.data(), back.data());
    ksl::integrate(s.m, s.d, s.q.data(), more.data(), forth.data());
    const numbers q = s.q;
    const auto twists = [&](const numbers &at) {
      s.q = at;
      return product(s.jacobians(links), s.v, s.nv);
    };
    const numbers rate = difference(twists, back, forth);
    s.q = q;
    numbers missing = product(transposed(solved, s.nv), s.efforts(s.v, numbers(s.nv), s.external), s.nv);
    for (std::size_t i = 0; i < rows; ++i)
      missing[i] -= rate[i];
    check_equal(bias, product(inertia, missing, rows), 1e-6);
  }
}
