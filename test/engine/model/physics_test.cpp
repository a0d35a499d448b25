// The physics of joints: damping, dry friction, rotors and springs, against their laws and the power balance.
#include "robots.hpp"

#include "ksl/dual.hpp"
#include "ksl/engine/algorithms/energy/energy.hpp"
#include "ksl/engine/algorithms/forward/forward_dynamics.hpp"
#include "ksl/engine/algorithms/inverse/effort_parts.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

namespace {

constexpr double q[2] = {0.8, -1.9}, v[2] = {2.1, -0.6}, a[2] = {-1.7, 0.4};

ksl::robot_description arm() {
  ksl::robot_description r = robots::double_pendulum(1.3, 0.7, 0.9, 0.5);
  ksl::joint_description &shoulder = r.joints[0], &elbow = r.joints[1];
  shoulder.damping = 0.3, shoulder.friction = 1.5, shoulder.armature = 0.02;
  shoulder.rotor_inertia = 1e-5, shoulder.gear_ratio = 100;
  elbow.damping = 0.1, elbow.friction = 0.4, elbow.friction_width = 0.5;
  elbow.spring_stiffness = 7, elbow.spring_rest = 0.2;
  return r;
}

ksl::model_options all_physics() {
  ksl::model_options options;
  options.physics = ksl::physics_options{
      .damping = true, .friction = true, .armature = true, .rotor = true, .spring = true, .friction_width = 0.01};
  return options;
}

double friction(double F, double speed, double width) { return F * speed / std::sqrt(speed * speed + width * width); }

} // namespace

TEST_CASE("motor efforts are transmitted efforts and the parts of their laws") {
  const ksl::model plain(arm()), whole(arm(), all_physics());
  ksl::data d(plain), e(whole);
  double tau[2], motor[2], parts[10];
  ksl::inverse_dynamics(plain, d, q, v, a, tau);
  ksl::inverse_dynamics(whole, e, q, v, a, motor);
  ksl::effort_parts(whole, e, q, v, a, parts);
  const double expected[10] = {
      tau[0],      tau[1], 0.3 * v[0], 0.1 * v[1],      friction(1.5, v[0], 0.01), friction(0.4, v[1], 0.5),
      0.12 * a[0], 0,      0,          7 * (q[1] - 0.2)};
  for (int i = 0; i < 10; ++i)
    CHECK(parts[i] == doctest::Approx(expected[i]).epsilon(1e-15));
  for (int k = 0; k < 2; ++k)
    CHECK(motor[k] ==
          doctest::Approx(parts[k] + parts[2 + k] + parts[4 + k] + parts[6 + k] + parts[8 + k]).epsilon(1e-15));
  ksl::effort_parts(plain, d, q, v, a, parts); // options that name nothing
  for (int i = 0; i < 10; ++i)
    CHECK(parts[i] == (i < 2 ? tau[i] : 0));
}

TEST_CASE("forward dynamics is the inverse, and the mass matrix has the rotors") {
  const ksl::model plain(arm()), whole(arm(), all_physics());
  ksl::data d(plain), e(whole);
  double tau[2], found[2], M[4], with_rotors[4];
  ksl::inverse_dynamics(whole, e, q, v, a, tau);
  ksl::forward_dynamics(whole, e, q, v, tau, found);
  CHECK(found[0] == doctest::Approx(a[0]).epsilon(1e-13));
  CHECK(found[1] == doctest::Approx(a[1]).epsilon(1e-13));
  ksl::forward_dynamics(whole, e, q, v, tau, tau); // in place
  CHECK(tau[0] == found[0]);
  CHECK(tau[1] == found[1]);
  ksl::mass_matrix(plain, d, q, M);
  ksl::mass_matrix(whole, e, q, with_rotors);
  CHECK(with_rotors[0] == doctest::Approx(M[0] + 0.12).epsilon(1e-15));
  for (int i = 1; i < 4; ++i)
    CHECK(with_rotors[i] == M[i]);
}

