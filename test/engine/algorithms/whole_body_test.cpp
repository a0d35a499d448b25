// Centre of mass, centroidal momentum and regressors on dual numbers, for every kind of joint: what is said to be a rate is the
// derivative by time along a motion.
#include "robots.hpp"

#include "ksl/dual.hpp"
#include "ksl/engine/algorithms/parameters/energy_regressor.hpp"
#include "ksl/engine/algorithms/parameters/inverse_dynamics_regressor.hpp"
#include "ksl/engine/algorithms/parameters/reactions_regressor.hpp"
#include "ksl/engine/algorithms/whole_body/center_of_mass.hpp"
#include "ksl/engine/algorithms/whole_body/center_of_mass_motion.hpp"
#include "ksl/engine/algorithms/whole_body/centroidal_momentum.hpp"
#include "ksl/engine/algorithms/whole_body/centroidal_momentum_matrix.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

namespace {

using rate = ksl::dual<1>;
template <class T> using numbers = std::vector<T>;
constexpr ksl::component_order order = ksl::component_order::linear_first;

ksl::model robot(bool with_gravity = true) {
  ksl::model_options options;
  if (!with_gravity)
    options.gravity = {0, 0, 0};
  return ksl::load(KSL_EVERY_KIND, options);
}

/// A motion at one time: positions, velocities and accelerations, each with its derivative by time.
template <class T> struct motion { numbers<T> q, v, a; };

numbers<double> random_numbers(int n, std::mt19937 &random) {
  std::normal_distribution<double> normal;
  numbers<double> x(static_cast<std::size_t>(n));
  for (double &y : x)
    y = normal(random);
  return x;
}

motion<double> random_motion(const ksl::model &m, std::mt19937 &random) {
  motion<double> s = {random_numbers(m.nq(), random), random_numbers(m.nv(), random), random_numbers(m.nv(), random)};
  robots::normalize_quaternions(m, s.q.data());
  return s;
}

/// The same with time as the variable: q moves along v, v along a; the accelerations are taken as constant.
motion<rate> in_time(const ksl::model &m, const motion<double> &s) {
  motion<rate> out = {{s.q.begin(), s.q.end()}, {s.v.begin(), s.v.end()}, {s.a.begin(), s.a.end()}};
  numbers<rate> step(s.v.size(), rate(0));
  for (std::size_t k = 0; k < s.v.size(); ++k)
    step[k].derivative[0] = s.v[k], out.v[k].derivative[0] = s.a[k];
  const numbers<rate> q = out.q;
  for (int i = 1; i < m.view().bodies; ++i) {
    const ksl::body<double> &b = m.view().body[i];
    const auto q_index = static_cast<std::size_t>(b.q_index), v_index = static_cast<std::size_t>(b.v_index);
    ksl::with_joint(b.kind, [&]<class J>(J) { J::integrate(&q[q_index], &step[v_index], &out.q[q_index]); });
  }
  return out;
}

numbers<int> all_links(const ksl::model &m) {
  numbers<int> links;
  for (int l = 0; l < m.view().links; ++l)
    links.push_back(l);
  return links;
}

/// Results of an algorithm: call(workspace, results).
template <class Workspace, class T, class Call> numbers<T> results(const ksl::model &m, std::size_t n, Call call) {
  const ksl::owned_workspace<Workspace> w(m.view());
  numbers<T> out(n, T(NAN));
  call(*w, out.data());
  return out;
}

template <class T> numbers<T> center(const ksl::model &m, const motion<T> &s) {
  return results<ksl::center_of_mass_workspace<T>, T>(
      m, 3, [&](const auto &w, T *out) { ksl::center_of_mass<T>(m.view(), w, s.q.data(), out); });
}
template <class T> numbers<T> jacobian(const ksl::model &m, const motion<T> &s) {
  return results<ksl::center_of_mass_jacobian_workspace<T>, T>(
      m, 3 * s.v.size(), [&](const auto &w, T *out) { ksl::center_of_mass_jacobian<T>(m.view(), w, s.q.data(), out); });
}
template <class T> numbers<T> velocity(const ksl::model &m, const motion<T> &s) {
  return results<ksl::center_of_mass_velocity_workspace<T>, T>(
      m, 3, [&](const auto &w, T *out) { ksl::center_of_mass_velocity<T>(m.view(), w, s.q.data(), s.v.data(), out); });
}
template <class T> numbers<T> acceleration(const ksl::model &m, const motion<T> &s) {
  return results<ksl::center_of_mass_acceleration_workspace<T>, T>(m, 3, [&](const auto &w, T *out) {
    ksl::center_of_mass_acceleration<T>(m.view(), w, s.q.data(), s.v.data(), s.a.data(), out);
  });
}
template <class T> numbers<T> momentum(const ksl::model &m, const motion<T> &s) {
  return results<ksl::centroidal_momentum_workspace<T>, T>(m, 6, [&](const auto &w, T *out) {
    ksl::centroidal_momentum<T>(m.view(), w, s.q.data(), s.v.data(), order, out);
  });
}
template <class T> numbers<T> momentum_matrix(const ksl::model &m, const motion<T> &s) {
  return results<ksl::centroidal_momentum_matrix_workspace<T>, T>(m, 6 * s.v.size(), [&](const auto &w, T *out) {
    ksl::centroidal_momentum_matrix<T>(m.view(), w, s.q.data(), order, out);
  });
}
template <class T> numbers<T> momentum_rate(const ksl::model &m, const motion<T> &s) {
  return results<ksl::centroidal_momentum_rate_workspace<T>, T>(m, 6, [&](const auto &w, T *out) {
    ksl::centroidal_momentum_rate<T>(m.view(), w, s.q.data(), s.v.data(), s.a.data(), order, out);
  });
}

/// Regressors of all links; of energies the sum of both.
template <class T> numbers<T> effort_regressor(const ksl::model &m, const motion<T> &s) {
  const numbers<int> links = all_links(m);
  const int n = static_cast<int>(links.size());
  return results<ksl::inverse_dynamics_regressor_workspace<T>, T>(
      m, 10 * links.size() * s.v.size(), [&](const auto &w, T *out) {
        ksl::inverse_dynamics_regressor<T>(m.view(), w, s.q.data(), s.v.data(), s.a.data(), n, links.data(), out);
      });
}
template <class T> numbers<T> energy_regressors(const ksl::model &m, const motion<T> &s) {
  const numbers<int> links = all_links(m);
  const std::size_t n = 10 * links.size();
  numbers<T> both = results<ksl::energy_regressor_workspace<T>, T>(m, 2 * n, [&](const auto &w, T *out) {
    ksl::energy_regressor<T>(m.view(), w, s.q.data(), s.v.data(), static_cast<int>(links.size()), links.data(), out,
                             out + n);
  });
  for (std::size_t k = 0; k < n; ++k)
    both[k] = both[k] + both[n + k];
  both.resize(n);
  return both;
}
template <class T> numbers<T> momenta(const ksl::model &m, const motion<T> &s) {
  const numbers<int> links = all_links(m);
  return results<ksl::momentum_regressor_workspace<T>, T>(m, 60 * links.size(), [&](const auto &w, T *out) {
    ksl::momentum_regressor<T>(m.view(), w, s.q.data(), s.v.data(), static_cast<int>(links.size()), links.data(), order,
                               out);
  });
}
/// The wrench through the joint that carries the root, and with it all links; about the world's origin, in its axes.
template <class T> numbers<T> reaction_regressor(const ksl::model &m, const motion<T> &s) {
  const int root = 0;
  ksl::reaction_request request;
  request.n = 1, request.link = &root;
  request.at = request.axes = ksl::wrench_frame::world;
  return results<ksl::reactions_regressor_workspace<T>, T>(m, 60 * all_links(m).size(), [&](const auto &w, T *out) {
    ksl::reactions_regressor<T>(m.view(), w, s.q.data(), s.v.data(), s.a.data(), request, out);
  });
}

/// matrix (rows, v.size()) times v
numbers<double> product(const numbers<double> &matrix, const numbers<double> &v) {
  numbers<double> out(matrix.size() / v.size(), 0.0);
  for (std::size_t k = 0; k < matrix.size(); ++k)
    out[k / v.size()] += matrix[k] * v[k % v.size()];
  return out;
}

void check_near(double found, double expected, double scale) { CHECK(std::fabs(found - expected) <= 1e-12 * scale); }

double largest(const numbers<double> &x) {
  double most = 1;
  for (double y : x)
    most = std::fmax(most, std::fabs(y));
  return most;
}

void check_rates(const numbers<rate> &x, const numbers<double> &expected) {
  REQUIRE(x.size() == expected.size());
  const double scale = largest(expected);
  for (std::size_t k = 0; k < x.size(); ++k)
    check_near(x[k].derivative[0], expected[k], scale);
}
void check_values(const numbers<double> &x, const numbers<double> &expected) {
  REQUIRE(x.size() == expected.size());
  const double scale = largest(expected);
  for (std::size_t k = 0; k < x.size(); ++k)
    check_near(x[k], expected[k], scale);
}

} // namespace

