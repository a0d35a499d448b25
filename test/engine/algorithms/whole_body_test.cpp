// Centre of mass, centroidal momentum and regressors on dual numbers, for every kind of joint: what is said to be a rate is the
// derivative by time along a motion.
#include "states.hpp"
#include "robot_files.hpp"

#include <random>

namespace {

using namespace robots;
using matrices::product;
using namespace algorithms;

/// Algorithms at one motion of a robot with every kind of joint, and their rates.
struct motion {
  ksl::model m;
  state s;
  request all = of_links(m);

  motion(std::mt19937 &random, bool with_gravity = true) : m(robot(with_gravity)), s(random_state(m, random)) {}

  static ksl::model robot(bool with_gravity) {
    ksl::model_options options;
    if (!with_gravity)
      options.gravity = {0, 0, 0};
    return ksl::load(every_kind_file, options);
  }
  template <class Algorithm> numbers<double> values() const { return results<Algorithm>(m, s, all); }
  template <class Algorithm> numbers<first> in_time() const {
    return results<Algorithm>(m, robots::in_time(m, s), all);
  }
  template <class Algorithm> numbers<double> rates() const { return derivatives(in_time<Algorithm>()); }
  /// A matrix times the velocities.
  template <class Matrix> numbers<double> times_velocity() const { return product(values<Matrix>(), s.v, s.v.size()); }
  template <class Matrix> numbers<double> rates_times_velocity() const {
    const numbers<first> A = in_time<Matrix>(), v = along(s.v, s.a, first::variable(0, 0));
    numbers<double> out(A.size() / v.size());
    for (std::size_t k = 0; k < A.size(); ++k)
      out[k / v.size()] += (A[k] * v[k % v.size()]).derivative[0];
    return out;
  }
};

void check_near(const numbers<double> &found, const numbers<double> &expected) {
  CHECK(matrices::difference(found, expected) <= 1e-12);
}

} // namespace

TEST_CASE(
    "the centre of mass moves with its velocity and acceleration, and the centroidal momentum changes at its rate") {
  std::mt19937 random(1);
  for (int k = 0; k < 5; ++k) {
    const motion x(random);
    check_near(x.rates<center_of_mass>(), x.values<center_of_mass_velocity>());
    check_near(x.rates<center_of_mass_velocity>(), x.values<center_of_mass_acceleration>());
    check_near(x.times_velocity<center_of_mass_jacobian>(), x.values<center_of_mass_velocity>());
    check_near(x.rates_times_velocity<center_of_mass_jacobian>(), x.values<center_of_mass_acceleration>());
    check_near(x.rates<centroidal_momentum>(), x.values<centroidal_momentum_rate>());
    check_near(x.times_velocity<centroidal_momentum_matrix>(), x.values<centroidal_momentum>());
    check_near(x.rates_times_velocity<centroidal_momentum_matrix>(), x.values<centroidal_momentum_rate>());
  }
}

TEST_CASE("for each parameter, the rate of the energies is the power of the efforts") {
  std::mt19937 random(4);
  for (int k = 0; k < 3; ++k) {
    const motion x(random);
    const numbers<double> both = x.rates<energy_regressor>(), potential = part(both, 1, 2);
    numbers<double> rate = part(both, 0, 2);
    for (std::size_t i = 0; i < rate.size(); ++i)
      rate[i] += potential[i];
    check_near(rate, product(x.s.v, x.values<inverse_dynamics_regressor>(), x.s.v.size()));
  }
}

TEST_CASE("for each parameter, the rate of the momentum is what the ground exerts without gravity") {
  std::mt19937 random(5);
  for (int k = 0; k < 3; ++k) {
    const motion x(random, false);
    const numbers<double> rate = x.rates<momentum_regressor>(); // (6, links, 10), the links as they are asked for
    request root;                                               // the joint that carries it carries all links
    root.links = {0}, root.reactions.at = root.reactions.axes = ksl::wrench_frame::world;
    const numbers<double> exerted = results<reactions_regressor>(x.m, x.s, root); // (6, links, 10)
    const std::size_t links = x.all.links.size();
    numbers<double> expected;
    for (std::size_t c = 0; c < 6; ++c)
      for (const int l : x.all.links)
        for (std::size_t p = 0; p < 10; ++p)
          expected.push_back(exerted[(c * links + static_cast<std::size_t>(l)) * 10 + p]);
    check_near(rate, expected);
  }
}