TEST_CASE("dynamics at a frame, and the kinetic energy, feel the rotors") {
  ksl::robot_description two_rotors = arm();
  two_rotors.joints[1].armature = 0.05;
  const ksl::model m(two_rotors, all_physics());
  ksl::data d(m);
  double M[4], W[4], J[12], inverse[36], by_q[2], by_v[2], potential[2];
  ksl::mass_matrix(m, d, q, M);
  ksl::energy_derivatives(m, d, q, v, by_q, by_v, potential);
  for (int i = 0; i < 2; ++i)
    CHECK(by_v[i] == doctest::Approx(M[2 * i] * v[0] + M[2 * i + 1] * v[1]).epsilon(1e-14));
  const int tip = 2;
  const double determinant = M[0] * M[3] - M[1] * M[2];
  W[0] = M[3] / determinant, W[3] = M[0] / determinant, W[1] = W[2] = -M[1] / determinant;
  ksl::jacobian(m, d, q, tip, {}, J);
  ksl::operational_space_inertia_inverse(m, d, q, 1, &tip, {}, inverse);
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c) {
      double sum = 0;
      for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j)
          sum += J[2 * r + i] * W[2 * i + j] * J[2 * c + j];
      CHECK(std::fabs(inverse[6 * r + c] - sum) < 1e-12);
    }
}

TEST_CASE("the second derivative of friction by speed is that of its law") {
  const ksl::model plain(arm()), whole(arm(), all_physics());
  ksl::data d(plain), e(whole);
  double qq[8], vv[8], qv[8], aq[8], without[8];
  ksl::inverse_dynamics_second_derivatives(plain, d, q, v, a, qq, without, qv, aq);
  ksl::inverse_dynamics_second_derivatives(whole, e, q, v, a, qq, vv, qv, aq);
  const double force[2] = {1.5, 0.4}, width[2] = {0.01, 0.5};
  for (int i = 0; i < 8; ++i) {
    const int k = i == 0 ? 0 : i == 7 ? 1 : -1; // element (k, k, k); friction has no others
    const double w2 = k < 0 ? 0 : width[k] * width[k];
    const double expected = k < 0 ? 0 : -3 * force[k] * w2 * v[k] / std::pow(v[k] * v[k] + w2, 2.5);
    CHECK(vv[i] - without[i] == doctest::Approx(expected).epsilon(1e-9));
  }
}

TEST_CASE("power of the motors is the rate of the energy and what damping and friction turn into heat") {
  using T = ksl::dual<1>;
  const ksl::model m(arm(), all_physics());
  ksl::data d(m);
  double tau[2], parts[10];
  ksl::inverse_dynamics(m, d, q, v, a, tau);
  ksl::effort_parts(m, d, q, v, a, parts);
  T position[2], speed[2], kinetic, potential; // along the motion
  for (int k = 0; k < 2; ++k) {
    position[k] = T(q[k]), position[k].derivative[0] = v[k];
    speed[k] = T(v[k]), speed[k].derivative[0] = a[k];
  }
  ksl::owned_workspace<ksl::energy_workspace<T>> w(m.view());
  ksl::energy<T>(m.view(), *w, position, speed, &kinetic, &potential);
  const double power = tau[0] * v[0] + tau[1] * v[1];
  const double heat = (parts[2] + parts[4]) * v[0] + (parts[3] + parts[5]) * v[1];
  // the parts are differentiable, too: along the motion, and by their laws
  ksl::owned_workspace<ksl::effort_parts_workspace<T>> x(m.view());
  const T rate[2] = {T(a[0]), T(a[1])};
  T rates[10];
  ksl::effort_parts<T>(m.view(), *x, position, speed, rate, {}, rates);
  CHECK(rates[2].derivative[0] == doctest::Approx(0.3 * a[0]).epsilon(1e-15));
  CHECK(rates[9].derivative[0] == doctest::Approx(7 * v[1]).epsilon(1e-15));

  CHECK(power - heat == doctest::Approx(kinetic.derivative[0] + potential.derivative[0]).epsilon(1e-13));
  CHECK(heat > 0);
}

