// Dual numbers through every algorithm and every kind of joint: against identities that need no difference quotient, and
// against central differences.
#include "states.hpp"

#include "ksl/dynamics.hpp"
#include "robot_files.hpp"

#include <cmath>
#include <random>

namespace {

using namespace robots;
using second = ksl::second_order_dual<2>;

const ksl::model &robot() {
  static const ksl::model m = ksl::load(every_kind_file);
  return m;
}

/// step(algorithm) for every algorithm.
template <class Step, class... Algorithms> void for_each(std::tuple<Algorithms...>, Step step) {
  (step(Algorithms()), ...);
}

/// Every other link, in mixed axes; one for results that are singular for several.
template <class Algorithm> request asked_of(const ksl::model &m) {
  request asked = of_links(m, 2);
  for (int r = 0; r < Algorithm::row.results; ++r)
    if (Algorithm::row.result[r].axes > 0 && Algorithm::row.result[r].shape[0] == ksl::extent::twists)
      asked.links = {m.view().links / 2};
  asked.frame = {.axes = ksl::expressed_in::world, .offset = {0.3, -0.2, 0.1}};
  asked.reactions.at = ksl::wrench_frame::world;
  return asked;
}

template <class T> struct energies { T kinetic, potential; };

template <class T> energies<T> energy_of(const ksl::model &m, const state_over<T> &s) {
  const numbers<T> both = results<algorithms::energy>(m, s);
  return {both[0], both[1]};
}

template <class T> T power(const ksl::model &m, const state_over<T> &s) {
  return results<algorithms::external_power>(m, s)[0];
}

numbers<double> efforts(const ksl::model &m, state s, bool pushed = true) {
  if (!pushed)
    s.push.clear();
  return results<algorithms::inverse_dynamics>(m, s);
}

state random_rates(const ksl::model &m, std::mt19937 &random) {
  state rates = random_state(m, random);
  rates.q = random_numbers(m.nv(), random);
  return rates;
}

} // namespace

TEST_CASE("every algorithm: dual numbers have the values of plain ones, to the bit") {
  std::mt19937 random(1);
  for (int turn = 0; turn < 5; ++turn) {
    const ksl::model m =
        turn == 0 ? robot() : random_tree(2 + turn, random, turn % 2 ? joints_are::physical : joints_are::plain);
    if (m.nv() == 0)
      continue;
    const state s = random_state(m, random);
    const state_over<first> d = moved(m, s, {}, first(0));
    for_each(algorithms::all(), [&]<class Algorithm>(Algorithm) {
      CAPTURE(Algorithm::row.name);
      const request asked = asked_of<Algorithm>(m);
      const numbers<double> plain = results<Algorithm>(m, s, asked);
      const numbers<first> dual = results<Algorithm>(m, d, asked);
      REQUIRE(plain.size() == dual.size());
      bool same = true;
      for (std::size_t i = 0; i < plain.size(); ++i) {
        const bool unwritten = Algorithm::row.mimic == ksl::mimic_by::upper_triangle && std::isnan(plain[i]);
        same &= unwritten ? std::isnan(dual[i].value) : dual[i].value == plain[i] && dual[i].derivative[0] == 0;
      }
      CHECK(same);
    });
  }
}

TEST_CASE("derivatives of every algorithm are the limits of difference quotients") {
  std::mt19937 random(2);
  const ksl::model &m = robot();
  const state s = random_state(m, random);
  const state rates = random_rates(m, random);
  for_each(algorithms::all(), [&]<class Algorithm>(Algorithm) {
    if constexpr (Algorithm::row.mimic != ksl::mimic_by::upper_triangle) {
      CAPTURE(Algorithm::row.name);
      const request asked = asked_of<Algorithm>(m);
      const auto at = [&](double h) { return results<Algorithm>(m, moved(m, s, rates, h), asked); };
      const double h = 1e-3; // central differences, extrapolated: the error is h⁴
      const numbers<double> p1 = at(h), m1 = at(-h), p2 = at(2 * h), m2 = at(-2 * h);
      numbers<double> quotients;
      for (std::size_t i = 0; i < p1.size(); ++i)
        quotients.push_back((8 * (p1[i] - m1[i]) - (p2[i] - m2[i])) / (12 * h));
      CHECK(difference(derivatives(results<Algorithm>(m, moving(m, s, rates), asked)), quotients) <= 1e-8);
    }
  });
}

