// Velocities, accelerations and rates of Jacobians of frames: derivatives of poses by time, exact by dual numbers.
#include "moved.hpp"
#include "robots.hpp"

#include "ksl/dual.hpp"
#include "ksl/engine/algorithms/kinematics/frame_motion.hpp"
#include "ksl/engine/algorithms/kinematics/relative_motion.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

namespace {

using time_dual = ksl::dual<1>;
template <class T> using numbers = std::vector<T>;
using ksl::acceleration_kind, ksl::expressed_in;

const ksl::model &robot() {
  static const ksl::model m = ksl::load(KSL_EVERY_KIND);
  return m;
}

struct motion { numbers<double> q, v, a; };

motion random_motion(std::mt19937 &random) {
  const auto some = [&](int n) {
    std::normal_distribution<double> normal;
    numbers<double> x(static_cast<std::size_t>(n));
    for (double &y : x)
      y = normal(random);
    return x;
  };
  motion s = {some(robot().nq()), some(robot().nv()), some(robot().nv())};
  robots::normalize_quaternions(robot(), s.q.data());
  return s;
}

/// x with its rate.
numbers<time_dual> moving(const numbers<double> &x, const numbers<double> &rate) {
  numbers<time_dual> out(x.begin(), x.end());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i].derivative[0] = rate[i];
  return out;
}

template <class T> numbers<T> jacobian_of(const numbers<T> &q, int link, const ksl::frame_options &how) {
  const ksl::owned_workspace<ksl::jacobian_workspace<T>> w(robot().view());
  numbers<T> J(6 * static_cast<std::size_t>(robot().nv()));
  ksl::jacobian<T>(robot().view(), *w, q.data(), link, how, J.data());
  return J;
}

template <class T> numbers<T> rate_of(const numbers<T> &q, const numbers<T> &v, int link,
                                      const ksl::frame_options &how) {
  const ksl::owned_workspace<ksl::jacobian_rate_workspace<T>> w(robot().view());
  numbers<T> rate(6 * v.size());
  ksl::jacobian_rate<T>(robot().view(), *w, q.data(), v.data(), link, how, rate.data());
  return rate;
}

template <class T>
numbers<T> velocities(const numbers<T> &q, const numbers<T> &v, const numbers<int> &links,
                      const ksl::frame_options &how) {
  const ksl::owned_workspace<ksl::frame_velocities_workspace<T>> w(robot().view());
  numbers<T> out(6 * links.size());
  ksl::frame_velocities<T>(robot().view(), *w, q.data(), v.data(), static_cast<int>(links.size()), links.data(), how,
                           out.data());
  return out;
}

template <class T> numbers<T> accelerations(const numbers<T> &q, const numbers<T> &v, const numbers<T> &a,
                                            const numbers<int> &links, const ksl::frame_options &how) {
  const ksl::owned_workspace<ksl::frame_accelerations_workspace<T>> w(robot().view());
  numbers<T> out(6 * links.size());
  ksl::frame_accelerations<T>(robot().view(), *w, q.data(), v.data(), a.data(), static_cast<int>(links.size()),
                              links.data(), how, out.data());
  return out;
}
numbers<double> accelerations(const motion &s, const numbers<int> &links, const ksl::frame_options &how) {
  return accelerations(s.q, s.v, s.a, links, how);
}

template <class T> struct relative_motion { numbers<T> pose, velocity, J; };
template <class T>
relative_motion<T> relative_motion_of(const numbers<T> &q, const numbers<T> &v, int link, int seen_from,
                                      const ksl::frame_options &how) {
  const ksl::owned_workspace<ksl::relative_pose_workspace<T>> w(robot().view());
  relative_motion<T> m = {numbers<T>(16), numbers<T>(6), numbers<T>(6 * v.size())};
  ksl::relative_pose<T>(robot().view(), *w, q.data(), link, seen_from, how, m.pose.data());
  ksl::relative_velocity<T>(robot().view(), *w, q.data(), v.data(), link, seen_from, how, m.velocity.data());
  ksl::relative_jacobian<T>(robot().view(), *w, q.data(), link, seen_from, how, m.J.data());
  return m;
}

