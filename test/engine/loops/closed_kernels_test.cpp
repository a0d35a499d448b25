// The kernels of closed mechanisms on dual numbers, with a variation of the state along the mechanism: against the derivatives that
// src/engine/loops/derivatives.cpp has in closed form, with which they share no step.
#include "moved.hpp"

#include "ksl/builder.hpp"
#include "ksl/dynamics.hpp"
#include "ksl/dual.hpp"
#include "ksl/engine/algorithms/loops/closed_reactions.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"
#include "ksl/loops.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

namespace {

using first = ksl::dual<1>;
template <class T> using numbers = std::vector<T>;

ksl::SE3<double> at(double x, double y, double z) { return {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {x, y, z}}; }

ksl::link_mass body(double mass) { return {mass, {0.1, 0.02, -0.03}, {0.03, 0, 0, 0, 0.04, 0, 0, 0, 0.05}}; }

ksl::joint_options about(double x, double y, double z) {
  ksl::joint_options options;
  options.axis = {x, y, z};
  return options;
}

/// Crank, rod and rocker in a plane, closed by a hinge, or in space, closed by another joint between the last two.  with_finger: another link
/// follows the rocker.
ksl::model linkage(ksl::joint_kind closing, bool with_finger = false) {
  using kind = ksl::joint_kind;
  const bool planar = closing == kind::revolute;
  ksl::builder b("linkage");
  b.add_link("ground");
  for (const char *name : {"crank", "cross", "rod", "rocker"})
    if (!planar || name != std::string("cross"))
      b.add_link(name, body(1.5));
  b.add_joint("A", kind::continuous, "ground", "crank", at(0, 0, 0), about(0, 0, 1));
  if (planar) {
    b.add_joint("B", kind::continuous, "crank", "rod", at(0.2, 0, 0), about(0, 0, 1));
    b.add_joint("E", kind::continuous, "ground", "rocker", at(0.5, 0.1, 0), about(0, 0, 1));
    ksl::loop_options axis;
    axis.axis = {0, 0, 1};
    b.add_loop("D", kind::revolute, "rod", "rocker", at(0.4, 0, 0), at(0.3, 0, 0), axis);
  } else {
    b.add_joint("B", kind::continuous, "crank", "cross", at(0, 0.1, 0), about(0, 1, 0));
    b.add_joint("C", kind::prismatic, "cross", "rod", at(0, 0, 0), about(0.6, 0, 0.8));
    b.add_joint("E", kind::spherical, "ground", "rocker", at(0.1, 0, 0.4));
    ksl::loop_options axis;
    axis.axis = {0, 0.6, 0.8};
    if (closing == kind::universal)
      axis.axis2 = {0.6, 0.8, 0};
    if (closing == kind::helical)
      axis.pitch = 0.2;
    b.add_loop("D", closing, "rod", "rocker", at(0.1, 0.2, 0.4), at(0, 0.3, 0), axis);
  }
  if (with_finger) {
    ksl::joint_options follows = about(0, 0, 1);
    follows.mimic = {"E", -0.5, 0.1, {}};
    b.add_link("finger", body(1));
    b.add_joint("F", kind::continuous, "ground", "finger", at(0, 0.3, 0), follows);
  }
  const bool one = planar || closing == kind::helical;
  b.set_drives(one ? std::vector<std::string>{"A"} : std::vector<std::string>{"A", "B"});
  return b.build();
}

/// A closed state, and a wrench on the first link that moves.
struct state {
  numbers<double> q, v, a, tau;
  numbers<double> push = {3, -2, 5, 0.4, 0.7, -0.2};
  int link = 1;

  state(const ksl::model &m, ksl::data &d) {
    const std::size_t nq = static_cast<std::size_t>(m.nq()), nv = static_cast<std::size_t>(m.nv());
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    numbers<double> start(nq), speed(nv), rate(nv);
    ksl::neutral(m, start.data());
    for (const ksl::joint_row &joint : m.joints())
      if (joint.v_index >= 0 && ksl::row_of(joint.kind).nv == 1)
        start[static_cast<std::size_t>(joint.q_index)] = 0.2 * normal(random);
    q.resize(nq), v.resize(nv), a.resize(nv), tau.resize(nv);
    numbers<unsigned char> none(nv, 0);
    double error = 0;
    REQUIRE(ksl::close(m, d, start.data(), none.data(), {}, q.data(), &error) == ksl::closing::closed);
    for (std::size_t i = 0; i < nv; ++i)
      speed[i] = normal(random), rate[i] = normal(random), tau[i] = normal(random);
    ksl::consistent_velocity(m, d, q.data(), speed.data(), none.data(), v.data());
    ksl::consistent_acceleration(m, d, q.data(), v.data(), rate.data(), none.data(), a.data());
  }
};

numbers<first> along(const numbers<double> &x, const double *rate) {
  numbers<first> out(x.begin(), x.end());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i].derivative[0] = rate[i];
  return out;
}