TEST_CASE("friction is smooth, with a stated width; or exact, and zero at rest") {
  using T = ksl::dual<1>;
  for (double speed : {-3.0, -0.01, 0.0, 1e-5, 0.02, 40.0}) {
    T x(speed);
    x.derivative[0] = 1;
    CHECK(ksl::friction_slope(speed, 0.01) == doctest::Approx(ksl::friction_at(x, 0.01).derivative[0]).epsilon(1e-12));
  }
  CHECK(ksl::friction_at(0.01, 0.01) == doctest::Approx(std::sqrt(0.5)).epsilon(1e-15));
  ksl::model_options options = all_physics();
  options.physics->exact_friction = true;
  const ksl::model m(arm(), options);
  ksl::data d(m);
  const double speeds[2] = {1e-9, 0};
  double parts[10];
  ksl::effort_parts(m, d, q, speeds, a, parts);
  CHECK(parts[4] == 1.5);
  CHECK(parts[5] == 0);
  CHECK(m.exact_friction());
}

TEST_CASE("what is off is listed, and values that no joint can have are refused") {
  const ksl::model plain(arm());
  CHECK(plain.description().unused ==
        std::vector<std::string>{"joint shoulder, elbow: damping, friction (read, not applied)",
                                 "joint shoulder: armature, rotor (read, not applied)",
                                 "joint elbow: spring (read, not applied)"});
  CHECK(ksl::model(arm(), all_physics()).description().unused.empty());
  const auto refused = [](auto change, const char *sentence) {
    ksl::robot_description r = arm();
    change(r.joints[1]);
    CHECK_THROWS_WITH_AS(ksl::model{r}, sentence, ksl::description_error);
  };
  refused([](auto &j) { j.damping = -1; }, "joint \"elbow\": damping is -1; expected a number that is not negative");
  refused([](auto &j) { j.friction_width = 0; },
          "joint \"elbow\": friction_width is 0; expected the speed at which friction has 0.71 of its full strength");
  for (const ksl::joint_kind kind : {ksl::joint_kind::fixed, ksl::joint_kind::floating})
    for (double ksl::joint_description::*const each :
         {&ksl::joint_description::armature, &ksl::joint_description::rotor_inertia})
      refused([&](auto &j) { j.kind = kind, j.spring_stiffness = 0, j.*each = 0.1; },
              kind == ksl::joint_kind::fixed
                  ? "joint \"elbow\": a rotor on a fixed joint; leave out armature and rotor_inertia"
                  : "joint \"elbow\": a rotor on a floating joint; leave out armature and rotor_inertia");
  refused([](auto &j) { j.kind = ksl::joint_kind::spherical; },
          "joint \"elbow\": a spring on a spherical joint; only joints with one coordinate can have one");
}

TEST_CASE("what names the link of a rotor is refused where rotors go, and isn't moved to the link behind it") {
  ksl::model_options options;
  options.physics = ksl::physics_named({"rotor bodies"});
  ksl::robot_description with_rotor = ksl::model(arm(), options).description();
  const int rotor = static_cast<int>(with_rotor.links.size()) - 1, root = with_rotor.joints[0].parent;
  REQUIRE(with_rotor.links.back().name == "shoulder_rotor");
  with_rotor.links.emplace_back().name = "tool";
  ksl::joint_description &grip = with_rotor.joints.emplace_back();
  grip.name = "grip", grip.kind = ksl::joint_kind::fixed, grip.parent = 1, grip.child = rotor + 1;
  with_rotor.physics = {};
  CHECK_NOTHROW(ksl::model{with_rotor});
  const auto refused = [](const ksl::robot_description &r, const char *sentence) {
    CHECK_THROWS_WITH_AS(ksl::model{r}, doctest::Contains(sentence), ksl::description_error);
  };
  for (const bool is_first : {true, false}) {
    ksl::robot_description r = with_rotor;
    ksl::force_element_description &belt = r.force_elements.emplace_back();
    belt.name = "belt", belt.link1 = is_first ? rotor : root, belt.link2 = is_first ? root : rotor;
    belt.point2 = {1, 0, 0};
    refused(r, is_first ? "force element \"belt\": its first link \"shoulder_rotor\" is a rotor"
                        : "force element \"belt\": its second link \"shoulder_rotor\" is a rotor");
    r = with_rotor;
    ksl::loop_description &coupling = r.loops.emplace_back();
    coupling.name = "coupling", coupling.predecessor = is_first ? rotor : 2, coupling.successor = is_first ? 2 : rotor;
    refused(r, is_first ? "joint \"coupling\": its parent link \"shoulder_rotor\" is a rotor"
                        : "joint \"coupling\": its child link \"shoulder_rotor\" is a rotor");
  }
}

