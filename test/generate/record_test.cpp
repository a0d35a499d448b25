// Recorded algorithms against the engine: the same bits in other states, in both precisions, for every row and every kind of joint.
#include "recordings.hpp"

#include <doctest/doctest.h>

#include <random>

namespace {

using namespace recordings;

/// The recording of a row and the engine in states of a model.
template <class Algorithm, class S> void check_row(const ksl::model &m, std::mt19937 &random, int states) {
  const ksl::algorithm_row &row = Algorithm::row;
  INFO("row ", std::string(row.name));
  requests of = requests_of(row, m, random_state(m, random), sizeof(S) == 4);
  of.wanted.joints.link = of.asked.links.data();
  const recorded made = ksl::generate::record(m, of.wanted);
  for (int turn = 0; turn < states; ++turn) {
    const state_over<S> s = rounded<S>(state_with_pushes(m, random));
    CHECK(apart(play(made.steps, inputs_of(row, s)), results<Algorithm>(m, s, of.asked)) == 0);
  }
}

/// Ten numbers of regressors, appended.
template <class S> void append(const ksl::spatial_inertia<double> &I, numbers<S> &to) {
  for (const double x : {I.m, I.h.x, I.h.y, I.h.z, I.Ixx, I.Ixy, I.Iyy, I.Izx, I.Iyz, I.Izz})
    to.push_back(static_cast<S>(x));
}

/// The last link that is welded to another; the root where there is none.
int last_welded(const ksl::model &m) {
  int l = m.view().links - 1;
  while (l > 0 && m.view().link[l].carried_by_moving_joint)
    --l;
  return l;
}

/// A payload on a moving and a welded link, or their own parameters replaced, as inputs: against the engine's model that has the sums.  Without
/// payload there are the bits of the model alone.
template <class Algorithm, class S>
void check_inertias(const ksl::model &m, bool replaces, std::mt19937 &random, double bound) {
  const ksl::algorithm_row &row = Algorithm::row;
  INFO("row ", std::string(row.name), replaces ? ", parameters" : ", payload");
  requests of = requests_of(row, m, random_state(m, random), sizeof(S) == 4);
  of.wanted.joints.link = of.asked.links.data();
  const std::vector<int> links = {m.view().links / 2, last_welded(m)};
  (replaces ? of.wanted.parameter_links : of.wanted.payload_links) = links;
  const recorded made = ksl::generate::record(m, of.wanted);
  const state_over<S> s = rounded<S>(state_with_pushes(m, random));
  std::vector<ksl::link_inertia> sums;
  numbers<S> given = inputs_of(row, s), none = given;
  for (const int l : links) {
    const ksl::spatial_inertia<double> own = m.links()[static_cast<std::size_t>(l)].inertia,
                                       p = {1.5, {0.25, -0.5, 0.75}, 2.25, 2.5, 1.75, 0.125, -0.25, 0.5};
    ksl::link_inertia &sum = sums.emplace_back(ksl::link_inertia{l, {}});
    ksl::algebra<double>::spatial_inertia_added(&own, &p, &sum.inertia);
    append(replaces ? sum.inertia : p, given), append(replaces ? own : ksl::spatial_inertia<double>{}, none);
  }
  CHECK(apart(play(made.steps, given), results<Algorithm>(m.with_inertias(sums), s, of.asked)) <= bound);
  CHECK(apart(play(made.steps, none), results<Algorithm>(m, s, of.asked)) <= (replaces ? bound : 0));
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
  asked.row = "mass_matrix";
  CHECK_THROWS_AS(ksl::generate::record(ksl::load(robot_file("excavator")), asked), std::invalid_argument);
  asked.row = "jacobian";
  CHECK_THROWS_AS(ksl::generate::record(ksl::load(robot_file("ur5")), asked), std::invalid_argument);
  asked.links = {100};
  CHECK_THROWS_AS(ksl::generate::record(ksl::load(robot_file("ur5")), asked), std::out_of_range);
}

TEST_CASE("inertias of links are inputs: every algorithm has the numbers of the model with them") {
  std::mt19937 random(5);
  for (const ksl::model &m : {ksl::load(every_kind_file), random_tree(3, random, joints_are::physical)})
    for_each(algorithms::all(), [&]<class Algorithm>(Algorithm) {
      const std::string name = Algorithm::row.name;
      if (name == "operational_space" ||
          name == "operational_space_inertia") // of several links singular: rounding chooses
        return;
      if (name.ends_with("second_derivatives") && m.nv() > 20) // nearly all of the time
        return;
      for (const bool replaces : {false, true})
        check_inertias<Algorithm, double>(m, replaces, random, Algorithm::row.needs_mass ? 1e-11 : 1e-13);
      check_inertias<Algorithm, float>(m, false, random, 2e-3);
    });
}
