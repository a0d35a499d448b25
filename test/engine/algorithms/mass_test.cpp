// The mass matrix in its forms, its factors and inverse, the Coriolis matrix, and what is computed with them: identities between
// independent algorithms, and dual numbers through the same templates, on random trees with every kind of joint.
#include "states.hpp"

#include "ksl/dynamics.hpp"

#include <cmath>
#include <random>

namespace {

using namespace robots;
using matrices::identity, matrices::product;

/// The largest sum of magnitudes in a row of M times that of its inverse.
double condition(const numbers<double> &M, const numbers<double> &W, std::size_t n) {
  const auto norm = [n](const numbers<double> &A) {
    double most = 0;
    for (std::size_t i = 0; i < n; ++i) {
      double sum = 0;
      for (std::size_t k = 0; k < n; ++k)
        sum += std::fabs(A[i * n + k]);
      most = std::fmax(most, sum);
    }
    return most;
  };
  return norm(M) * norm(W);
}

/// A model and one of its states.
struct mechanism {
  ksl::model m;
  state s;
  std::size_t n = static_cast<std::size_t>(m.nv());

  mechanism(const ksl::model &tree, std::mt19937 &random) : m(tree), s(random_state(m, random)) {}

  template <class Algorithm> numbers<double> results(const request &asked = {}) const {
    return robots::results<Algorithm>(m, s, asked);
  }
  numbers<double> M() const { return results<algorithms::mass_matrix>(); }
  double condition() const { return ::condition(M(), results<algorithms::mass_matrix_inverse>(), n); }
  /// Efforts at accelerations a.
  numbers<double> efforts(const numbers<double> &a) const {
    state at = s;
    at.a = a;
    return robots::results<algorithms::inverse_dynamics>(m, at);
  }
  /// The same without motion, without motion and wrenches, or without accelerations and wrenches.
  numbers<double> efforts_at_rest(bool pushed, bool moving = false) const {
    state at = s;
    at.a.assign(n, 0.0);
    if (!moving)
      at.v.assign(n, 0.0);
    if (!pushed)
      at.push.clear();
    return robots::results<algorithms::inverse_dynamics>(m, at);
  }
};

/// A step for each of some random trees; every other one has the physics of joints if asked for.
template <class Step> void for_trees(unsigned seed, int trees, Step step, joints_are joints = joints_are::plain) {
  std::mt19937 random(seed);
  for (int turn = 0; turn < trees; ++turn) {
    const mechanism x(random_tree(2 + turn % 16, random, turn % 2 ? joints : joints_are::plain), random);
    if (x.n > 0)
      step(x);
  }
}

numbers<double> minus(numbers<double> x, const numbers<double> &y) {
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] -= y[i];
  return x;
}

} // namespace

TEST_CASE("mass matrix: its forms agree, and M = Lᵀ D L") {
  for_trees(1, 60, [](const mechanism &x) {
    const std::size_t n = x.n;
    const numbers<double> M = x.M(), elements = x.results<algorithms::mass_matrix_tree>(),
                          LD = x.results<algorithms::mass_matrix_factor>();
    numbers<double> upper(n * n, -7.0), expected(upper), from_tree(n * n, 0.0), L = identity(n), Lt = L, D(n * n, 0.0);
    ksl::mass_matrix_upper(x.m.view(), *ksl::owned_workspace<ksl::mass_matrix_workspace<double>>(x.m.view()),
                           x.s.q.data(), upper.data());
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = i; k < n; ++k)
        expected[i * n + k] = M[i * n + k];
    CHECK(upper == expected); // to the bit, and the rest is left as it is
    const std::vector<int> columns = x.m.tree_columns(), &rows = x.m.tree_rows();
    for (std::size_t i = 0; i < n; ++i)
      for (int e = rows[i]; e < rows[i + 1]; ++e) {
        const std::size_t at = static_cast<std::size_t>(e), k = static_cast<std::size_t>(columns[at]);
        from_tree[i * n + k] = from_tree[k * n + i] = elements[at];
        (k == i ? D[i * n + i] : L[i * n + k]) = LD[at];
        if (k != i)
          Lt[k * n + i] = LD[at];
      }
    CHECK(from_tree == M);
    CHECK(difference(product(Lt, product(D, L, n), n), M) <= 1e-13);
  });
}