numbers<first> position_along(const ksl::model &m, const numbers<double> &q, const double *rate) {
  return robots::moved(m, q, along(numbers<double>(static_cast<std::size_t>(m.nv()), 0.0), rate));
}

/// All joints that move, and those of loops.
numbers<int> all_joints(const ksl::model &m) {
  numbers<int> links;
  for (const ksl::joint_row &joint : m.joints())
    if (joint.v_index >= 0)
      links.push_back(joint.link);
  for (std::size_t l = 0; l < m.loops().size(); ++l)
    links.push_back(static_cast<int>(m.links().size() + l));
  return links;
}

void check_near(double x, double expected) {
  INFO(x, " ", expected);
  CHECK(std::fabs(x - expected) <= 1e-9 * std::max(1.0, std::fabs(expected)));
}

} // namespace

TEST_CASE("closed mechanisms on dual numbers: efforts, wrenches of loops and accelerations along the mechanism") {
  using kind = ksl::joint_kind;
  for (const kind closing : {kind::revolute, kind::cylindrical, kind::helical, kind::universal}) {
    const bool planar = closing == kind::revolute;
    const ksl::model m = linkage(closing);
    ksl::data d(m);
    const state s(m, d);
    const std::size_t nv = static_cast<std::size_t>(m.nv());
    const ksl::external_wrenches<double> push = {1, &s.link, s.push.data()};
    const numbers<first> dual_push(s.push.begin(), s.push.end());
    const ksl::external_wrenches<first> pushed = {1, &s.link, dual_push.data()};
    numbers<int> free(nv);
    const std::size_t f = static_cast<std::size_t>(ksl::independent(m, d, s.q.data(), free.data()));
    REQUIRE(f == (planar || closing == kind::helical ? 1u : 2u));
    REQUIRE(m.view().loops);
    REQUIRE(m.view().loops->drives_are_independent); // for the universal joint not at the neutral position
    numbers<double> by[3], motions(9 * f * nv), on_links(36 * f), at_joints(18 * f), wrenches(12);
    for (numbers<double> &matrix : by)
      matrix.resize(nv * nv);
    ksl::closed_inverse_dynamics_derivatives(m, d, s.q.data(), s.v.data(), s.a.data(), push, by[0].data(), by[1].data(),
                                             by[2].data());
    ksl::closed_reaction_variations(m, d, s.q.data(), s.v.data(), s.a.data(), push, motions.data(), on_links.data(),
                                    at_joints.data(), wrenches.data());
    const ksl::owned_workspace<ksl::closed_inverse_dynamics_workspace<first>> inverse(m.view());
    const ksl::owned_workspace<ksl::closed_inverse_dynamics_with_reactions_workspace<first>> with_reactions(m.view());
    const numbers<int> links = all_joints(m);
    ksl::reaction_request all;
    all.n = static_cast<int>(links.size()), all.link = links.data();
    const ksl::owned_workspace<ksl::closed_forward_dynamics_workspace<first>> forward(m.view());
    for (std::size_t what = 0; what < 3; ++what)
      for (std::size_t j = 0; j < f; ++j) {
        const double *const dq = &motions[3 * nv * (what * f + j)], *const dv = dq + nv, *const da = dv + nv;
        const numbers<first> q = position_along(m, s.q, dq), v = along(s.v, dv), a = along(s.a, da);
        numbers<first> tau(nv);
        ksl::closed_inverse_dynamics<first>(m.view(), *inverse, q.data(), v.data(), a.data(), pushed, tau.data());
        for (std::size_t i = 0; i < nv; ++i)
          check_near(tau[i].derivative[0], by[what][i * f + j]);
        numbers<first> again(nv), reactions(6 * links.size());
        ksl::inverse_dynamics_with_reactions<first>(m.view(), *with_reactions, q.data(), v.data(), a.data(), pushed,
                                                    again.data(), all, reactions.data());
        for (std::size_t c = 0; c < 6 && !planar; ++c) // of the planar one some equations are redundant
          check_near(reactions[reactions.size() - 6 + c].derivative[0], at_joints[6 * (what * f + j) + c]);
        CHECK(again[0].derivative[0] == tau[0].derivative[0]);
        // the same in double precision
        numbers<double> expected(6 * links.size()), efforts(nv);
        ksl::inverse_dynamics_with_reactions(m, d, s.q.data(), s.v.data(), s.a.data(), efforts.data(), all,
                                             expected.data(), push);
        for (std::size_t c = 0; c < 6 * links.size(); ++c)
          check_near(reactions[c].value, expected[c]);
      }
    numbers<double> of_q(nv * nv), of_v(nv * nv), of_tau(nv * nv), acceleration(nv);
    ksl::closed_forward_dynamics_derivatives(m, d, s.q.data(), s.v.data(), s.tau.data(), push, of_q.data(), of_v.data(),
                                             of_tau.data());
    const numbers<first> tau(s.tau.begin(), s.tau.end());
    for (std::size_t what = 0; what < 2; ++what)
      for (std::size_t j = 0; j < f; ++j) {
        const double *const dq = &motions[3 * nv * (what * f + j)];
        const numbers<first> q = position_along(m, s.q, dq), v = along(s.v, dq + nv);
        numbers<first> a(nv);
        ksl::closed_forward_dynamics<first>(m.view(), *forward, q.data(), v.data(), tau.data(), pushed, a.data());
        for (std::size_t i = 0; i < nv; ++i)
          check_near(a[i].derivative[0], (what == 0 ? of_q : of_v)[i * f + j]);
      }
  }
}