TEST_CASE("the centre of mass moves with its velocity and acceleration") {
  std::mt19937 random(1);
  const ksl::model m = robot();
  for (int k = 0; k < 5; ++k) {
    const motion<double> s = random_motion(m, random);
    const motion<rate> moving = in_time(m, s);
    check_rates(center(m, moving), velocity(m, s));
    check_rates(velocity(m, moving), acceleration(m, s));
    check_values(product(jacobian(m, s), s.v), velocity(m, s));
    check_values(center(m, s), [&] {
      numbers<double> values;
      for (const rate &x : center(m, moving))
        values.push_back(x.value);
      return values;
    }());
  }
}

TEST_CASE("the centroidal momentum changes at its rate") {
  std::mt19937 random(2);
  const ksl::model m = robot();
  for (int k = 0; k < 5; ++k) {
    const motion<double> s = random_motion(m, random);
    const motion<rate> moving = in_time(m, s);
    check_rates(momentum(m, moving), momentum_rate(m, s));
    check_values(product(momentum_matrix(m, s), s.v), momentum(m, s));
  }
}

TEST_CASE("the Jacobian and the momentum matrix have the derivatives of what they give") {
  std::mt19937 random(3);
  const ksl::model m = robot();
  const motion<double> s = random_motion(m, random);
  const motion<rate> moving = in_time(m, s);
  const auto times_velocity = [&](const numbers<rate> &matrix) {
    numbers<rate> out(matrix.size() / s.v.size(), rate(0));
    for (std::size_t k = 0; k < matrix.size(); ++k)
      out[k / s.v.size()] = out[k / s.v.size()] + matrix[k] * moving.v[k % s.v.size()];
    return out;
  };
  check_rates(times_velocity(jacobian(m, moving)), acceleration(m, s));
  check_rates(times_velocity(momentum_matrix(m, moving)), momentum_rate(m, s));
}

