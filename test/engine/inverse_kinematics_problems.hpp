// Problems of inverse kinematics for tests: robots, targets, what the library finds, and the errors that are left, by other algorithms.
#pragma once

#include "ksl/inverse_kinematics.hpp"
#include "robots.hpp"

#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace inverse_kinematics_problems {

using numbers = std::vector<double>;

struct problem {
  std::vector<ksl::wanted_frame> frames;
  std::vector<numbers> start, goal; ///< rows of nq; targets are the poses at the goals
  bool limits = false;
  std::vector<std::size_t> free = {}; ///< coordinates that no limit holds: those of a planar joint before its angle
  std::vector<std::size_t> turning =
      {}; ///< coordinates with a whole turn between their limits, which go on at the other one
};

struct solution {
  std::vector<numbers> q;
  numbers error; ///< (n, 2)
  std::vector<int> end, iterations, starts;
};

/// Row-major 4 × 4.
inline std::array<double, 16> pose(const ksl::model &m, const numbers &q, int link) {
  ksl::data d(m);
  const ksl::SE3<double> D = ksl::frame_pose(m, d, q.data(), link);
  const ksl::mat3x3<double> &R = D.R;
  return {R.m00, R.m01, R.m02, D.t.x, R.m10, R.m11, R.m12, D.t.y, R.m20, R.m21, R.m22, D.t.z, 0, 0, 0, 1};
}

inline numbers targets_of(const ksl::model &m, const problem &p) {
  numbers poses;
  for (const numbers &goal : p.goal)
    for (const ksl::wanted_frame &f : p.frames) {
      const std::array<double, 16> target = pose(m, goal, f.link);
      poses.insert(poses.end(), target.begin(), target.end());
    }
  return poses;
}

inline solution solve(const ksl::model &m, const problem &p, const numbers &targets,
                      ksl::inverse_kinematics_options options) {
  const std::size_t n = targets.size() / 16 / p.frames.size(), nq = static_cast<std::size_t>(m.nq());
  numbers start, q(n * nq, NAN);
  for (const numbers &row : p.start)
    start.insert(start.end(), row.begin(), row.end());
  solution s;
  s.error.assign(2 * n, NAN), s.end.assign(n, -1), s.iterations.assign(n, -1), s.starts.assign(n, -1);
  options.frames_n = static_cast<int>(p.frames.size()), options.frames = p.frames.data(), options.limits = p.limits;
  ksl::inverse_kinematics_batch<double> batch;
  batch.n = n, batch.target = {targets.data(), static_cast<std::ptrdiff_t>(16 * p.frames.size())},
  batch.q = {q.data(), m.nq()};
  if (!start.empty())
    batch.start = {start.data(), m.nq()};
  batch.error = {s.error.data(), 2}, batch.end = s.end.data(), batch.iterations = s.iterations.data(),
  batch.starts = s.starts.data();
  ksl::inverse_kinematics(m, options, batch, 1);
  for (std::size_t k = 0; k < n; ++k)
    s.q.emplace_back(q.begin() + static_cast<std::ptrdiff_t>(k * nq),
                     q.begin() + static_cast<std::ptrdiff_t>((k + 1) * nq));
  return s;
}

inline ksl::inverse_kinematics_options limited_to(int iterations, int starts = 1) {
  ksl::inverse_kinematics_options o;
  o.iterations = iterations, o.starts = starts;
  return o;
}

/// The length of the chain that carries a link, from joint to joint.
inline double length_to(const ksl::model &m, int link) {
  double length = 0;
  ksl::vec3<double> t = {0, 0, 0};
  for (int j = m.joint_above(link); j >= 0 && m.joints()[static_cast<std::size_t>(j)].description >= 0;
       j = m.joint_above(link)) {
    const ksl::joint_row &row = m.joints()[static_cast<std::size_t>(j)];
    const ksl::SE3<double> &at = m.description().joints[static_cast<std::size_t>(row.description)].placement;
    const ksl::mat3x3<double> &R = at.R;
    if (row.kind == ksl::joint_kind::fixed) {
      t = {R.m00 * t.x + R.m01 * t.y + R.m02 * t.z + at.t.x, R.m10 * t.x + R.m11 * t.y + R.m12 * t.z + at.t.y,
           R.m20 * t.x + R.m21 * t.y + R.m22 * t.z + at.t.z};
    } else {
      length += std::hypot(t.x, t.y, t.z);
      t = at.t;
    }
    link = row.parent_link;
  }
  return length + std::hypot(t.x, t.y, t.z);
}

