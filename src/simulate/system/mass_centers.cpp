#include "simulate/system/mass_centers.hpp"

#include "batch/compute_batch.hpp"
#include "engine/kernels/algorithm_rows.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::simulating {
namespace {

/// Is a joint's parent the ground, or welded to it?
bool is_on_ground(const model &m, const joint_row &joint) {
  int link = joint.parent_link;
  while (link >= 0) {
    const auto carries =
        std::find_if(m.joints().begin(), m.joints().end(), [&](const joint_row &j) { return j.link == link; });
    if (carries == m.joints().end())
      break;
    if (carries->kind != joint_kind::fixed)
      return false;
    link = carries->parent_link;
  }
  return true;
}

/// R of the quaternion [x y z w], as rows.
void set_rotation(const double *q, double (&R)[3][3]) {
  const double x = q[0], y = q[1], z = q[2], w = q[3], s = 2 / (x * x + y * y + z * z + w * w);
  R[0][0] = 1 - s * (y * y + z * z), R[0][1] = s * (x * y - w * z), R[0][2] = s * (x * z + w * y);
  R[1][0] = s * (x * y + w * z), R[1][1] = 1 - s * (x * x + z * z), R[1][2] = s * (y * z - w * x);
  R[2][0] = s * (x * z - w * y), R[2][1] = s * (y * z + w * x), R[2][2] = 1 - s * (x * x + y * y);
}

} // namespace

// Floating and planar joints on the ground, whose trees nothing holds.  The diagonal of M at their linear velocities is the mass that they carry,
// unless an armature is added there.
mass_centers::mass_centers(const system &of, std::size_t most) : nq_(of.nq()), nv_(of.nv()), is_center_(nv_, 0) {
  const model_view<double> view = of.of().view();
  for (const joint_row &joint : of.of().joints()) {
    const bool floats = joint.kind == joint_kind::floating;
    if ((!floats && joint.kind != joint_kind::planar) || joint.v_index < 0 || !is_on_ground(of.of(), joint))
      continue;
    const tree t = {static_cast<std::size_t>(joint.q_index), static_cast<std::size_t>(joint.v_index), floats ? 3u : 2u};
    bool has_armature = false; // which no centre of mass tells
    for (std::size_t i = t.v; view.physics && i < t.v + t.axes; ++i)
      has_armature |= view.physics[i].armature != 0;
    if (has_armature)
      continue;
    trees_.push_back(t);
    std::fill_n(is_center_.begin() + joint.v_index, t.axes, static_cast<unsigned char>(1));
  }
  if (!any())
    return;
  placed_.resize(most * trees_.size()), begin_.resize(3 * placed_.size());
  mass_.resize(most * nv_ * nv_), still_.resize(most * nv_), moving_.resize(nv_);
}

template <class F> void mass_centers::for_each(std::size_t n, F f) const {
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = 0; i < trees_.size(); ++i)
      f(trees_[i], placed_[k * trees_.size() + i], k * nv_, mass_.data() + k * nv_ * nv_);
}

void mass_centers::set_position(const system &of, std::size_t n, const double *q) {
  batch_view<double> batch;
  batch.n = n, batch.q = {q, static_cast<std::ptrdiff_t>(nq_)};
  batch.result[0] = {mass_.data(), static_cast<std::ptrdiff_t>(nv_ * nv_)};
  compute_states(rows::mass_matrix, of.tree(), batch, 0, n);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = 0; i < trees_.size(); ++i) {
      const tree &t = trees_[i];
      placed &at = placed_[k * trees_.size() + i];
      const double *const numbers = q + k * nq_ + t.q, *const M = mass_.data() + k * nv_ * nv_;
      // the momentum of a rotation ω about the origin is m ω × c
      //
      //     M, rows lin and columns ang:   m [  0    c_z  −c_y ]
      //                                      [ −c_z  0     c_x ]
      //                                      [  c_y −c_x   0   ]
      const auto moment = [&](std::size_t lin, std::size_t ang) { return M[(t.v + lin) * nv_ + t.v + ang] / at.mass; };
      // planar joints have v = (v_x, v_y, ω_z), floating ones v = (v_lin, ω): z is the column of ω_z
      at = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}, M[t.v * nv_ + t.v]};
      const std::size_t z = t.axes == 3 ? 5 : 2;
      at.center[0] = moment(1, z), at.center[1] = -moment(0, z);
      if (t.axes == 3) {
        at.center[2] = moment(0, 4);
        set_rotation(numbers + 3, at.R);
      } else {
        const double s = std::sin(numbers[2]), c = std::cos(numbers[2]);
        at.R[0][0] = at.R[1][1] = c, at.R[0][1] = -s, at.R[1][0] = s;
      }
    }
}

// x = t + R c: where the centre is when a step begins; t is the joint's position.
void mass_centers::begin_steps(std::size_t n, const double *q) {
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = 0; i < trees_.size(); ++i) {
      const placed &at = placed_[k * trees_.size() + i];
      for (std::size_t r = 0; r < trees_[i].axes; ++r) {
        double &x = begin_[3 * (k * trees_.size() + i) + r] = q[k * nq_ + trees_[i].q + r];
        for (std::size_t c = 0; c < 3; ++c)
          x += at.R[r][c] * at.center[c];
      }
    }
}