TEST_CASE("inverse of the mass matrix, and solutions by the articulated-body algorithm") {
  for_trees(2, 60, [](const mechanism &x) {
    const std::size_t n = x.n;
    const numbers<double> M = x.M(), W = x.results<algorithms::mass_matrix_inverse>();
    const double small = 1e-15 * condition(M, W, n);
    CHECK(difference(product(M, W, n), identity(n)) <= small);
    CHECK(difference(x.results<algorithms::solve_mass_matrix>(), product(W, x.s.tau, n)) <= small);
    // Jᵀ f: what external wrenches take from the efforts
    const numbers<double> impulse = minus(x.efforts_at_rest(false), x.efforts_at_rest(true));
    CHECK(difference(x.results<algorithms::velocity_jump>(), product(W, impulse, n)) <= 10 * small);
  });
}

TEST_CASE("Coriolis matrix: C v is the bias without gravity, dM/dt − 2 C is skew-symmetric") {
  for_trees(3, 60, [](const mechanism &x) {
    const std::size_t n = x.n;
    const numbers<double> C = x.results<algorithms::coriolis_matrix>();
    const numbers<double> bias = minus(x.efforts_at_rest(false, true), x.efforts_at_rest(false));
    CHECK(difference(product(C, x.s.v, n), bias) <= 1e-12);
    const numbers<double> rate = derivatives(results<algorithms::mass_matrix>(x.m, in_time(x.m, x.s)));
    CHECK(difference(minus(rate, C), matrices::transposed(C, n)) <= 1e-12);
  });
}

TEST_CASE("forward and hybrid dynamics are the inverse of inverse dynamics") {
  for_trees(
      4, 60,
      [](const mechanism &x) {
        const std::size_t n = x.n;
        const double small = 1e-14 * x.condition();
        const numbers<double> a = x.results<algorithms::forward_dynamics_by_mass_matrix>();
        CHECK(difference(x.efforts(a), x.s.tau) <= small);
        CHECK(difference(a, x.results<algorithms::forward_dynamics>()) <= small);
        for (const int step : {x.m.view().links + 1, 2, 1}) { // of no joint, of every other one, of all
          request given = of_links(x.m, step);
          if (step > 2)
            given.links.clear();
          numbers<bool> known(n, false);
          for (const int l : given.links) {
            const ksl::body<double> &b = x.m.view().body[x.m.view().link[l].body];
            for (int c = 0; c < b.nv; ++c)
              known[static_cast<std::size_t>(b.v_index + c)] = true;
            if (b.ends_universal) // both axes belong to the joint
              known[static_cast<std::size_t>(b.v_index - 1)] = true;
          }
          const numbers<double> both = x.results<algorithms::hybrid_dynamics>(given), all_a = part(both, 0, 2),
                                all_tau = part(both, 1, 2);
          for (std::size_t i = 0; i < n; ++i)
            CHECK((known[i] ? all_a[i] == x.s.a[i] : all_tau[i] == x.s.tau[i]));
          CHECK(difference(x.efforts(all_a), all_tau) <= small);
        }
      },
      joints_are::physical);
}

TEST_CASE("derivatives of forward dynamics are those of dual numbers") {
  for_trees(
      5, 30,
      [](const mechanism &x) {
        check_derivatives<algorithms::forward_dynamics, algorithms::forward_dynamics_derivatives>(
            x.m, x.s, {}, 1e-14 * x.condition());
      },
      joints_are::physical);
}

TEST_CASE("a joint that can move without moving any mass is found, and named") {
  ksl::robot_description r = robots::double_pendulum(1, 1, 1, 1);
  CHECK((ksl::model(r).massless_joint() == -1 && ksl::model(r).massless_joint_text().empty()));
  r.links.push_back(robots::link("tool"));
  r.joints.push_back(robots::joint("wrist", ksl::joint_kind::revolute, static_cast<int>(r.links.size()) - 2,
                                   static_cast<int>(r.links.size()) - 1, {0.1, 0, 0}, {1, 0, 0}));
  const ksl::model m(r);
  REQUIRE(m.massless_joint() >= 0);
  CHECK(m.joints()[static_cast<std::size_t>(m.massless_joint())].name == "wrist");
  CHECK(m.massless_joint_text().find("joint wrist can move without moving any mass") == 0);
  CHECK(m.massless_joint_text().find("tool") != std::string::npos);
  r.joints.back().name = "wr\x1b[2Jist"; // which would clear a terminal
  CHECK(ksl::model(r).massless_joint_text().find("joint wr\\x1b[2Jist can") == 0);
  r.joints.back().name = "wrist";
  r.joints.back().kind = ksl::joint_kind::universal; // two bodies, of which the first is no link's
  r.joints.back().axis2 = {0, 0, 1};
  const ksl::model two(r);
  REQUIRE(two.massless_joint() >= 0);
  CHECK(two.joints()[static_cast<std::size_t>(two.massless_joint())].name == "wrist");
}