TEST_CASE("closed mechanisms: the plan of a parallelogram that lies flat at zero has the rank that it has elsewhere") {
  using kind = ksl::joint_kind;
  ksl::builder b("parallelogram");
  b.add_link("ground");
  for (const char *name : {"left", "right", "beam"})
    b.add_link(name, body(1));
  b.add_joint("A", kind::continuous, "ground", "left", at(0, 0, 0), about(0, 0, 1));
  b.add_joint("B", kind::continuous, "left", "beam", at(0.2, 0, 0), about(0, 0, 1));
  b.add_joint("D", kind::continuous, "ground", "right", at(0.5, 0, 0), about(0, 0, 1));
  ksl::loop_options axis;
  axis.axis = {0, 0, 1};
  b.add_loop("C", kind::revolute, "beam", "right", at(0.5, 0, 0), at(0.2, 0, 0), axis);
  b.set_drives({"A"});
  const ksl::model m = b.build();
  REQUIRE(m.view().loops);
  CHECK(m.view().loops->pivots == 2);
  CHECK(m.view().loops->freedoms == 1);
}

TEST_CASE("closed mechanisms: the plan of a Stewart platform eliminates its legs first") {
  using kind = ksl::joint_kind;
  ksl::builder b("Stewart platform");
  b.add_link("ground");
  b.add_link("platform", body(20));
  b.add_joint("free", kind::floating, "ground", "platform", at(0, 0, 0));
  std::vector<std::string> drives;
  for (int k = 0; k < 6; ++k) {
    const std::string n = std::to_string(k);
    const double turn = 2.0943951023931953 * (k / 2), below = turn + (k % 2 ? 0.26 : -0.26),
                 above = turn + (k % 2 ? 0.79 : -0.79);
    b.add_link("cylinder" + n, body(2)), b.add_link("rod" + n, body(1));
    ksl::joint_options crossed = about(1, 0, 0);
    crossed.axis2 = {0, 1, 0};
    b.add_joint("U" + n, kind::universal, "ground", "cylinder" + n, at(0.8 * std::cos(below), 0.8 * std::sin(below), 0),
                crossed);
    b.add_joint("P" + n, kind::prismatic, "cylinder" + n, "rod" + n, at(0, 0, 1), about(0, 0, 1));
    b.add_loop("S" + n, kind::spherical, "rod" + n, "platform", at(0, 0, 0),
               at(0.5 * std::cos(above), 0.5 * std::sin(above), 0));
    drives.push_back("P" + n);
  }
  b.set_drives(drives);
  const ksl::model m = b.build();
  REQUIRE(m.view().loops);
  const ksl::loop_view<double> &loops = *m.view().loops;
  CHECK(loops.pivots == 18);
  CHECK(loops.drives_are_independent);
  int eliminated = 0;
  for (int k = 0; k < loops.pivots; ++k)
    eliminated += (loops.pivot[k].rows_end - loops.pivot[k].rows_begin) *
                  (loops.pivot[k].columns_end - loops.pivot[k].columns_begin);
  // Both angles of each leg, from the two and the one equation of it that are left, with the others' columns: 2·8 + 1·7.  Then six equations, of
  // which k have been pivots: 6 − 1 − k rows with as many of the platform's columns, and 1 + k lengths.
  CHECK(eliminated <= 6 * (2 * 8 + 1 * 7) + 6 * (5 + 4 + 3 + 2 + 1));
}

TEST_CASE("closed mechanisms: followers have equations of their own in the plan, and no freedom") {
  const ksl::model m = linkage(ksl::joint_kind::revolute, true);
  REQUIRE(m.view().loops);
  const ksl::loop_view<double> &loops = *m.view().loops;
  CHECK(loops.rows == 5 + 1);
  CHECK(loops.pivots == 2 + 1);
  CHECK(loops.freedoms == 1);
  CHECK(loops.drives_are_independent);
}