// The other coordinates go first, since R and c follow from them; then t = x + u − R c.
void mass_centers::move(const system &of, std::size_t n, const double *q, const double *u, double *out) {
  std::copy_n(u, n * nv_, still_.data());
  for (std::size_t k = 0; k < n * nv_; ++k)
    still_[k] = is_center_[k % nv_] ? 0 : still_[k];
  of.space().move(n, q, still_.data(), out);
  set_position(of, n, out); // the mass matrix is the same wherever trees are
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = 0; i < trees_.size(); ++i) {
      const placed &at = placed_[k * trees_.size() + i];
      for (std::size_t r = 0; r < trees_[i].axes; ++r) {
        double &x = out[k * nq_ + trees_[i].q + r];
        x = begin_[3 * (k * trees_.size() + i) + r] + u[k * nv_ + trees_[i].v + r];
        for (std::size_t c = 0; c < 3; ++c)
          x -= at.R[r][c] * at.center[c];
      }
    }
}

/// u of a centre is its way in the world, whose rate is ẋ itself; the others move as on the manifold with the centres at rest.
void mass_centers::rates(const system &of, const double *u, const double *v, double *du) {
  for (std::size_t k = 0; k < nv_; ++k)
    still_[k] = is_center_[k] ? 0 : u[k], moving_[k] = is_center_[k] ? 0 : v[k];
  of.space().rates(1, still_.data(), moving_.data(), du);
  for (std::size_t k = 0; k < nv_; ++k)
    du[k] = is_center_[k] ? v[k] : du[k];
}

namespace {

/// v (axes) ← R v, or its transpose times v.
void turn(const double (&R)[3][3], std::size_t axes, bool back, double *v) {
  double turned[3] = {};
  for (std::size_t r = 0; r < axes; ++r)
    for (std::size_t c = 0; c < axes; ++c)
      turned[r] += (back ? R[c][r] : R[r][c]) * v[c];
  std::copy_n(turned, axes, v);
}

} // namespace

// Of one body alone C y = ω × c.
// B = [R  R C; 0  1] and its inverse [Rᵀ  −C; 0  1], for (ẋ, y) and (v_lin, y).  Momenta go by B⁻ᵀ = [R  0; −Cᵀ  1] and Bᵀ = [Rᵀ  0; Cᵀ Rᵀ  1].
void mass_centers::to_velocities(std::size_t n, double *v) const {
  for_each(n, [&](const tree &t, const placed &at, std::size_t row, const double *M) {
    for (std::size_t r = t.v; r < t.v + t.axes; ++r)
      for (std::size_t j = 0; j < nv_; ++j)
        v[row + r] += is_center_[j] ? 0 : M[r * nv_ + j] / at.mass * v[row + j];
    turn(at.R, t.axes, false, v + row + t.v);
  });
}

void mass_centers::to_joint_velocities(std::size_t n, double *v) const {
  for_each(n, [&](const tree &t, const placed &at, std::size_t row, const double *M) {
    turn(at.R, t.axes, true, v + row + t.v);
    for (std::size_t r = t.v; r < t.v + t.axes; ++r)
      for (std::size_t j = 0; j < nv_; ++j)
        v[row + r] -= is_center_[j] ? 0 : M[r * nv_ + j] / at.mass * v[row + j];
  });
}

void mass_centers::to_momenta(std::size_t n, double *p) const {
  for_each(n, [&](const tree &t, const placed &at, std::size_t row, const double *M) {
    for (std::size_t r = t.v; r < t.v + t.axes; ++r)
      for (std::size_t j = 0; j < nv_; ++j)
        p[row + j] -= is_center_[j] ? 0 : M[r * nv_ + j] / at.mass * p[row + r];
    turn(at.R, t.axes, false, p + row + t.v);
  });
}

void mass_centers::to_joint_momenta(std::size_t n, double *p) const {
  for_each(n, [&](const tree &t, const placed &at, std::size_t row, const double *M) {
    turn(at.R, t.axes, true, p + row + t.v);
    for (std::size_t r = t.v; r < t.v + t.axes; ++r)
      for (std::size_t j = 0; j < nv_; ++j)
        p[row + j] += is_center_[j] ? 0 : M[r * nv_ + j] / at.mass * p[row + r];
  });
}

void mass_centers::add_momenta(std::size_t n, const double *v, double *p) const {
  for_each(n, [&](const tree &t, const placed &at, std::size_t row, const double *) {
    for (std::size_t r = t.v; r < t.v + t.axes; ++r)
      p[row + r] += at.mass * v[row + r];
  });
}

void mass_centers::to_rest(std::size_t n, double *v) const {
  for (std::size_t k = 0; k < n * nv_; ++k)
    v[k] = is_center_[k % nv_] ? 0 : v[k];
}

void mass_centers::mass_matrix(double *M) const {
  std::copy_n(mass_.data(), nv_ * nv_, M);
  // B⁻ᵀ times each row of a symmetric matrix is M B⁻¹; once more, of its transpose, makes B⁻ᵀ M B⁻¹
  for (int side = 0; side < 2; ++side) {
    for (std::size_t i = 0; i < nv_; ++i)
      to_momenta(1, M + i * nv_);
    for (std::size_t i = 0; i < nv_; ++i)
      for (std::size_t j = 0; j < i; ++j)
        std::swap(M[i * nv_ + j], M[j * nv_ + i]);
  }
}

void mass_centers::set_straight(std::size_t n, double *by_u) const {
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = 0; i < nv_; ++i)
      for (std::size_t j = 0; j < nv_; ++j)
        if (is_center_[i] || is_center_[j])
          by_u[(k * nv_ + i) * nv_ + j] = i == j ? 1 : 0;
}

} // namespace ksl::simulating
