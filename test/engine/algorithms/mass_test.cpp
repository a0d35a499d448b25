// The mass matrix in its forms, its factors and inverse, the Coriolis matrix, and what is computed with them: identities between
// independent algorithms, and dual numbers through the same templates, on random trees with every kind of joint.
#include "matrices.hpp"
#include "robots.hpp"

#include "ksl/dual.hpp"
#include "ksl/engine/algorithms/derivatives/forward_dynamics_derivatives.hpp"
#include "ksl/engine/algorithms/forward/forward_dynamics_by_mass_matrix.hpp"
#include "ksl/engine/algorithms/forward/hybrid_dynamics.hpp"
#include "ksl/engine/algorithms/mass/coriolis_matrix.hpp"
#include "ksl/engine/algorithms/mass/solve_mass_matrix.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

namespace {

using dual = ksl::dual<1>;
template <class N> using numbers = std::vector<N>;
using matrices::identity, matrices::product;

numbers<double> random_numbers(int n, std::mt19937 &random) {
  std::normal_distribution<double> normal;
  numbers<double> x(static_cast<std::size_t>(n));
  for (double &y : x)
    y = normal(random);
  return x;
}

/// Damping, friction, rotor and spring, each where the kind of joint can have it.
void add_physics(ksl::joint_description &joint) {
  const ksl::joint_kind_row row = ksl::row_of(joint.kind);
  if (row.nv > 0)
    joint.damping = 0.3, joint.friction = 0.7, joint.friction_width = 0.5;
  if (row.nv > 0 && !row.is_free)
    joint.armature = 0.2;
  if (row.nv == 1)
    joint.spring_stiffness = 2, joint.spring_rest = 0.1;
}

/// Every link has mass, so that every effort accelerates something.
ksl::model heavy_tree(int bodies, std::mt19937 &random, bool physics) {
  const auto below = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  const auto vector = [&] {
    const numbers<double> x = random_numbers(3, random);
    return ksl::vec3<double>{x[0], x[1], x[2]};
  };
  ksl::robot_description r;
  r.name = "random tree";
  r.links = {robots::link("link0", robots::solid(1, vector(), 1, 1.2, 0.9))};
  for (int i = 1; i < bodies; ++i) {
    const std::string number = std::to_string(i);
    r.links.push_back(robots::link(("link" + number).c_str(), robots::solid(1, vector(), 1, 1.2, 0.9)));
    ksl::vec3<double> axis = vector();
    ksl::algebra<double>::vec3_normalize(&axis);
    r.joints.push_back(robots::joint(("joint" + number).c_str(),
                                     ksl::joint_kinds[below(static_cast<int>(std::size(ksl::joint_kinds)))],
                                     below(3) ? i - 1 : below(i), i, vector(), axis));
    r.joints.back().pitch = 0.3;
    r.joints.back().axis2 = vector();
    ksl::algebra<double>::vec3_normalize(&r.joints.back().axis2);
    if (physics)
      add_physics(r.joints.back());
  }
  ksl::model_options options;
  if (physics)
    options.physics = ksl::physics_options{.damping = true, .friction = true, .armature = true, .spring = true};
  options.floating_base = below(2) == 0;
  return ksl::model(r, options);
}

/// A model and one of its states, for calls with any scalar.
struct mechanism {
  ksl::model m;
  numbers<double> q, v, a, tau, push;
  numbers<int> pushed;
  std::size_t n;

  mechanism(int bodies, std::mt19937 &random, bool physics)
      : m(heavy_tree(bodies, random, physics)), q(random_numbers(m.nq(), random)), v(random_numbers(m.nv(), random)),
        a(random_numbers(m.nv(), random)), tau(random_numbers(m.nv(), random)), push(random_numbers(12, random)),
        pushed{m.view().links - 1, m.view().links / 2}, n(static_cast<std::size_t>(m.nv())) {
    robots::normalize_quaternions(m, q.data());
  }