template <class T> numbers<T> point_velocity_of(const numbers<T> &q, const numbers<T> &v, int link,
                                                const ksl::frame_options &how) {
  const ksl::owned_workspace<ksl::frame_velocities_workspace<T>> w(robot().view());
  numbers<T> out(3);
  ksl::point_velocity<T>(robot().view(), *w, q.data(), v.data(), link, how, out.data());
  return out;
}
template <class T> numbers<T> point_acceleration_of(const numbers<T> &q, const numbers<T> &v, const numbers<T> &a,
                                                    int link, const ksl::frame_options &how) {
  const ksl::owned_workspace<ksl::frame_accelerations_workspace<T>> w(robot().view());
  numbers<T> out(3);
  ksl::point_acceleration<T>(robot().view(), *w, q.data(), v.data(), a.data(), link, how, out.data());
  return out;
}

/// Rᵀ ṗ, and ω of Rᵀ Ṙ = ω̃, of a row-major pose.
numbers<double> twist_of(const time_dual *R) {
  numbers<double> twist(6, 0.0);
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t r = 0; r < 3; ++r) {
      twist[k] += R[4 * r + k].value * R[4 * r + 3].derivative[0];
      twist[3 + k] += R[4 * r + (k + 2) % 3].value * R[4 * r + (k + 1) % 3].derivative[0];
    }
  return twist;
}

void check_close(const numbers<double> &found, const numbers<double> &expected) {
  REQUIRE(found.size() == expected.size());
  double scale = 1;
  for (double x : expected)
    scale = std::fmax(scale, std::fabs(x));
  for (std::size_t i = 0; i < found.size(); ++i) {
    CAPTURE(i);
    CHECK(std::fabs(found[i] - expected[i]) <= 1e-13 * scale);
  }
}

numbers<double> derivatives(const numbers<time_dual> &x) {
  numbers<double> out;
  for (const time_dual &y : x)
    out.push_back(y.derivative[0]);
  return out;
}

numbers<int> all_links() {
  numbers<int> links;
  for (int l = 0; l < robot().view().links; ++l)
    links.push_back(l);
  return links;
}

template <class Check> void for_all_options(Check check) {
  for (expressed_in axes : {expressed_in::frame, expressed_in::world})
    for (expressed_in at : {expressed_in::frame, expressed_in::world})
      for (bool angular_first : {false, true})
        for (double offset : {0.0, 0.3})
          check(ksl::frame_options{axes, at, angular_first, acceleration_kind::spatial, {offset, -2 * offset, offset}});
}

/// rows × v
numbers<double> product(const numbers<double> &J, const numbers<double> &v) {
  numbers<double> out;
  for (std::size_t r = 0; r < 6; ++r) {
    double sum = 0;
    for (std::size_t i = 0; i < v.size(); ++i)
      sum += J[r * v.size() + i] * v[i];
    out.push_back(sum);
  }
  return out;
}

} // namespace

TEST_CASE("kinematics: a frame's velocity is the derivative of its pose, and J v") {
  std::mt19937 random(1);
  const motion s = random_motion(random);
  const numbers<double> still(s.v.size(), 0.0);
  const numbers<time_dual> q = robots::moved(robot(), s.q, moving(still, s.v));
  const ksl::owned_workspace<ksl::forward_kinematics_workspace<time_dual>> w(robot().view());
  const numbers<int> links = all_links();
  numbers<time_dual> poses(16 * links.size());
  ksl::frame_poses<time_dual>(robot().view(), *w, q.data(), static_cast<int>(links.size()), links.data(), poses.data());
  const numbers<double> found = velocities(s.q, s.v, links, {});
  for (std::size_t l = 0; l < links.size(); ++l) {
    check_close(
        {found.begin() + 6 * static_cast<std::ptrdiff_t>(l), found.begin() + 6 * static_cast<std::ptrdiff_t>(l + 1)},
        twist_of(&poses[16 * l]));
  }
  for_all_options([&](const ksl::frame_options &how) {
    for (int link : links)
      check_close(velocities(s.q, s.v, {link}, how), product(jacobian_of(s.q, link, how), s.v));
  });
}

TEST_CASE("kinematics: rates of Jacobians and accelerations are derivatives by time") {
  std::mt19937 random(2);
  for (int turn = 0; turn < 3; ++turn) {
    const motion s = random_motion(random);
    const numbers<double> still(s.v.size(), 0.0);
    const numbers<time_dual> q = robots::moved(robot(), s.q, moving(still, s.v)), v = moving(s.v, s.a);
    for_all_options([&](ksl::frame_options how) {
      for (int link : all_links()) {
        check_close(rate_of(s.q, s.v, link, how), derivatives(jacobian_of(q, link, how)));
        how.kind = acceleration_kind::rate;
        check_close(accelerations(s, {link}, how), derivatives(velocities(q, v, {link}, how)));
        // that is: in moving axes and about a moving point, or in fixed ones, the spatial acceleration;
        // in fixed axes about a moving point the classical one
        if (how.axes != how.at && how.axes == expressed_in::frame)
          continue;
        how.kind = how.axes == how.at ? acceleration_kind::spatial : acceleration_kind::classical;
        check_close(accelerations(s, {link}, how), derivatives(velocities(q, v, {link}, how)));
      }
    });
  }
}