TEST_CASE("motor efforts may be written over any input") {
  const ksl::model m(arm(), all_physics());
  ksl::data d(m);
  double expected[2];
  ksl::inverse_dynamics(m, d, q, v, a, expected);
  const double *const inputs[3] = {q, v, a};
  for (int i = 0; i < 3; ++i) {
    double x[3][2];
    for (int j = 0; j < 3; ++j)
      std::copy(inputs[j], inputs[j] + 2, x[j]);
    ksl::inverse_dynamics(m, d, x[0], x[1], x[2], x[i]);
    CHECK(x[i][0] == expected[0]);
    CHECK(x[i][1] == expected[1]);
  }
  double found[2];
  ksl::forward_dynamics_by_mass_matrix(m, d, q, v, expected, found);
  CHECK(found[0] == doctest::Approx(a[0]).epsilon(1e-13));
  CHECK(found[1] == doctest::Approx(a[1]).epsilon(1e-13));
}

TEST_CASE("each part of the physics is on for itself, and has a name") {
  const char *const names[5] = {"damping", "friction", "armature", "rotor", "spring"};
  const double own[2][5] = {{0.3 * v[0], friction(1.5, v[0], 0.02), 0.02 * a[0], 0.1 * a[0], 0},
                            {0.1 * v[1], friction(0.4, v[1], 0.5), 0, 0, 7 * (q[1] - 0.2)}};
  const ksl::model plain(arm());
  ksl::data d(plain);
  double tau[2], motor[2];
  ksl::inverse_dynamics(plain, d, q, v, a, tau);
  for (std::size_t part = 0; part < 5; ++part) {
    ksl::model_options options;
    options.physics = ksl::physics_named({names[part]}, 0.02);
    CHECK(ksl::names_of(*options.physics) == std::vector<std::string>{names[part]});
    const ksl::model m(arm(), options);
    ksl::data e(m);
    ksl::inverse_dynamics(m, e, q, v, a, motor);
    for (int k = 0; k < 2; ++k)
      CHECK(motor[k] == doctest::Approx(tau[k] + own[k][part]).epsilon(1e-13));
  }
  using names_t = std::vector<std::string>;
  CHECK(ksl::names_of(ksl::physics_named({"all"})) ==
        names_t{"damping", "friction", "armature", "rotor", "spring", "force elements"});
  CHECK(ksl::names_of(ksl::physics_named({"exact friction", "rotor bodies"})) ==
        names_t{"exact friction", "rotor bodies"});
  CHECK_THROWS_WITH_AS(ksl::physics_named({"dampin"}), doctest::Contains("physics \"dampin\" is unknown"),
                       ksl::description_error);
  CHECK_THROWS_WITH_AS(ksl::physics_named({"friction", "exact friction"}), doctest::Contains("physics names both"),
                       ksl::description_error);
  CHECK_THROWS_WITH_AS(ksl::physics_named({"rotor bodies", "rotor"}), doctest::Contains("physics names both"),
                       ksl::description_error);
  for (double width : {0.0, -1.0, double(INFINITY), double(NAN)})
    CHECK_THROWS_WITH_AS(ksl::physics_named({}, width), doctest::Contains("friction_width is"), ksl::description_error);
}

namespace {

/// A body that turns about a point, and two arms on it whose axes are skew; motors with gears sit on the body, and on the first arm.
ksl::robot_description geared() {
  ksl::robot_description r;
  r.links = {robots::link("ground"), robots::link("body", robots::solid(3, {0.1, 0.2, -0.1}, 0.2, 0.3, 0.25)),
             robots::link("first", robots::solid(1.2, {0.3, 0, 0.1}, 0.02, 0.03, 0.01)),
             robots::link("second", robots::solid(0.7, {0, 0.2, 0.1}, 0.01, 0.02, 0.03))};
  r.joints = {robots::joint("ball", ksl::joint_kind::spherical, 0, 1, {0, 0, 0}, {0, 0, 1}),
              robots::joint("shoulder", ksl::joint_kind::revolute, 1, 2, {0.2, -0.1, 0.3}, {0.48, -0.6, 0.64}),
              robots::joint("elbow", ksl::joint_kind::continuous, 2, 3, {0.4, 0.1, 0}, {-0.6, 0.64, 0.48})};
  r.joints[1].lower = -2, r.joints[1].upper = 2;
  r.joints[1].rotor_inertia = 4e-4, r.joints[1].gear_ratio = 50;
  r.joints[2].rotor_inertia = 3e-4, r.joints[2].gear_ratio = -30;
  return r;
}

ksl::model_options with(std::vector<std::string> names) {
  ksl::model_options options;
  options.physics = ksl::physics_named(names);
  return options;
}

} // namespace