  /// call(model, workspace, results…) with `results` arrays of `size` numbers each.
  template <template <class> class Workspace, class T, class Call> numbers<T> run(std::size_t size, Call call) const {
    numbers<T> out(size, T(NAN));
    call(m.view(), *ksl::owned_workspace<Workspace<T>>(m.view()), out.data());
    return out;
  }
  /// In the axes of the links, or in those of the world.
  template <class T> ksl::external_wrenches<T> external(const numbers<T> &f) const {
    return {2, pushed.data(), f.data(), static_cast<ksl::expressed_in>(n % 2)};
  }

  template <class T> numbers<T> M(const numbers<T> &at) const {
    return run<ksl::mass_matrix_workspace, T>(
        n * n, [&](auto model, auto &w, T *out) { ksl::mass_matrix<T>(model, w, at.data(), out); });
  }
  /// Efforts; any argument but q may be null for zeros.
  numbers<double> efforts(const numbers<double> *rates, const numbers<double> *accelerations,
                          const numbers<double> *pushes) const {
    const numbers<double> zero(n, 0.0);
    return run<ksl::inverse_dynamics_workspace, double>(n, [&](auto model, auto &w, double *out) {
      ksl::inverse_dynamics<double>(model, w, q.data(), (rates ? *rates : zero).data(),
                                    (accelerations ? *accelerations : zero).data(),
                                    pushes ? external(*pushes) : ksl::external_wrenches<double>{}, out);
    });
  }
};

double largest(const numbers<double> &x) {
  double out = 1;
  for (double y : x)
    out = std::fmax(out, std::fabs(y));
  return out;
}

void check_close(const numbers<double> &found, const numbers<double> &expected, double tolerance) {
  REQUIRE(found.size() == expected.size());
  double error = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    error = std::isnan(found[i]) ? HUGE_VAL : std::fmax(error, std::fabs(found[i] - expected[i]));
  CHECK(error <= tolerance * largest(expected));
}

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

/// All calls with one scalar, one after the other.
template <class T> numbers<T> everything(const mechanism &s, const numbers<T> &q, const numbers<T> &v,
                                         const numbers<T> &a, const numbers<T> &tau, const numbers<T> &push) {
  const std::size_t n = s.n, tree = static_cast<std::size_t>(s.m.tree_elements());
  const ksl::external_wrenches<T> external = s.external(push);
  numbers<T> all;
  const auto add = [&](const numbers<T> &x) { all.insert(all.end(), x.begin(), x.end()); };
  add(s.run<ksl::mass_matrix_workspace, T>(
      tree, [&](auto m, auto &w, T *out) { ksl::mass_matrix_tree<T>(m, w, q.data(), out); }));
  add(s.run<ksl::mass_matrix_factor_workspace, T>(
      tree, [&](auto m, auto &w, T *out) { ksl::mass_matrix_factor<T>(m, w, q.data(), out); }));
  add(s.run<ksl::mass_matrix_inverse_workspace, T>(
      n * n, [&](auto m, auto &w, T *out) { ksl::mass_matrix_inverse<T>(m, w, q.data(), out); }));
  add(s.run<ksl::solve_mass_matrix_workspace, T>(
      n, [&](auto m, auto &w, T *out) { ksl::solve_mass_matrix<T>(m, w, q.data(), tau.data(), out); }));
  add(s.run<ksl::coriolis_matrix_workspace, T>(
      n * n, [&](auto m, auto &w, T *out) { ksl::coriolis_matrix<T>(m, w, q.data(), v.data(), out); }));
  add(s.run<ksl::forward_dynamics_by_mass_matrix_workspace, T>(n, [&](auto m, auto &w, T *out) {
    ksl::forward_dynamics_by_mass_matrix<T>(m, w, q.data(), v.data(), tau.data(), external, out);
  }));
  add(s.run<ksl::hybrid_dynamics_workspace, T>(2 * n, [&](auto m, auto &w, T *out) {
    ksl::hybrid_dynamics<T>(m, w, q.data(), v.data(), a.data(), tau.data(), 2, s.pushed.data(), external, out, out + n);
  }));
  add(s.run<ksl::velocity_jump_workspace, T>(
      n, [&](auto m, auto &w, T *out) { ksl::velocity_jump<T>(m, w, q.data(), external, out); }));
  add(s.run<ksl::forward_dynamics_derivatives_workspace, T>(3 * n * n, [&](auto m, auto &w, T *out) {
    ksl::forward_dynamics_derivatives<T>(m, w, q.data(), v.data(), tau.data(), external, out, out + n * n,
                                         out + 2 * n * n);
  }));
  numbers<T> upper(n * n, T(0));
  ksl::mass_matrix_upper<T>(s.m.view(), *ksl::owned_workspace<ksl::mass_matrix_workspace<T>>(s.m.view()), q.data(),
                            upper.data());
  add(upper);
  return all;
}

/// q moved by the joint velocities `rate` for the time ε: dual positions.
numbers<dual> moving(const ksl::model &m, const numbers<double> &q, const numbers<double> &rate) {
  numbers<dual> from(q.begin(), q.end()), step(rate.size()), out(from);
  for (std::size_t i = 0; i < rate.size(); ++i)
    step[i] = 0.0, step[i].derivative[0] = rate[i];
  for (int i = 1; i < m.view().bodies; ++i) {
    const ksl::body<double> &b = m.view().body[i];
    ksl::with_joint(b.kind, [&]<class J>(J) {
      J::integrate(&from[static_cast<std::size_t>(b.q_index)], &step[static_cast<std::size_t>(b.v_index)],
                   &out[static_cast<std::size_t>(b.q_index)]);
    });
  }
  return out;
}

numbers<double> derivatives(const numbers<dual> &x) {
  numbers<double> out;
  for (const dual &y : x)
    out.push_back(y.derivative[0]);
  return out;
}

enum class joints_are { plain, physical_in_turn };

/// A step for each of some random trees; every other one has the physics of joints if asked for.
template <class Step> void for_trees(unsigned seed, int trees, Step step, joints_are joints = joints_are::plain) {
  std::mt19937 random(seed);
  for (int turn = 0; turn < trees; ++turn) {
    const mechanism s(2 + turn % 16, random, joints == joints_are::physical_in_turn && turn % 2 == 1);
    if (s.n > 0)
      step(s);
  }
}

} // namespace