TEST_CASE("the derivative of efforts by accelerations is the mass matrix") {
  std::mt19937 random(3);
  const ksl::model &m = robot();
  const state s = random_state(m, random);
  const numbers<double> M = results<algorithms::mass_matrix>(m, s);
  for (std::size_t k = 0; k < s.v.size(); ++k)
    CHECK(difference(derivatives_by<algorithms::inverse_dynamics>(2, k, m, s, {}), part(M, k, s.v.size())) <= 1e-13);
}

TEST_CASE("the rate of the energy is the power of the joints and of the environment") {
  std::mt19937 random(4);
  const ksl::model &m = robot();
  for (int turn = 0; turn < 10; ++turn) {
    const state s = random_state(m, random);
    const energies<first> e = energy_of(m, in_time(m, s));
    const numbers<double> tau = efforts(m, s);
    double joints = 0, size = 0;
    for (std::size_t i = 0; i < tau.size(); ++i)
      joints += tau[i] * s.v[i], size += std::fabs(tau[i] * s.v[i]);
    CHECK(std::fabs((e.kinetic + e.potential).derivative[0] - (joints + power(m, s))) <= 1e-13 * size);
  }
}

TEST_CASE("the gradient of the potential energy is the effort that holds the mechanism at rest") {
  std::mt19937 random(5);
  const ksl::model &m = robot();
  state s = random_state(m, random);
  s.v.assign(s.v.size(), 0.0), s.a = s.v;
  numbers<double> gradient;
  for (std::size_t i = 0; i < s.v.size(); ++i)
    gradient.push_back(derivatives_by<algorithms::energy>(0, i, m, s, {})[1]);
  CHECK(difference(gradient, efforts(m, s, false)) <= 1e-13);
}

TEST_CASE("the power of external wrenches depends on velocities by the efforts they take off the joints") {
  std::mt19937 random(6);
  const ksl::model &m = robot();
  const state s = random_state(m, random);
  const numbers<double> without = efforts(m, s, false), with = efforts(m, s);
  numbers<double> taken, slopes;
  for (std::size_t i = 0; i < s.v.size(); ++i) {
    taken.push_back(without[i] - with[i]);
    slopes.push_back(derivatives_by<algorithms::external_power>(1, i, m, s, {})[0]);
  }
  CHECK(difference(slopes, taken) <= 1e-12);
}

TEST_CASE("forward dynamics of the efforts gives back the accelerations, and so do all derivatives") {
  std::mt19937 random(7);
  const ksl::model &m = robot();
  for (int turn = 0; turn < 4; ++turn) {
    const state s = random_state(m, random), rates = random_rates(m, random);
    state_over<first> d = moving(m, s, rates);
    d.tau = results<algorithms::inverse_dynamics>(m, d);
    CHECK(difference(derivatives(results<algorithms::forward_dynamics>(m, d)), rates.a) <= 1e-9);
  }
}

TEST_CASE("a wrench of one has the power of one component of its link's velocity") {
  std::mt19937 random(8);
  const ksl::model &m = robot();
  state s = random_state(m, random);
  s.axes = ksl::expressed_in::frame;
  for (int link : s.pushed) {
    const numbers<double> twist = results<algorithms::frame_velocities>(m, s, {{link}, {}, {}});
    for (std::size_t c = 0; c < 6; ++c) {
      state one = s;
      one.pushed = {link}, one.push = unit(6, c);
      CHECK(power(m, one) == doctest::Approx(twist[c]).epsilon(1e-12));
    }
  }
}

TEST_CASE("the second derivative of the kinetic energy by velocities is the mass matrix, and symmetric") {
  std::mt19937 random(9);
  const ksl::model &m = robot();
  const state s = random_state(m, random);
  const numbers<double> M = results<algorithms::mass_matrix>(m, s);
  const std::size_t nv = s.v.size();
  const double size = largest(M);
  for (std::size_t i = 0; i < nv; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      state_over<second> d = moved(m, s, {}, second(0));
      d.v[i] = ksl::second_order_variable<2>(s.v[i], 0), d.v[j] = ksl::second_order_variable<2>(s.v[j], 1);
      const second kinetic = energy_of(m, d).kinetic;
      CHECK(std::fabs(kinetic.derivative[0].derivative[1] - M[i * nv + j]) <= 1e-13 * size);
      CHECK(kinetic.derivative[0].derivative[1] == doctest::Approx(kinetic.derivative[1].derivative[0]).epsilon(1e-12));
      CHECK(std::fabs(kinetic.derivative[0].derivative[0] - M[i * nv + i]) <= 1e-13 * size);
    }
}