// The rotor's speed about its axis a is ω·a + n q̇, ω being the angular velocity of the link that carries it.  Its kinetic energy is half the
// inertia times its square, so that the mass matrix has I r rᵀ more, where r is the row of that speed: (ωᵀ a) of each coordinate, and n.
TEST_CASE("rotors as bodies add their share of the kinetic energy to the mass matrix") {
  const ksl::model plain(geared()), m(geared(), with({"rotor bodies"}));
  ksl::data d(plain), e(m);
  REQUIRE(m.nv() == 5);
  CHECK(m.find_link("shoulder_rotor") > 0);
  const double position[6] = {0.1, -0.5, 0.7, 0.5, 0.4, -0.8};
  double M[25], with_rotors[25], J[30];
  ksl::mass_matrix(plain, d, position, M);
  ksl::mass_matrix(m, e, position, with_rotors);
  const struct {
    const char *carrier;
    double axis[3], inertia, ratio;
    int coordinate;
  } rotors[2] = {{"body", {0.48, -0.6, 0.64}, 4e-4, 50, 3}, {"first", {-0.6, 0.64, 0.48}, 3e-4, -30, 4}};
  for (const auto &rotor : rotors) {
    ksl::jacobian(plain, d, position, plain.find_link(rotor.carrier), {}, J);
    double row[5];
    for (int k = 0; k < 5; ++k)
      row[k] = rotor.axis[0] * J[15 + k] + rotor.axis[1] * J[20 + k] + rotor.axis[2] * J[25 + k] +
               (k == rotor.coordinate ? rotor.ratio : 0);
    for (int i = 0; i < 25; ++i)
      M[i] += rotor.inertia * row[i / 5] * row[i % 5];
  }
  for (int i = 0; i < 25; ++i)
    CHECK(with_rotors[i] == doctest::Approx(M[i]).epsilon(1e-12));
}

TEST_CASE(
    "rotors as bodies: models of the same description with and without them, names that are taken, rotors that carry something") {
  const ksl::model m(geared(), with({"rotor bodies"}));
  const ksl::model again(m.description(), with({"rotor bodies"})), without(m.description(), with({"rotor"})),
      plain(geared(), with({"rotor"}));
  CHECK(again.links().size() == 6);
  CHECK(without.links().size() == 4);
  CHECK(without.joints().size() == plain.joints().size());
  const double position[6] = {0.1, -0.5, 0.7, 0.5, 0.4, -0.8};
  double M[25], expected[25];
  ksl::data d(without), e(plain);
  ksl::mass_matrix(without, d, position, M);
  ksl::mass_matrix(plain, e, position, expected);
  for (int i = 0; i < 25; ++i)
    CHECK(M[i] == expected[i]);
  ksl::robot_description taken = geared(); // by a link and by a joint
  taken.links[3].name = "shoulder_rotor", taken.joints[0].name = "elbow_rotor";
  const ksl::model renamed(taken, with({"rotor bodies"}));
  CHECK((renamed.find_link("shoulder_rotor_") > 0 && renamed.find_link("elbow_rotor_") > 0));
  ksl::robot_description loaded = m.description();
  for (const ksl::joint_description &j : loaded.joints)
    if (j.is_rotor) { // a link on each rotor
      loaded.links.push_back(robots::link("fan", robots::solid(0.1, {0, 0, 0}, 1e-4, 1e-4, 1e-4)));
      loaded.joints.push_back(robots::joint("shaft", ksl::joint_kind::fixed, j.child,
                                            static_cast<int>(loaded.links.size()) - 1, {0, 0, 0}, {0, 0, 1}));
      break;
    }
  CHECK_THROWS_WITH_AS((ksl::model{loaded, with({"rotor"})}),
                       doctest::Contains("joint \"shaft\": its parent link \"shoulder_rotor\" is a rotor"),
                       ksl::description_error);
}
