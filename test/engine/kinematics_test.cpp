// Velocities, accelerations and rates of Jacobians of frames: derivatives of poses by time, exact by dual numbers.
#include "moved.hpp"
#include "robots.hpp"

#include "ksl/dual.hpp"
#include "ksl/engine/frame_motion.hpp"
#include "ksl/engine/owned_workspace.hpp"

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

struct motion {
  numbers<double> q, v, a;
};

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

numbers<double> rate_of(const motion &s, int link, const ksl::frame_options &how) {
  const ksl::owned_workspace<ksl::jacobian_rate_workspace<double>> w(robot().view());
  numbers<double> rate(6 * s.v.size());
  ksl::jacobian_rate<double>(robot().view(), *w, s.q.data(), s.v.data(), link, how, rate.data());
  return rate;
}

template <class T>
numbers<T> velocities(const numbers<T> &q, const numbers<T> &v, const numbers<int> &links, const ksl::frame_options &how) {
  const ksl::owned_workspace<ksl::frame_velocities_workspace<T>> w(robot().view());
  numbers<T> out(6 * links.size());
  ksl::frame_velocities<T>(robot().view(), *w, q.data(), v.data(), static_cast<int>(links.size()), links.data(), how, out.data());
  return out;
}

numbers<double> accelerations(const motion &s, const numbers<int> &links, const ksl::frame_options &how) {
  const ksl::owned_workspace<ksl::frame_accelerations_workspace<double>> w(robot().view());
  numbers<double> out(6 * links.size());
  ksl::frame_accelerations<double>(robot().view(), *w, s.q.data(), s.v.data(), s.a.data(), static_cast<int>(links.size()),
                                   links.data(), how, out.data());
  return out;
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
    const time_dual *const R = &poses[16 * l]; // row-major, with the position in the last column
    numbers<double> twist(6, 0.0);             // Rᵀ ṗ, and Rᵀ Ṙ = ω̃
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t r = 0; r < 3; ++r) {
        twist[k] += R[4 * r + k].value * R[4 * r + 3].derivative[0];
        twist[3 + k] += R[4 * r + (k + 2) % 3].value * R[4 * r + (k + 1) % 3].derivative[0];
      }
    check_close({found.begin() + 6 * static_cast<std::ptrdiff_t>(l), found.begin() + 6 * static_cast<std::ptrdiff_t>(l + 1)}, twist);
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
        check_close(rate_of(s, link, how), derivatives(jacobian_of(q, link, how)));
        // of the numbers of the velocity: in moving axes and about a moving point, or in fixed ones, the spatial acceleration;
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
