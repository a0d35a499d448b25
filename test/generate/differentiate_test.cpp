// Derivatives of recordings against dual numbers, and rates against weights.
#include "recordings.hpp"
#include "generate/differentiate.hpp"
#include "generate/record_derivative.hpp"

#include <doctest/doctest.h>

#include <random>

namespace {

using namespace recordings;
using ksl::generate::derivative;

/// Every operation that a graph has.
template <class T> T expression(const T &x, const T &y) {
  using m = ksl::math<T>;
  const T root = m::sqrt(x * x + T(2.0)), chosen = m::select(x < y, x * y, -y);
  T sine, cosine, of_y[2];
  m::sine_cosine(x * y, sine, cosine);
  m::sine_cosine(y, of_y[0], of_y[1]);
  return chosen / root + sine * of_y[1] - m::atan2(y, x) * m::fabs(x - y);
}

numbers<double> random_numbers(std::size_t n, std::mt19937 &random) {
  std::normal_distribution<double> normal;
  numbers<double> x(n);
  for (double &of : x)
    of = normal(random);
  return x;
}

double dot(const numbers<double> &x, const numbers<double> &y) {
  REQUIRE(x.size() == y.size());
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    sum += std::isnan(x[i]) || std::isnan(y[i]) ? 0 : x[i] * y[i]; // NaN: isn't written
  return sum;
}

numbers<double> joined(numbers<double> x, const numbers<double> &y) {
  x.insert(x.end(), y.begin(), y.end());
  return x;
}

int operations(const recorded &of) {
  int n = 0;
  for (const step &s : of.steps.steps())
    n += s.what >= operation::add && s.what <= operation::divide;
  return n;
}

/// Rates along a random motion are those of dual numbers, and ȳ · ẏ is x̄ · ẋ.
template <class Algorithm> void check_derivatives_of(const ksl::model &m, std::mt19937 &random) {
  const ksl::algorithm_row &row = Algorithm::row;
  const std::string name = row.name;
  INFO("row ", name);
  const state s = state_with_pushes(m, random);
  requests of = requests_of(row, m, s, false);
  of.wanted.joints.link = of.asked.links.data();
  const auto nv = static_cast<std::size_t>(m.nv());
  const state rates = {.q = random_numbers(nv, random),
                       .v = random_numbers(nv, random),
                       .a = random_numbers(nv, random),
                       .tau = random_numbers(nv, random),
                       .push = random_numbers(s.push.size(), random)};
  const numbers<double> x = inputs_of(row, s), dx = inputs_of(row, rates),
                        dy = play(record_derivative(m, of.wanted, derivative::rates).steps, joined(x, dx));
  CHECK(apart(dy, derivatives(results<Algorithm>(m, moving(m, s, rates), of.asked))) <= 1e-11);
  const numbers<double> weights = random_numbers(dy.size(), random),
                        by = play(record_derivative(m, of.wanted, derivative::weights).steps, joined(x, weights));
  const double along = dot(weights, dy);
  CHECK(std::fabs(dot(by, dx) - along) <= 1e-11 * std::sqrt(dot(weights, weights) * dot(dy, dy)));
}

} // namespace

TEST_CASE("each operation has its derivative") {
  graph g(false), out(false);
  {
    const ksl::generate::recording_on on(g);
    g.output(expression(recording::step_of(g.input(0)), recording::step_of(g.input(1))).place());
  }
  const ksl::generate::recording_on on(out);
  std::vector<recording> in;
  for (int i = 0; i < 5; ++i)
    in.push_back(recording::step_of(out.input(i)));
  const ksl::generate::differentiation steps(g, {in[0], in[1]});
  out.output(steps.rates({in[2], in[3]})[0].place());
  for (const recording &w : steps.weights({in[4]}))
    out.output(w.place());
  using dual = ksl::dual<2>;
  for (const auto &[x, y] : {std::pair(0.7, -1.3), std::pair(-0.4, 2.0), std::pair(-1.5, -1.2)}) {
    const dual z = expression(dual::variable(x, 0), dual::variable(y, 1));
    const numbers<double> found = play<double>(out, {x, y, 0.3, -0.8, 2.0});
    CHECK(found[0] == doctest::Approx(0.3 * z.derivative[0] - 0.8 * z.derivative[1]).epsilon(1e-14));
    CHECK(found[1] == doctest::Approx(2 * z.derivative[0]).epsilon(1e-14));
    CHECK(found[2] == doctest::Approx(2 * z.derivative[1]).epsilon(1e-14));
  }
}

TEST_CASE("rates of every algorithm are those of dual numbers, and weights are their adjoint") {
  std::mt19937 random(3);
  for (const ksl::model &m : {ksl::load(every_kind_file), random_tree(4, random, joints_are::physical)})
    for_each(algorithms::all(), [&]<class Algorithm>(Algorithm) {
      const std::string name = Algorithm::row.name;
      if (Algorithm::row.reads(ksl::input::q1) || name == "integrate")
        return;
      if (name.ends_with("second_derivatives") || (m.nv() > 20 && name.starts_with("operational"))) // most of the time
        return;
      check_derivatives_of<Algorithm>(m, random);
    });
}

TEST_CASE("weights of inverse dynamics are its gradient, at fewer than five times its operations") {
  const ksl::model m = ksl::load(robot_file("panda"));
  std::mt19937 random(4);
  const state s = random_state(m, random);
  ksl::generate::request asked;
  asked.row = "inverse_dynamics";
  const int own = operations(ksl::generate::record(m, asked));
  const recorded made = record_derivative(m, asked, derivative::weights);
  MESSAGE("operations: ", own, ", with weights ", operations(made));
  CHECK(operations(made) <= 5 * own);
  const numbers<double> x = joined(joined(s.q, s.v), s.a), found = play(made.steps, joined(x, s.tau));
  CHECK(apart(found, results<algorithms::inverse_dynamics_gradient>(m, s)) <= 1e-12);
}

TEST_CASE("derivatives that aren't those of the mechanism are refused") {
  ksl::generate::request asked;
  for (const char *row : {"integrate", "difference", "interpolate"}) {
    asked.row = row;
    CHECK_THROWS_WITH_AS(record_derivative(ksl::load(robot_file("ur5")), asked, derivative::weights),
                         doctest::Contains("integrate_jacobians"), std::invalid_argument);
  }
  asked.row = "inverse_dynamics";
  CHECK_THROWS_WITH_AS(record_derivative(ksl::load(robot_file("excavator")), asked, derivative::matrix),
                       doctest::Contains("cut the loops"), std::invalid_argument);
}