TEST_CASE("mass matrix: its forms agree, and M = Lᵀ D L") {
  for_trees(1, 60, [](const mechanism &s) {
    const std::size_t n = s.n, tree = static_cast<std::size_t>(s.m.tree_elements());
    const numbers<double> M = s.M(s.q);
    const auto elements = s.run<ksl::mass_matrix_workspace, double>(
        tree, [&](auto m, auto &w, double *out) { ksl::mass_matrix_tree(m, w, s.q.data(), out); });
    const auto LD = s.run<ksl::mass_matrix_factor_workspace, double>(
        tree, [&](auto m, auto &w, double *out) { ksl::mass_matrix_factor(m, w, s.q.data(), out); });
    numbers<double> upper(n * n, -7.0), expected(upper), from_tree(n * n, 0.0), L = identity(n), Lt = L, D(n * n, 0.0);
    ksl::mass_matrix_upper(s.m.view(), *ksl::owned_workspace<ksl::mass_matrix_workspace<double>>(s.m.view()),
                           s.q.data(), upper.data());
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = i; k < n; ++k)
        expected[i * n + k] = M[i * n + k];
    CHECK(upper == expected); // to the bit, and the rest is left as it is
    const std::vector<int> columns = s.m.tree_columns(), &rows = s.m.tree_rows();
    for (std::size_t i = 0; i < n; ++i)
      for (int e = rows[i]; e < rows[i + 1]; ++e) {
        const std::size_t at = static_cast<std::size_t>(e), k = static_cast<std::size_t>(columns[at]);
        from_tree[i * n + k] = from_tree[k * n + i] = elements[at];
        (k == i ? D[i * n + i] : L[i * n + k]) = LD[at];
        if (k != i)
          Lt[k * n + i] = LD[at];
      }
    CHECK(from_tree == M);
    check_close(product(Lt, product(D, L, n), n), M, 1e-13);
  });
}