TEST_CASE("second derivatives of the energy along the manifold are symmetric, and those of its gradient") {
  std::mt19937 random(10);
  const ksl::model &m = robot();
  const state s = random_state(m, random);
  const std::size_t nv = s.v.size();
  for (std::size_t i = 0; i < nv; ++i) {
    const std::size_t j = (5 * i + 3) % nv;
    numbers<second> x(nv, second(0));
    x[i] = ksl::second_order_variable<2>(0.0, 0);
    x[j] = x[j] + ksl::second_order_variable<2>(0.0, 1);
    state_over<second> d = moved(m, s, {}, second(0));
    d.q = moved(m, s.q, x);
    const energies<second> e = energy_of(m, d);
    const second sum = e.kinetic + e.potential;
    CHECK(std::fabs(sum.derivative[0].derivative[1] - sum.derivative[1].derivative[0]) <=
          1e-12 * std::fabs(sum.value.value));
    const auto gradient = [&](double h) { // ∂/∂x_i at h in direction j
      state_over<first> at = moved(m, s, {}, first(0));
      numbers<first> y(nv, first(0));
      y[j] = first(h);
      y[i] = y[i] + first::variable(0.0, 0);
      at.q = moved(m, s.q, y);
      const energies<first> f = energy_of(m, at);
      return (f.kinetic + f.potential).derivative[0];
    };
    const double h = 1e-3;
    const double quotient = (8 * (gradient(h) - gradient(-h)) - (gradient(2 * h) - gradient(-2 * h))) / (12 * h);
    CHECK(std::fabs(sum.derivative[0].derivative[1] - quotient) <= 1e-8 * std::fabs(sum.value.value));
  }
}

TEST_CASE("inverse dynamics of an arm is Lagrange's equation of its energies") {
  const ksl::model m = ksl::load(robot_file("panda")); // revolute and prismatic, on the ground
  std::mt19937 random(11);
  const state s = random_state(m, random);
  numbers<double> lagrange;
  for (std::size_t i = 0; i < s.v.size();
       ++i) { // d/dt ∂L/∂v_i − ∂L/∂q_i: direction 0 is time, 1 the coordinate's velocity
    state_over<second> d = moved(m, s, {}, second(0));
    for (std::size_t k = 0; k < s.q.size(); ++k) {
      d.q[k].derivative[0] = ksl::dual<2>(s.v[k]), d.q[k].value.derivative[0] = s.v[k];
      d.v[k].derivative[0] = ksl::dual<2>(s.a[k]), d.v[k].value.derivative[0] = s.a[k];
    }
    d.v[i] = d.v[i] + ksl::second_order_variable<2>(0.0, 1);
    const energies<second> e = energy_of(m, d);
    const numbers<double> by_q = derivatives_by<algorithms::energy>(0, i, m, s, {});
    lagrange.push_back((e.kinetic - e.potential).derivative[0].derivative[1] - (by_q[0] - by_q[1]));
  }
  CHECK(difference(lagrange, efforts(m, s, false)) <= 1e-13);
}