TEST_CASE("for each parameter, the rate of the energies is the power of the efforts") {
  std::mt19937 random(4);
  const ksl::model m = robot();
  for (int k = 0; k < 3; ++k) {
    const motion<double> s = random_motion(m, random);
    const numbers<double> Y = effort_regressor(m, s);
    const std::size_t columns = 10 * all_links(m).size();
    numbers<double> power(columns, 0.0);
    for (std::size_t i = 0; i < Y.size(); ++i)
      power[i % columns] += Y[i] * s.v[i / columns];
    check_rates(energy_regressors(m, in_time(m, s)), power);
  }
}

TEST_CASE("for each parameter, the rate of the momentum is what the ground exerts without gravity") {
  std::mt19937 random(5);
  const ksl::model m = robot(false);
  for (int k = 0; k < 3; ++k) {
    const motion<double> s = random_motion(m, random);
    check_rates(momenta(m, in_time(m, s)), reaction_regressor(m, s));
  }
}

TEST_CASE("regressors of dual numbers have the values of plain ones") {
  std::mt19937 random(6);
  const ksl::model m = robot();
  motion<double> s = random_motion(m, random);
  const motion<rate> moving = in_time(m, s);
  for (std::size_t k = 0; k < s.q.size(); ++k)
    s.q[k] = moving.q[k].value; // quaternions have been normalised once more
  const auto same = [](const numbers<rate> &x, const numbers<double> &y) {
    bool all = x.size() == y.size();
    for (std::size_t k = 0; k < x.size(); ++k)
      all &= x[k].value == y[k];
    return all;
  };
  CHECK(same(effort_regressor(m, moving), effort_regressor(m, s)));
  CHECK(same(reaction_regressor(m, moving), reaction_regressor(m, s)));
  CHECK(same(momenta(m, moving), momenta(m, s)));
  CHECK(same(momentum_matrix(m, moving), momentum_matrix(m, s)));
}