TEST_CASE("inverse of the mass matrix, and solutions by the articulated-body algorithm") {
  for_trees(2, 60, [](const mechanism &s) {
    const std::size_t n = s.n;
    const numbers<double> M = s.M(s.q);
    const auto W = s.run<ksl::mass_matrix_inverse_workspace, double>(
        n * n, [&](auto m, auto &w, double *out) { ksl::mass_matrix_inverse(m, w, s.q.data(), out); });
    const auto a = s.run<ksl::solve_mass_matrix_workspace, double>(
        n, [&](auto m, auto &w, double *out) { ksl::solve_mass_matrix(m, w, s.q.data(), s.tau.data(), out); });
    const auto jump = s.run<ksl::velocity_jump_workspace, double>(
        n, [&](auto m, auto &w, double *out) { ksl::velocity_jump(m, w, s.q.data(), s.external(s.push), out); });
    const double small = 1e-15 * condition(M, W, n);
    check_close(product(M, W, n), identity(n), small);
    check_close(a, product(W, s.tau, n), small);
    numbers<double> impulse =
        s.efforts(nullptr, nullptr, nullptr); // Jᵀ f: what external wrenches take from the efforts
    const numbers<double> rest = s.efforts(nullptr, nullptr, &s.push);
    for (std::size_t i = 0; i < n; ++i)
      impulse[i] -= rest[i];
    check_close(jump, product(W, impulse, n), 10 * small);
  });
}

TEST_CASE("Coriolis matrix: C v is the bias without gravity, dM/dt − 2 C is skew-symmetric") {
  for_trees(3, 60, [](const mechanism &s) {
    const std::size_t n = s.n;
    const auto C = s.run<ksl::coriolis_matrix_workspace, double>(
        n * n, [&](auto m, auto &w, double *out) { ksl::coriolis_matrix(m, w, s.q.data(), s.v.data(), out); });
    numbers<double> bias = s.efforts(&s.v, nullptr, nullptr), sum(n * n);
    const numbers<double> gravity = s.efforts(nullptr, nullptr, nullptr);
    for (std::size_t i = 0; i < n; ++i)
      bias[i] -= gravity[i];
    check_close(product(C, s.v, n), bias, 1e-12);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < n; ++k)
        sum[i * n + k] = C[i * n + k] + C[k * n + i];
    check_close(sum, derivatives(s.M(moving(s.m, s.q, s.v))), 1e-12);
  });
}

