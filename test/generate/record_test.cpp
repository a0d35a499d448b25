// Recorded algorithms against the engine: the same bits in other states, in both precisions, for every row and every kind of joint.
#include "generate/record.hpp"
#include "generate/recording.hpp"

#include "ksl/dynamics.hpp"
#include "robot_files.hpp"
#include "states.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

namespace {

using namespace robots;
using ksl::generate::graph;
using ksl::generate::operation;
using ksl::generate::recorded;
using ksl::generate::recording;
using ksl::generate::step;

/// What a program of the steps computes, in the precision S.
template <class S> numbers<S> play(const graph &g, const numbers<S> &inputs) {
  numbers<S> value, out;
  for (const step &s : g.steps()) {
    const auto of = [&](int i) { return i < 0 ? S(0) : value[static_cast<std::size_t>(i)]; };
    const S a = of(s.a), b = of(s.b), c = of(s.c);
    S sine = 0, cosine = 0;
    if (s.what == operation::sine || s.what == operation::cosine)
      ksl::sine_cosine(a, sine, cosine);
    switch (s.what) {
    case operation::constant: value.push_back(static_cast<S>(s.number)); break;
    case operation::input: value.push_back(inputs[static_cast<std::size_t>(s.number)]); break;
    case operation::add: value.push_back(a + b); break;
    case operation::subtract: value.push_back(a - b); break;
    case operation::multiply: value.push_back(a * b); break;
    case operation::divide: value.push_back(a / b); break;
    case operation::negate: value.push_back(-a); break;
    case operation::less: value.push_back(a < b); break;
    case operation::at_most: value.push_back(a <= b); break;
    case operation::equal: value.push_back(a == b); break;
    case operation::select: value.push_back(a != S(0) ? b : c); break;
    case operation::root: value.push_back(std::sqrt(a)); break;
    case operation::absolute: value.push_back(std::fabs(a)); break;
    case operation::sine: value.push_back(sine); break;
    case operation::cosine: value.push_back(cosine); break;
    case operation::arctangent: value.push_back(std::atan2(a, b)); break;
    }
  }
  for (const int i : g.outputs())
    out.push_back(i < 0 ? S(NAN) : value[static_cast<std::size_t>(i)]);
  return out;
}

template <class S> numbers<S> in(const numbers<double> &x) { return {x.begin(), x.end()}; }

template <class S> state_over<S> rounded(const state &s) {
  return {in<S>(s.q),   in<S>(s.v),    in<S>(s.a),
          in<S>(s.tau), in<S>(s.push), in<S>(s.q1),
          s.pushed,     s.axes,        static_cast<S>(s.fraction)};
}

/// The inputs of a row in the order of a recording.
template <class S> numbers<S> inputs_of(const ksl::algorithm_row &row, const state_over<S> &s) {
  numbers<S> all;
  const auto add = [&](const numbers<S> &x) { all.insert(all.end(), x.begin(), x.end()); };
  for (int i = 0; i < row.inputs; ++i)
    switch (row.input_list[i]) {
    case ksl::input::q: add(s.q); break;
    case ksl::input::v: add(s.v); break;
    case ksl::input::a: add(s.a); break;
    case ksl::input::tau: add(s.tau); break;
    case ksl::input::q1: add(s.q1); break;
    case ksl::input::fraction: all.push_back(s.fraction); break;
    }
  if (row.external != ksl::external_use::none)
    add(s.push);
  return all;
}

template <class Step, class... Algorithms> void for_each(std::tuple<Algorithms...>, Step step) {
  (step(Algorithms()), ...);
}

/// Largest difference over the largest number; NaN is what both don't write.
template <class S> double apart(const numbers<S> &x, const numbers<S> &y) {
  REQUIRE(x.size() == y.size());
  double worst = 0, size = 1e-300;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!(std::isnan(x[i]) && std::isnan(y[i]))) {
      const double d = std::fabs(static_cast<double>(x[i]) - static_cast<double>(y[i]));
      worst = d <= worst ? worst : d, size = std::fmax(size, std::fabs(static_cast<double>(y[i])));
    }
  return worst / size;
}

/// The recording of a row and the engine in states of a model.  Where joints move along exponentials the engine calls the C library's sine, and
/// recordings have KSL's own: the manifold agrees to rounding.
template <class Algorithm, class S> void check_row(const ksl::model &m, std::mt19937 &random, int states) {
  INFO("row ", std::string(Algorithm::row.name));
  const ksl::algorithm_row &row = Algorithm::row;
  request asked = of_links(m, 2);
  if (row.request == ksl::request_kind::relative)
    asked.links = {m.view().links - 1, m.view().links / 2};
  state s = random_state(m, random);
  s.axes = ksl::expressed_in::frame;
  ksl::generate::request wanted;
  wanted.row = row.name, wanted.links = asked.links, wanted.single = sizeof(S) == 4;
  wanted.joints.n = static_cast<int>(asked.links.size()), wanted.joints.link = asked.links.data();
  if (row.external != ksl::external_use::none)
    wanted.external_links = s.pushed;
  const recorded made = ksl::generate::record(m, wanted);
  const bool manifold = row.reads(ksl::input::q1) || std::string(row.name).starts_with("integrate");
  for (int turn = 0; turn < states; ++turn) {
    s = random_state(m, random), s.axes = ksl::expressed_in::frame;
    const state_over<S> numbers_of_s = rounded<S>(s);
    const auto engine = results<Algorithm>(m, numbers_of_s, asked);
    const auto played = play(made.steps, inputs_of(row, numbers_of_s));
    CHECK(apart(played, engine) <= (manifold ? 64 * (sizeof(S) == 4 ? 6e-8 : 1.1e-16) : 0));
  }
}

} // namespace