TEST_CASE("kinematics: the kinds of acceleration differ by ω × v, and options change axes and origin") {
  std::mt19937 random(3);
  const motion s = random_motion(random);
  for_all_options([&](ksl::frame_options how) {
    if (how.angular_first)
      return;
    for (int link : all_links()) {
      const numbers<double> twist = velocities(s.q, s.v, {link}, how);
      numbers<double> spatial = accelerations(s, {link}, how);
      how.kind = acceleration_kind::classical;
      for (std::size_t k = 0; k < 3; ++k)
        spatial[k] += twist[3 + (k + 1) % 3] * twist[(k + 2) % 3] - twist[3 + (k + 2) % 3] * twist[(k + 1) % 3];
      check_close(accelerations(s, {link}, how), spatial);
      how.kind = acceleration_kind::spatial;
    }
  });
}

TEST_CASE("kinematics: several frames at once have the bits of each alone") {
  std::mt19937 random(4);
  const motion s = random_motion(random);
  const numbers<int> links = {5, 0, 3, 5};
  for_all_options([&](const ksl::frame_options &how) {
    const numbers<double> v = velocities(s.q, s.v, links, how), a = accelerations(s, links, how);
    for (std::size_t k = 0; k < links.size(); ++k) {
      const numbers<double> one_v = velocities(s.q, s.v, {links[k]}, how), one_a = accelerations(s, {links[k]}, how);
      for (std::size_t c = 0; c < 6; ++c) {
        CHECK(v[6 * k + c] == one_v[c]);
        CHECK(a[6 * k + c] == one_a[c]);
      }
    }
  });
}

TEST_CASE("kinematics: the motion of a frame as seen from another is the derivative of its pose in that, and J v") {
  std::mt19937 random(5);
  const motion s = random_motion(random);
  const numbers<time_dual> q = robots::moved(robot(), s.q, moving(numbers<double>(s.v.size(), 0.0), s.v)),
                           v = moving(s.v, s.a);
  for (int link : all_links())
    for (int seen_from : all_links()) {
      ksl::frame_options how;
      how.offset[0] = 0.2, how.offset[2] = -0.1;
      const relative_motion<time_dual> m = relative_motion_of(q, v, link, seen_from, how);
      const numbers<double> twist = twist_of(m.pose.data());
      check_close(relative_motion_of(s.q, s.v, link, seen_from, how).velocity, twist);
      for_all_options([&](const ksl::frame_options &options) {
        const relative_motion<double> found = relative_motion_of(s.q, s.v, link, seen_from, options);
        check_close(product(found.J, s.v), found.velocity);
      });
      how.axes = expressed_in::world, how.at = expressed_in::frame; // ṗ, in the axes of the other
      const numbers<double> seen = relative_motion_of(s.q, s.v, link, seen_from, how).velocity;
      check_close({seen[0], seen[1], seen[2]},
                  {m.pose[3].derivative[0], m.pose[7].derivative[0], m.pose[11].derivative[0]});
    }
  for_all_options([&](const ksl::frame_options &how) { // seen from the ground, which is the world
    for (int link : all_links())
      check_close(relative_motion_of(s.q, s.v, link, 0, how).velocity, velocities(s.q, s.v, {link}, how));
  });
}

TEST_CASE("kinematics: points move as their positions and velocities change") {
  std::mt19937 random(6);
  const motion s = random_motion(random);
  const numbers<time_dual> q = robots::moved(robot(), s.q, moving(numbers<double>(s.v.size(), 0.0), s.v)),
                           v = moving(s.v, s.a);
  ksl::frame_options how;
  how.axes = expressed_in::world, how.offset[0] = 0.3, how.offset[1] = -0.2, how.offset[2] = 0.5;
  for (int link : all_links()) {
    const relative_motion<time_dual> m = relative_motion_of(q, v, link, 0, how);
    check_close(point_velocity_of(s.q, s.v, link, how),
                {m.pose[3].derivative[0], m.pose[7].derivative[0], m.pose[11].derivative[0]});
    check_close(point_acceleration_of(s.q, s.v, s.a, link, how), derivatives(point_velocity_of(q, v, link, how)));
  }
}