TEST_CASE("forward and hybrid dynamics are the inverse of inverse dynamics") {
  for_trees(
      4, 60,
      [](const mechanism &s) {
        const std::size_t n = s.n;
        const ksl::external_wrenches<double> external = s.external(s.push);
        const auto W = s.run<ksl::mass_matrix_inverse_workspace, double>(
            n * n, [&](auto m, auto &w, double *out) { ksl::mass_matrix_inverse(m, w, s.q.data(), out); });
        const double small = 1e-14 * condition(s.M(s.q), W, n);
        const auto a =
            s.run<ksl::forward_dynamics_by_mass_matrix_workspace, double>(n, [&](auto m, auto &w, double *out) {
              ksl::forward_dynamics_by_mass_matrix(m, w, s.q.data(), s.v.data(), s.tau.data(), external, out);
            });
        check_close(s.efforts(&s.v, &a, &s.push), s.tau, small);
        const auto by_bodies = s.run<ksl::forward_dynamics_workspace, double>(n, [&](auto m, auto &w, double *out) {
          ksl::forward_dynamics(m, w, s.q.data(), s.v.data(), s.tau.data(), external, out);
        });
        check_close(a, by_bodies, small);
        for (int given = 0; given <= s.m.view().links; given += s.m.view().links / 2) { // none, every other one, all
          numbers<int> links;
          numbers<bool> known(n, false);
          for (int l = s.m.view().links - 1; l >= 0 && given > 0; l -= given < s.m.view().links ? 2 : 1) {
            links.push_back(l);
            const ksl::body<double> &b = s.m.view().body[s.m.view().link[l].body];
            for (int c = 0; c < b.nv; ++c)
              known[static_cast<std::size_t>(b.v_index + c)] = true;
            if (b.ends_universal) // both axes belong to the joint
              known[static_cast<std::size_t>(b.v_index - 1)] = true;
          }
          const auto both = s.run<ksl::hybrid_dynamics_workspace, double>(2 * n, [&](auto m, auto &w, double *out) {
            ksl::hybrid_dynamics(m, w, s.q.data(), s.v.data(), s.a.data(), s.tau.data(), static_cast<int>(links.size()),
                                 links.data(), external, out, out + n);
          });
          const numbers<double> all_a(both.begin(), both.begin() + static_cast<std::ptrdiff_t>(n)),
              all_tau(both.begin() + static_cast<std::ptrdiff_t>(n), both.end());
          for (std::size_t i = 0; i < n; ++i)
            CHECK((known[i] ? all_a[i] == s.a[i] : all_tau[i] == s.tau[i]));
          check_close(s.efforts(&s.v, &all_a, &s.push), all_tau, small);
        }
      },
      joints_are::physical_in_turn);
}

TEST_CASE("derivatives of forward dynamics are those of dual numbers") {
  for_trees(
      5, 30,
      [](const mechanism &s) {
        const std::size_t n = s.n;
        const auto D =
            s.run<ksl::forward_dynamics_derivatives_workspace, double>(3 * n * n, [&](auto m, auto &w, double *out) {
              ksl::forward_dynamics_derivatives(m, w, s.q.data(), s.v.data(), s.tau.data(), s.external(s.push), out,
                                                out + n * n, out + 2 * n * n);
            });
        numbers<double> expected(3 * n * n);
        for (std::size_t which = 0; which < 3; ++which)
          for (std::size_t k = 0; k < n; ++k) {
            numbers<double> unit(n, 0.0);
            unit[k] = 1;
            numbers<dual> q(s.q.begin(), s.q.end()), v(s.v.begin(), s.v.end()), tau(s.tau.begin(), s.tau.end()),
                push(s.push.begin(), s.push.end());
            if (which == 0)
              q = moving(s.m, s.q, unit);
            else
              (which == 1 ? v : tau)[k].derivative[0] = 1;
            const numbers<double> column =
                derivatives(s.run<ksl::forward_dynamics_workspace, dual>(n, [&](auto m, auto &w, dual *out) {
                  ksl::forward_dynamics<dual>(m, w, q.data(), v.data(), tau.data(), s.external(push), out);
                }));
            for (std::size_t i = 0; i < n; ++i)
              expected[(which * n + i) * n + k] = column[i];
          }
        const numbers<double> W(D.begin() + static_cast<std::ptrdiff_t>(2 * n * n), D.end());
        check_close(D, expected, 1e-14 * condition(s.M(s.q), W, n));
      },
      joints_are::physical_in_turn);
}

TEST_CASE("mass and forward groups: dual numbers have the values of plain ones") {
  for_trees(
      6, 20,
      [](const mechanism &s) {
        const numbers<double> plain = everything<double>(s, s.q, s.v, s.a, s.tau, s.push);
        const auto in = [](const numbers<double> &x) { return numbers<dual>(x.begin(), x.end()); };
        const numbers<dual> duals = everything<dual>(s, in(s.q), in(s.v), in(s.a), in(s.tau), in(s.push));
        REQUIRE(plain.size() == duals.size());
        for (std::size_t i = 0; i < plain.size(); ++i) {
          CAPTURE(i);
          CHECK(duals[i].value == plain[i]);
        }
      },
      joints_are::physical_in_turn);
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
