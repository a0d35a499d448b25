#include "simulate/system/manifold.hpp"

#include "batch/compute_batch.hpp"
#include "engine/kernels/algorithm_rows.hpp"
#include "ksl/algebra.hpp"
#include "ksl/engine/model/joints.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::simulating {

using A = algebra<double>;

manifold::manifold(const model &m) : m_(m), number_in_q_(static_cast<std::size_t>(m.nv()), -1) {
  for (int j = 0; j < m.moving_joints(); ++j) {
    const joint_row &joint = m.joints()[static_cast<std::size_t>(j)];
    with_joint(joint.kind, [&]<class J>(J) {
      for (int k = 0; J::velocity_is_rate && k < J::nv; ++k)
        number_in_q_[static_cast<std::size_t>(joint.v_index + k)] = joint.q_index + k;
      // which numbers of a twist (lin, ang) its velocities are: of a planar joint 0, 1 and 5
      if constexpr (requires { J::coordinate[0]; })
        if (!J::velocity_is_rate) {
          curved_joint c{joint.v_index, J::nv, {}};
          for (int k = 0; k < J::nv; ++k)
            c.coordinate[k] = J::coordinate[k];
          curved_.push_back(c);
        }
      return 0;
    });
  }
}

void manifold::move(std::size_t n, const double *q, const double *u, double *out) const {
  if (is_flat()) {
    for (std::size_t i = 0; i < n * static_cast<std::size_t>(m_.nq()); ++i)
      out[i] = q[i] + u[i];
    return;
  }
  batch_view<double> batch;
  batch.n = n, batch.q = {q, m_.nq()}, batch.v = {u, m_.nv()}, batch.result[0] = {out, m_.nq()};
  compute_states(rows::integrate, m_, batch, 0, n);
}

void manifold::difference(std::size_t n, const double *q0, const double *q1, double *u) const {
  batch_view<double> batch;
  batch.n = n, batch.q = {q0, m_.nq()}, batch.q1 = {q1, m_.nq()}, batch.result[0] = {u, m_.nv()};
  compute_states(rows::difference, m_, batch, 0, n);
}

/// out = [J Q; 0 J] x for the twists of curved joints, and out = x for the others.
/// Twists are whole for the algebra's functions: a planar joint's (v_x, v_y, ω_z) becomes (v_x, v_y, 0, 0, 0, ω_z), and a ball's ω (0, 0, 0, ω).  The
/// joint's numbers are closed under the map, so that the others stay zero.
template <class Jacobian>
void manifold::map(std::size_t n, const double *u, const double *x, double *out, Jacobian jacobian) const {
  const std::size_t nv = static_cast<std::size_t>(m_.nv());
  std::copy_n(x, n * nv, out);
  for (const curved_joint &joint : curved_)
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t at = k * nv + static_cast<std::size_t>(joint.v_index);
      double step[6] = {}, moving[6] = {};
      for (int i = 0; i < joint.nv; ++i)
        step[joint.coordinate[i]] = u[at + static_cast<std::size_t>(i)],
        moving[joint.coordinate[i]] = x[at + static_cast<std::size_t>(i)];
      // (lin, ang) ↦ (J lin + Q ang, J ang): the right Jacobian of SE(3) at the step, or its inverse
      const screw<double> s = {{step[0], step[1], step[2]}, {step[3], step[4], step[5]}};
      const vec3<double> lin = {moving[0], moving[1], moving[2]}, ang = {moving[3], moving[4], moving[5]};
      mat3x3<double> J, Q;
      jacobian(&s, &J, &Q);
      vec3<double> of_lin, of_ang, coupled;
      A::product_drv(&J, &lin, &of_lin), A::product_drv(&J, &ang, &of_ang), A::product_drv(&Q, &ang, &coupled);
      const double mapped[6] = {
          of_lin.x + coupled.x, of_lin.y + coupled.y, of_lin.z + coupled.z, of_ang.x, of_ang.y, of_ang.z};
      for (int i = 0; i < joint.nv; ++i)
        out[at + static_cast<std::size_t>(i)] = mapped[joint.coordinate[i]];
    }
}

void manifold::rates(std::size_t n, const double *u, const double *v, double *du) const {
  map(n, u, v, du, [](const auto *s, auto *J, auto *Q) { A::SE3_rightJacobianInverse(s, J, Q); });
}

void manifold::velocities(std::size_t n, const double *u, const double *du, double *v) const {
  map(n, u, du, v, [](const auto *s, auto *J, auto *Q) { A::SE3_rightJacobian(s, J, Q); });
}

double manifold::largest_turn(const double *u) const {
  double most = 0;
  for (const curved_joint &joint : curved_) {
    double square = 0;
    for (int i = 0; i < joint.nv; ++i)
      if (joint.coordinate[i] >= 3)
        square += u[joint.v_index + i] * u[joint.v_index + i];
    most = std::max(most, std::sqrt(square));
  }
  return most;
}

} // namespace ksl::simulating