TEST_CASE("states in lanes, with a derivative each") {
  using P = ksl::native_pack<double>;
  using T = ksl::dual<1, P>;
  std::mt19937 random(12);
  const ksl::model &m = robot();
  numbers<state_over<first>> one;
  for (int lane = 0; lane < ksl::native_lanes<double>; ++lane) {
    state s = random_state(m, random), rates;
    s.axes = ksl::expressed_in::world;
    rates.q = random_numbers(m.nv(), random);
    one.push_back(moving(m, s, rates));
  }
  const auto gather = [&](auto part) {
    numbers<T> out((one[0].*part).size(), T(0));
    for (std::size_t i = 0; i < out.size(); ++i)
      for (int lane = 0; lane < ksl::native_lanes<double>; ++lane) {
        const first &x = (one[static_cast<std::size_t>(lane)].*part)[i];
        out[i].value.set(lane, x.value), out[i].derivative[0].set(lane, x.derivative[0]);
      }
    return out;
  };
  using S = state_over<first>;
  const numbers<T> q = gather(&S::q);
  const state_over<T> lanes = {q, gather(&S::v), gather(&S::a), gather(&S::tau), gather(&S::push),
                               q, one[0].pushed, one[0].axes};
  const numbers<T> tau = results<algorithms::inverse_dynamics>(m, lanes);
  for (int lane = 0; lane < ksl::native_lanes<double>; ++lane) {
    const numbers<first> expected = results<algorithms::inverse_dynamics>(m, one[static_cast<std::size_t>(lane)]);
    for (std::size_t i = 0; i < tau.size(); ++i) {
      CHECK(tau[i].value[lane] == expected[i].value);
      CHECK(tau[i].derivative[0][lane] == expected[i].derivative[0]);
    }
  }
}

TEST_CASE("functions of a dual number") {
  using f = ksl::math<second>;
  const auto check = [](const second &y, double value, double slope, double curvature) {
    CHECK(y.value.value == doctest::Approx(value).epsilon(1e-15));
    CHECK(y.derivative[0].value == doctest::Approx(slope).epsilon(1e-14));
    CHECK(y.value.derivative[0] == doctest::Approx(slope).epsilon(1e-14));
    CHECK(y.derivative[0].derivative[0] == doctest::Approx(curvature).epsilon(1e-14));
    CHECK(y.derivative[1].value == 0);
  };
  for (double at : {0.7, 2.3}) {
    const second x = ksl::second_order_variable<2>(at, 0);
    const double s = std::sin(at), c = std::cos(at), squares = at * at + 9;
    check(f::sqrt(x), std::sqrt(at), 0.5 / std::sqrt(at), -0.25 * std::pow(at, -1.5));
    check(second(1) / x, 1 / at, -1 / (at * at), 2 / (at * at * at));
    check(x * x * x, at * at * at, 3 * at * at, 6 * at);
    check(f::sin(x), s, c, -s);
    check(f::cos(x), c, -s, -c);
    check(f::atan2(x, second(3)), std::atan2(at, 3), 3 / squares, -6 * at / (squares * squares));
    check(f::atan2(second(3), x), std::atan2(3, at), -3 / squares, 6 * at / (squares * squares));
    check(f::fabs(-x * x), at * at, 2 * at, 2);
    check(f::select(x < second(1), x, x * x), at < 1 ? at : at * at, at < 1 ? 1 : 2 * at, at < 1 ? 0 : 2);
    second sine, cosine;
    ksl::sine_cosine(x, sine, cosine);
    check(sine, s, c, -s);
    check(cosine, c, -s, -c);
  }
}

TEST_CASE("operations on many numbers, which are called instead of inlined, and comparisons") {
  using many = ksl::dual<20>;
  const many x = many::variable(0.7, 19), y = many::variable(2, 0);
  const many product = x * y, quotient = x / y;
  CHECK((product.value == 1.4 && product.derivative[19] == 2 && product.derivative[0] == 0.7 &&
         product.derivative[7] == 0));
  CHECK((quotient.value == 0.35 && quotient.derivative[19] == 0.5 &&
         quotient.derivative[0] == doctest::Approx(-0.175).epsilon(1e-15)));
  CHECK((y >= x && x >= x && !(x >= y))); // by the values alone
}

TEST_CASE("constants of double precision become those of a dual number in single precision") {
  const ksl::dual<2, float> x(0.1);
  CHECK((x.value == 0.1f && x.derivative[0] == 0 && x.derivative[1] == 0));
}

TEST_CASE("the exponential of a screw at zero has the screw as its derivative") {
  const ksl::screw<first> s = {{first::variable(0, 0), first(0), first(0)},
                               {first(0), first(0), 2.0 * first::variable(0, 0)}};
  ksl::SE3<first> D;
  ksl::algebra<first>::SE3_exp(&s, &D);
  CHECK(D.t.x.derivative[0] == 1);
  CHECK(D.R.m10.derivative[0] == 2);
  CHECK(D.R.m01.derivative[0] == -2);
  CHECK(D.R.m00.derivative[0] == 0);
  CHECK(D.R.m00.value == 1);
}