TEST_CASE("every algorithm, recorded once, gives the engine's bits in every state") {
  std::mt19937 random(11);
  for (int turn = 0; turn < 4; ++turn) {
    const ksl::model m = turn == 0 ? ksl::load(every_kind_file)
                                   : random_tree(2 + turn, random, turn % 2 ? joints_are::physical : joints_are::plain);
    if (m.nv() == 0)
      continue;
    for_each(algorithms::all(), [&]<class Algorithm>(Algorithm) {
      check_row<Algorithm, double>(m, random, 2);
      check_row<Algorithm, float>(m, random, 2);
    });
  }
}

TEST_CASE("what is left of the UR5's algorithms") {
  const ksl::model m = ksl::load(robot_file("ur5"));
  const auto count = [&](const char *row) {
    ksl::generate::request asked;
    asked.row = row;
    int n = 0;
    const recorded made = ksl::generate::record(m, asked);
    for (const step &s : made.steps.steps())
      n += s.what >= operation::add && s.what <= operation::divide;
    return n;
  };
  CHECK(count("inverse_dynamics") <= 478); // + − × ÷; 1,305 as recorded
  CHECK(count("forward_dynamics") <= 1906);
  CHECK(count("mass_matrix") <= 409);
}

TEST_CASE("gravity is an input on request") {
  const ksl::model m = ksl::load(robot_file("ur5"));
  ksl::generate::request asked;
  asked.row = "gravity_torque", asked.gravity = true;
  const recorded made = ksl::generate::record(m, asked);
  REQUIRE(made.inputs.size() == 2);
  CHECK(made.inputs[1].name == "gravity");
  numbers<double> x = {0.1, -0.7, 1.2, 0.3, -0.4, 2.0, 1.0, -2.0, 3.5};
  const ksl::model tilted = m.with_gravity({x[6], x[7], x[8]});
  numbers<double> tau(6);
  ksl::data d(tilted);
  ksl::gravity_torque(tilted, d, x.data(), tau.data());
  CHECK(play(made.steps, x) == tau);
}

TEST_CASE("choices are recorded where an input decides, and made where constants do") {
  graph g(false);
  const ksl::generate::recording_on on(g);
  const recording x = recording::step_of(g.input(0)), two = 2.0;
  g.output(ksl::math<recording>::select(x < two, x * x, -x).place());
  CHECK(play<double>(g, {1.5}) == numbers<double>{2.25});
  CHECK(play<double>(g, {3}) == numbers<double>{-3});
  CHECK(static_cast<bool>(two == recording(2.0)));
  CHECK_FALSE(static_cast<bool>(two != recording(2.0)));
  CHECK(static_cast<bool>(two != recording(3.0)));
  CHECK_THROWS_AS((void)static_cast<bool>(x < two), ksl::generate::recording_error);
  CHECK((recording() + x).place() == -1); // nothing has computed it
}

TEST_CASE("steps are shortened without a change of bits") {
  graph g(false);
  const ksl::generate::recording_on on(g);
  const recording x = recording::step_of(g.input(0)), y = recording::step_of(g.input(1)), zero = 0.0, one = 1.0;
  CHECK((x + zero).place() == x.place());
  CHECK((x * one).place() == x.place());
  CHECK((x / one).place() == x.place());
  CHECK((-(-x)).place() == x.place());
  CHECK((x + y).place() == (y + x).place());
  CHECK((x + -y).place() == (x - y).place());
  CHECK((-(x - y)).place() == (y - x).place());
  CHECK((x * -y).place() == (-(x * y)).place());
  CHECK(g.number((recording(0.1) + recording(0.2)).place()) == 0.1 + 0.2);
  graph single(true);
  const ksl::generate::recording_on on_single(single);
  CHECK(single.number((recording(0.1) + recording(0.2)).place()) == static_cast<double>(0.1f + 0.2f));
}

TEST_CASE("recordings are bounded") {
  graph g(false, 5);
  const ksl::generate::recording_on on(g);
  const recording x = recording::step_of(g.input(0)), y = x * x, z = y * y;
  CHECK((z * z).place() == 3);
  CHECK((y * y).place() == z.place()); // is there
  CHECK_THROWS_AS((y + z) * y, ksl::generate::recording_error);
}

TEST_CASE("what can't be recorded is refused by name") {
  ksl::generate::request asked;
  asked.row = "inverse_dynamic";
  CHECK_THROWS_WITH_AS(ksl::generate::record(ksl::load(robot_file("ur5")), asked),
                       "there is no algorithm 'inverse_dynamic'", std::invalid_argument);
  asked.row = "inverse_dynamics_regressor";
  CHECK_THROWS_AS(ksl::generate::record(ksl::load(robot_file("excavator")), asked), std::invalid_argument);
  asked.row = "jacobian";
  CHECK_THROWS_AS(ksl::generate::record(ksl::load(robot_file("ur5")), asked), std::invalid_argument);
  asked.links = {100};
  CHECK_THROWS_AS(ksl::generate::record(ksl::load(robot_file("ur5")), asked), std::out_of_range);
}