/// 2 sin(θ/2) times the axis of a rotation by less than half a turn.
inline std::array<double, 3> turn_of(const ksl::mat3x3<double> &R) {
  const std::array<double, 3> sines = {R.m21 - R.m12, R.m02 - R.m20, R.m10 - R.m01}; // 2 sin θ times the axis
  const double sine = std::hypot(sines[0], sines[1], sines[2]) / 2,
               angle = std::atan2(sine, (R.m00 + R.m11 + R.m22 - 1) / 2);
  const double scale = sine > 0 ? std::sin(angle / 2) / sine : 0;
  return {scale * sines[0], scale * sines[1], scale * sines[2]};
}

/// How far frames are from their targets, and how joints change that.
struct errors {
  numbers J, e; ///< weighted: rows of 6 for each frame, with a column for each coordinate; and the errors
  double position = 0, orientation = 0, cost = 0;
};

inline errors errors_at(const ksl::model &m, const problem &p, const numbers &q, const double *target) {
  ksl::data d(m);
  errors out;
  for (const ksl::wanted_frame &f : p.frames) {
    const ksl::SE3<double> at = ksl::frame_pose(m, d, q.data(), f.link);
    ksl::SE3<double> wanted = {{target[0], target[4], target[8], target[1], target[5], target[9], target[2], target[6],
                                target[10]},
                               {target[3], target[7], target[11]}},
                     D;
    target += 16;
    ksl::algebra<double>::product_dinvd(&at, &wanted, &D);
    const double weight[2] = {f.position_weight * 20 / length_to(m, f.link), f.orientation_weight};
    const std::array<double, 3> turn = turn_of(D.R);
    const double e[6] = {D.t.x, D.t.y, D.t.z, turn[0], turn[1], turn[2]};
    numbers J(static_cast<std::size_t>(6 * m.nv()));
    ksl::jacobian(m, d, q.data(), f.link, {}, J.data());
    for (std::size_t i = 0; i < J.size(); ++i)
      out.J.push_back(weight[i >= J.size() / 2] * J[i]);
    for (int i = 0; i < 6; ++i)
      out.e.push_back(weight[i / 3] * e[i]), out.cost += out.e.back() * out.e.back();
    if (f.position_weight > 0)
      out.position = std::fmax(out.position, std::hypot(e[0], e[1], e[2]));
    if (f.orientation_weight > 0)
      out.orientation =
          std::fmax(out.orientation, 2 * std::asin(std::fmin(std::hypot(e[3], e[4], e[5]) / 2, 1))); // e: 2 sin(θ/2)
  }
  return out;
}

/// Positions that differ from state to state, all joints moved.
inline std::vector<numbers> positions(const ksl::model &m, int n, double wide, double phase) {
  std::vector<numbers> all;
  for (int k = 0; k < n; ++k) {
    numbers q(static_cast<std::size_t>(m.nq()));
    ksl::neutral(m, q.data());
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] += wide * std::sin(phase + 1.7 * k + 0.9 * static_cast<double>(i * i));
    robots::normalize_quaternions(m, q.data());
    all.push_back(q);
  }
  return all;
}

/// A chain of hinges that turn about x, y and z by turns, with limits.
inline ksl::robot_description chain(int joints, double lower = -2, double upper = 2.5) {
  ksl::robot_description r;
  r.links.push_back(robots::link("ground"));
  for (int k = 0; k < joints; ++k) {
    r.links.push_back(robots::link(("link" + std::to_string(k)).c_str(), robots::solid(1, {0.1, 0, 0}, 0.1, 0.1, 0.1)));
    const double axis[5] = {0, 0, 1, 0, 0};
    r.joints.push_back(robots::joint(("joint" + std::to_string(k)).c_str(), ksl::joint_kind::revolute, k, k + 1,
                                     {0.1, 0.2, 0.3 - 0.02 * k}, {axis[2 - k % 3], axis[3 - k % 3], axis[4 - k % 3]}));
    r.joints.back().lower = lower - 0.01 * k, r.joints.back().upper = upper + 0.02 * k;
  }
  return r;
}

/// A chain of joints with one to three numbers, each with limits of its own.
inline ksl::robot_description several_numbers() {
  using enum ksl::joint_kind;
  ksl::robot_description r = chain(6, -0.3, 0.4);
  const ksl::joint_kind kinds[6] = {revolute, cylindrical, universal, planar, translation, prismatic};
  for (std::size_t k = 0; k < 6; ++k) {
    ksl::joint_description &j = r.joints[k];
    j.kind = kinds[k];
    j.axis2 = {j.axis.y, j.axis.z, j.axis.x};
    const int count = ksl::row_of(j.kind).nq;
    for (int c = 1; c < count; ++c)
      j.further[static_cast<std::size_t>(c - 1)] = {-0.2 - 0.03 * c, 0.25 + 0.04 * c};
  }
  return r;
}

} // namespace inverse_kinematics_problems
