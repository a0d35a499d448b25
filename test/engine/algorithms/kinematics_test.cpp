// Velocities, accelerations and rates of Jacobians of frames: derivatives of poses by time, exact by dual numbers.
#include "states.hpp"
#include "robot_files.hpp"

#include <cmath>
#include <random>

namespace {

using namespace robots;
using namespace algorithms;
using ksl::acceleration_kind, ksl::expressed_in;
using matrices::product;

const ksl::model &robot() {
  static const ksl::model m = ksl::load(every_kind_file);
  return m;
}

/// One link, or one as seen from another.
request of(int link, const ksl::frame_options &how = {}) { return {{link}, how, {}}; }
request of(int link, int seen_from, const ksl::frame_options &how) { return {{link, seen_from}, how, {}}; }

template <class Algorithm> numbers<double> at(const state &s, const request &asked) {
  return results<Algorithm>(robot(), s, asked);
}
template <class Algorithm> numbers<double> rates(const state_over<first> &s, const request &asked) {
  return derivatives(results<Algorithm>(robot(), s, asked));
}
template <class Jacobian> numbers<double> times_velocity(const state &s, const request &asked) {
  return product(at<Jacobian>(s, asked), s.v, s.v.size());
}

/// Rᵀ ṗ, and ω of Rᵀ Ṙ = ω̃, of a row-major pose.
numbers<double> twist_of(const numbers<first> &R) {
  numbers<double> twist(6, 0.0);
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t r = 0; r < 3; ++r) {
      twist[k] += R[4 * r + k].value * R[4 * r + 3].derivative[0];
      twist[3 + k] += R[4 * r + (k + 2) % 3].value * R[4 * r + (k + 1) % 3].derivative[0];
    }
  return twist;
}
numbers<double> point_rate_of(const numbers<first> &R) {
  return {R[3].derivative[0], R[7].derivative[0], R[11].derivative[0]};
}

void check_close(const numbers<double> &found, const numbers<double> &expected) {
  CHECK(matrices::difference(found, expected) <= 1e-13);
}

const numbers<int> &all_links() {
  static const numbers<int> links = of_links(robot()).links;
  return links;
}

/// check(link, options) for all links, axes, points and orders.
template <class Check> void for_all(Check check) {
  for (int link : all_links())
    for (expressed_in axes : {expressed_in::frame, expressed_in::world})
      for (expressed_in point : {expressed_in::frame, expressed_in::world})
        for (bool angular_first : {false, true})
          for (double offset : {0.0, 0.3})
            check(link, ksl::frame_options{
                            axes, point, angular_first, acceleration_kind::spatial, {offset, -2 * offset, offset}});
}

} // namespace

TEST_CASE("kinematics: a frame's velocity is the derivative of its pose, and J v") {
  std::mt19937 random(1);
  const state s = random_state(robot(), random);
  for (int link : all_links())
    check_close(at<frame_velocities>(s, of(link)),
                twist_of(results<frame_poses>(robot(), in_time(robot(), s), of(link))));
  for_all([&](int link, const ksl::frame_options &how) {
    check_close(at<frame_velocities>(s, of(link, how)), times_velocity<jacobian>(s, of(link, how)));
  });
}

TEST_CASE("kinematics: rates of Jacobians and accelerations are derivatives by time") {
  std::mt19937 random(2);
  for (int turn = 0; turn < 3; ++turn) {
    const state s = random_state(robot(), random);
    const state_over<first> moving = in_time(robot(), s);
    for_all([&](int link, ksl::frame_options how) {
      check_close(at<jacobian_rate>(s, of(link, how)), rates<jacobian>(moving, of(link, how)));
      const numbers<double> rate = rates<frame_velocities>(moving, of(link, how));
      how.kind = acceleration_kind::rate;
      check_close(at<frame_accelerations>(s, of(link, how)), rate);
      // that is: in moving axes and about a moving point, or in fixed ones, the spatial acceleration;
      // in fixed axes about a moving point the classical one
      if (how.axes != how.at && how.axes == expressed_in::frame)
        return;
      how.kind = how.axes == how.at ? acceleration_kind::spatial : acceleration_kind::classical;
      check_close(at<frame_accelerations>(s, of(link, how)), rate);
    });
  }
}

TEST_CASE("kinematics: the kinds of acceleration differ by ω × v, and options change axes and origin") {
  std::mt19937 random(3);
  const state s = random_state(robot(), random);
  for_all([&](int link, ksl::frame_options how) {
    if (how.angular_first)
      return;
    const numbers<double> twist = at<frame_velocities>(s, of(link, how));
    numbers<double> spatial = at<frame_accelerations>(s, of(link, how));
    how.kind = acceleration_kind::classical;
    for (std::size_t k = 0; k < 3; ++k)
      spatial[k] += twist[3 + (k + 1) % 3] * twist[(k + 2) % 3] - twist[3 + (k + 2) % 3] * twist[(k + 1) % 3];
    check_close(at<frame_accelerations>(s, of(link, how)), spatial);
  });
}

TEST_CASE("kinematics: several frames at once have the bits of each alone") {
  std::mt19937 random(4);
  const state s = random_state(robot(), random);
  const numbers<int> links = {5, 0, 3, 5};
  for_all([&](int link, const ksl::frame_options &how) {
    if (link > 0) // once for each how
      return;
    const numbers<double> v = at<frame_velocities>(s, {links, how, {}}),
                          a = at<frame_accelerations>(s, {links, how, {}});
    for (std::size_t k = 0; k < links.size(); ++k) {
      CHECK(part(v, k, links.size()) == at<frame_velocities>(s, of(links[k], how)));
      CHECK(part(a, k, links.size()) == at<frame_accelerations>(s, of(links[k], how)));
    }
  });
}

TEST_CASE("kinematics: the motion of a frame as seen from another is the derivative of its pose in that, and J v") {
  std::mt19937 random(5);
  const state s = random_state(robot(), random);
  const state_over<first> moving = in_time(robot(), s);
  for (int seen_from : all_links()) {
    for (int link : all_links()) {
      ksl::frame_options how = {.offset = {0.2, 0, -0.1}};
      const numbers<first> pose = results<relative_pose>(robot(), moving, of(link, seen_from, how));
      check_close(at<relative_velocity>(s, of(link, seen_from, how)), twist_of(pose));
      how.axes = expressed_in::world, how.at = expressed_in::frame; // ṗ, in the axes of the other
      const numbers<double> seen = at<relative_velocity>(s, of(link, seen_from, how));
      check_close(part(seen, 0, 2), point_rate_of(pose));
    }
    for_all([&](int link, const ksl::frame_options &how) {
      const request asked = of(link, seen_from, how);
      const numbers<double> velocity = at<relative_velocity>(s, asked);
      check_close(times_velocity<relative_jacobian>(s, asked), velocity);
      if (seen_from == 0) // the ground, which is the world
        check_close(velocity, at<frame_velocities>(s, of(link, how)));
    });
  }
}

TEST_CASE("kinematics: points move as their positions and velocities change") {
  std::mt19937 random(6);
  const state s = random_state(robot(), random);
  const state_over<first> moving = in_time(robot(), s);
  const ksl::frame_options how = {.axes = expressed_in::world, .offset = {0.3, -0.2, 0.5}};
  for (int link : all_links()) {
    const numbers<first> pose = results<relative_pose>(robot(), moving, of(link, 0, how));
    check_close(at<point_velocity>(s, of(link, how)), point_rate_of(pose));
    check_close(at<point_acceleration>(s, of(link, how)), rates<point_velocity>(moving, of(link, how)));
  }
}
