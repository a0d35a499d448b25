// The variational midpoint method on the manifold: the motion makes the sum of h L(q_k ⊕ ½hv, v), q_{k+1} = q_k ⊕ hv, stationary under
// all changes of the positions between (Marsden and West, Discrete mechanics and variational integrators, 2001, section 2.6; Bou-Rabee and
// Marsden, Hamilton–Pontryagin integrators on Lie groups, 2009).  It is symplectic and keeps momenta, so that energy has no trend.
//
// With A(x) and J(x) the derivatives of q ⊕ x by q and by x, f the effort ∂L/∂q and those of drives, at the midpoint, and m = M v there,
//
//     w = m + ½h Jᵀ(½hv) f,
//     p_k     = Aᵀ(hv) J⁻ᵀ(hv) w − h Aᵀ(½hv) f,                                                                        (1)
//     p_{k+1} = J⁻ᵀ(hv) w.                                                                                             (2)
//
// (1) is solved for v by v ← v + M⁻¹ (p_k − its right side); joint velocities at the times are M⁻¹ p.
//
// Where ⊕ is addition, A = J = 1: p_k = M v − ½h f and p_{k+1} = M v + ½h f at q_k + ½h v, the midpoint rule.
//
// A body that moves along the exponential of a twist moves along a screw, with every constant velocity along another one.  So trees that
// nothing holds have their centre of mass as a coordinate (mass_centers), which moves along a straight line.  Then q ⊕ hv, v, p and f are
// those in these coordinates.  The velocity ẋ of the centre is in the Lagrangian as ½ m ẋ² alone, so that a constant velocity that is added
// changes nothing else, and the angular momentum about the centre is kept as that about each point of the world is.
//
// With loops φ(q) = 0 and K their Jacobian, impulses Kᵀ λ at q_k are added to p_k so that q_{k+1} is closed, and the momenta that count are
// those but for Kᵀ (Marsden and West, section 3.4; Leimkuhler and Skeel, Symplectic numerical integrators in constrained Hamiltonian systems,
// 1994).  With x = G y the motions that keep loops closed, K G = 0, a correction of v is d with
//
//     G_kᵀ (M d − p_k + the right side of (1)) = 0,        h J d = x_0 + G_{k+1} y,  K_{k+1} x_0 = −φ(q_{k+1}),            (3)
//
// and joint velocities at the times are G (Gᵀ M G)⁻¹ Gᵀ p.
#include "batch/compute_batch.hpp"
#include "engine/kernels/algorithm_rows.hpp"
#include "simulate/system/linear_solve.hpp"
#include "simulate/system/mass_centers.hpp"
#include "simulate/methods/steps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ksl::simulating {
namespace {

constexpr int most_iterations = 100;
/// Corrections of v, relative to speeds, below which (1) is solved; or they no longer become smaller.
constexpr double solved = 1e-16, nearly_solved = 1e-9;

/// A call of an algorithm for n states of the tree.
void call(const system &of, const algorithm_row &row, std::size_t n, const double *q, const double *v,
          const double *tau, double *one, double *two = nullptr, double *three = nullptr) {
  const std::ptrdiff_t nv = static_cast<std::ptrdiff_t>(of.nv()), each = row.result[0].axes == 2 ? nv * nv : nv;
  batch_view<double> batch;
  batch.n = n, batch.q = {q, static_cast<std::ptrdiff_t>(of.nq())}, batch.v = {v, nv}, batch.tau = {tau, nv};
  batch.result[0] = {one, each}, batch.result[1] = {two, each}, batch.result[2] = {three, each};
  compute_states(row, of.tree(), batch, 0, n);
}

/// out = q ⊕ u
void move(const system &of, mass_centers &centers, std::size_t n, const double *q, const double *u, double *out) {
  if (centers.any())
    centers.move(of, n, q, u, out);
  else
    of.space().move(n, q, u, out);
}

/// What loops make of a step.
class closed_steps {
public:
  closed_steps(const system &of, mass_centers &centers)
      : centers_(centers), nv_(of.nv()), G_(nv_ * nv_), end_G_(G_.size()), mass_(G_.size()), matrix_(G_.size()),
        x_(nv_), way_(nv_), d_(nv_), y_(nv_), q_(of.nq()) {}

  /// After centers have the position q.
  void begin(system &of, const double *q) { freedoms_ = tangent(of, q, G_), center(G_); }

  /// d of (3) at velocities v, of which left (nv) is p_k − the right side of (1); false where there is none.
  /// d = d₀ + D y, d₀ = J⁻¹ x₀ / h and D = J⁻¹ G_{k+1} / h, in (3):
  ///
  ///     (G_kᵀ M D) y = G_kᵀ (left − M d₀).                                                                               (4)
  bool correct(system &of, const double *q, const double *middle, const double *v, double h, const double *left,
               double *d) {
    for (std::size_t k = 0; k < nv_; ++k)
      x_[k] = h * v[k];
    move(of, centers_, 1, q, x_.data(), q_.data());
    if (tangent(of, q_.data(), end_G_) != freedoms_)
      return false;
    center(end_G_);
    of.closed()->way_back(way_.data());
    centers_.to_velocities(1, way_.data());
    set_rate(of, h, d);
    if (centers_.any())
      centers_.set_position(of, 1, middle), centers_.mass_matrix(mass_.data());
    else
      call(of, rows::mass_matrix, 1, middle, nullptr, nullptr, mass_.data());
    reduce(d, left, y_.data());
    for (std::size_t j = 0; j < freedoms_; ++j) {
      for (std::size_t k = 0; k < nv_; ++k)
        way_[k] = end_G_[k * freedoms_ + j];
      set_rate(of, h, d_.data());
      for (std::size_t k = 0; k < nv_; ++k)
        end_G_[k * freedoms_ + j] = d_[k];
      reduce(d_.data(), nullptr, way_.data());
      for (std::size_t i = 0; i < freedoms_; ++i)
        matrix_[i * freedoms_ + j] = -way_[i];
    }
    if (freedoms_ > 0 && !lu_.factor(freedoms_, matrix_.data()))
      return false;
    lu_.solve(y_.data());
    for (std::size_t k = 0; k < nv_; ++k)
      for (std::size_t j = 0; j < freedoms_; ++j)
        d[k] += end_G_[k * freedoms_ + j] * y_[j];
    return true;
  }

  /// v of momenta p but for Kᵀ, at a closed position; false where a freedom moves no mass.
  bool velocities(system &of, const double *q, const double *p, double *v) {
    const std::size_t f = tangent(of, q, end_G_);
    for (std::size_t j = 0; j < f; ++j) {
      y_[j] = 0;
      for (std::size_t k = 0; k < nv_; ++k)
        y_[j] += end_G_[k * f + j] * p[k];
    }
    if (!of.closed()->solve_inertia(q, y_.data()))
      return false;
    for (std::size_t k = 0; k < nv_; ++k) {
      v[k] = 0;
      for (std::size_t j = 0; j < f; ++j)
        v[k] += end_G_[k * f + j] * y_[j];
    }
    return true;
  }

private:
  static std::size_t tangent(system &of, const double *q, std::vector<double> &G) {
    return static_cast<std::size_t>(of.closed()->set_tangent(q, G.data()));
  }
  /// Columns of G, of joint velocities, become those of centres.
  void center(std::vector<double> &G) {
    for (std::size_t j = 0; centers_.any() && j < freedoms_; ++j) {
      for (std::size_t k = 0; k < nv_; ++k)
        way_[k] = G[k * freedoms_ + j];
      centers_.to_velocities(1, way_.data());
      for (std::size_t k = 0; k < nv_; ++k)
        G[k * freedoms_ + j] = way_[k];
    }
  }
  /// out = J⁻¹(x_) way_ / h
  void set_rate(const system &of, double h, double *out) const {
    if (centers_.any())
      centers_.rates(of, x_.data(), way_.data(), out);
    else
      of.space().rates(1, x_.data(), way_.data(), out);
    for (std::size_t k = 0; k < nv_; ++k)
      out[k] /= h;
  }
  /// out (freedoms) = G_kᵀ (left − M x)
  void reduce(const double *x, const double *left, double *out) const {
    std::fill_n(out, freedoms_, 0.0);
    for (std::size_t i = 0; i < nv_; ++i) {
      double sum = left ? left[i] : 0;
      for (std::size_t k = 0; k < nv_; ++k)
        sum -= mass_[i * nv_ + k] * x[k];
      for (std::size_t j = 0; j < freedoms_; ++j)
        out[j] += G_[i * freedoms_ + j] * sum;
    }
  }

  mass_centers &centers_;
  std::size_t nv_, freedoms_ = 0;
  std::vector<double> G_, end_G_; ///< (nv, freedoms) at the beginning and at the end
  std::vector<double> mass_, matrix_, x_, way_, d_, y_, q_;
  linear_solve lu_;
};

class variational final : public method {
public:
  variational(const system &of, std::size_t most)
      : centers_(of, most), nv_(of.nv()), p_(most * nv_), v_(p_), u_(p_), middle_v_(p_), middle_q_(most * of.nq()),
        effort_(p_), momentum_(p_), potential_(p_), w_(p_), left_(p_), scratch_(p_), power_(most), before_(most),
        found_(most), moves_(most) {
    if (!of.of().loops().empty())
      loops_.emplace(of, centers_);
    if (!of.space().is_flat()) {
      for (std::vector<double> *x : {&A_, &J_, &half_A_, &half_J_})
        x->resize(most * nv_ * nv_);
      lu_.resize(most);
    }
  }

  void begin(const block &) override { has_momentum_ = false; }

  outcome of_run(std::size_t k, outcome) const override { return found_[k]; }

  outcome step(system &of, block &b, double h) override {
    if (!has_momentum_)
      set_momentum(of, b);
    has_momentum_ = true;
    v_ = b.v;
    centers_.begin_steps(b.n, b.q.data());
    centers_.to_velocities(b.n, v_.data());
    if (loops_)
      loops_->begin(of, b.q.data());
    std::fill(before_.begin(), before_.end(), std::numeric_limits<double>::infinity());
    std::fill(found_.begin(), found_.end(), outcome::done);
    std::fill(moves_.begin(), moves_.end(), 1);
    // Newton's method with M in place of the derivative of (1)'s right side, from which it differs by O(h): each correction is O(h) times the
    // last.  Runs that are solved stay as they are, whatever others in their block need.
    bool any = true;
    for (int iteration = 0; any; ++iteration) {
      if (!set_sides(of, b, h))
        return outcome::stopped;
      if (!loops_)
        solve(of, b.n);
      else if (!loops_->correct(of, b.q.data(), middle_q_.data(), v_.data(), h, left_.data(), scratch_.data()))
        return found_[0] = outcome::not_solved;
      any = false;
      for (std::size_t k = 0; k < b.n; ++k)
        if (moves_[k])
          correct(k, iteration, loops_ ? rounding_of(b.q) / h : 0), any |= moves_[k] != 0;
    }
    if (!set_sides(of, b, h))
      return outcome::stopped;
    for (std::size_t k = 0; k < b.n; ++k)
      b.work[k] += h * power_[k];
    set_way(b.n, h);
    move(of, centers_, b.n, b.q.data(), u_.data(), b.q.data());
    p_ = w_; // (2), which set_sides has multiplied by J⁻ᵀ
    centers_.to_joint_momenta(b.n, w_.data());
    if (!loops_)
      call(of, rows::solve_mass_matrix, b.n, b.q.data(), nullptr, w_.data(), b.v.data());
    else if (!loops_->velocities(of, b.q.data(), w_.data(), b.v.data()))
      return found_[0] = outcome::not_solved;
    b.t += h;
    for (std::size_t k = 0; k < b.n; ++k)
      if (found_[k] != outcome::done)
        return found_[k];
    return outcome::done;
  }

private:
  /// p at the beginning.
  void set_momentum(system &of, const block &b) {
    call(of, rows::energy_derivatives, b.n, b.q.data(), b.v.data(), nullptr, scratch_.data(), p_.data(),
         potential_.data());
    if (centers_.any())
      centers_.set_position(of, b.n, b.q.data());
    centers_.to_momenta(b.n, p_.data());
  }

  /// scratch_ = M⁻¹ left_ at the midpoint, where centers_ are
  void solve(system &of, std::size_t n) {
    centers_.to_joint_momenta(n, left_.data());
    call(of, rows::solve_mass_matrix, n, middle_q_.data(), nullptr, left_.data(), scratch_.data());
    centers_.to_velocities(n, scratch_.data());
  }

  /// Adds its correction to the velocities of run k; those of a run that is solved, or can't be, move no more.
  void correct(std::size_t k, int iteration, double rounding) {
    double largest[2] = {}, speeds[2] = {1, 1}; // those of centres may be much larger, and change nothing else
    for (std::size_t i = 0; i < nv_; ++i) {
      const double change = scratch_[k * nv_ + i], v = v_[k * nv_ + i] += change;
      double &most = largest[centers_.flags()[i]], &speed = speeds[centers_.flags()[i]];
      most = std::fmax(most, std::fabs(change)), speed = std::fmax(speed, std::fabs(v));
    }
    const double correction = std::fmax(largest[0] / speeds[0], largest[1] / speeds[1]);
    const bool is_finite =
        std::all_of(scratch_.begin() + at(k), scratch_.begin() + at(k + 1), [](double x) { return std::isfinite(x); });
    if (!is_finite || iteration == most_iterations)
      found_[k] = iteration == 0 ? outcome::not_finite : outcome::not_solved;
    const double near = nearly_solved + rounding / std::fmin(speeds[0], speeds[1]);
    moves_[k] = found_[k] == outcome::done && correction > solved && !(correction >= before_[k] && before_[k] <= near);
    before_[k] = correction;
  }
  std::ptrdiff_t at(std::size_t k) const { return static_cast<std::ptrdiff_t>(k * nv_); }

  /// What rounding of positions may leave of corrections, times the step: loops are closed no better.
  static double rounding_of(const std::vector<double> &q) {
    double most = 1;
    for (const double x : q)
      most = std::fmax(most, std::fabs(x));
    return 16 * std::numeric_limits<double>::epsilon() * most;
  }

  void set_way(std::size_t n, double h) {
    for (std::size_t k = 0; k < n * nv_; ++k)
      u_[k] = h * v_[k];
  }

  /// At v_: the midpoint, p_k − the right side of (1) into left_, (2) into w_, and the power of drives.
  bool set_sides(system &of, const block &b, double h) {
    const std::size_t n = b.n;
    set_way(n, h / 2);
    move(of, centers_, n, b.q.data(), u_.data(), middle_q_.data());
    set_energies(of, n);
    if (!of.set_efforts(b.t + h / 2, b.first, n, middle_q_.data(), middle_v_.data()))
      return false;
    of.set_outer_efforts(n, middle_q_.data(), middle_v_.data(), left_.data());
    of.set_power(n, middle_q_.data(), middle_v_.data(), of.tau(), power_.data());
    for (std::size_t k = 0; k < n * nv_; ++k)
      effort_[k] += of.tau()[k] + left_[k] - potential_[k];
    of.note_elements(n, middle_q_.data(), middle_v_.data(), effort_.data());
    centers_.to_momenta(n, effort_.data());
    if (of.space().is_flat()) {
      for (std::size_t k = 0; k < n * nv_; ++k)
        // A = J = 1: w = m + ½h f, and p_k − (1) is p_k − w + h f
        w_[k] = momentum_[k] + h / 2 * effort_[k], left_[k] = p_[k] + h * effort_[k] - w_[k];
      return true;
    }
    set_jacobians(of, n, h);
    for (std::size_t k = 0; k < n; ++k)
      set_curved_sides(k, h);
    return true;
  }

  /// Derivatives of the kinetic energy, of the potential energy, and joint velocities at the midpoint.  Where centres of mass rest, joint
  /// momenta along them are zero: the derivatives by the other coordinates with ẋ held are those with v held.
  void set_energies(system &of, std::size_t n) {
    middle_v_ = v_;
    centers_.to_rest(n, middle_v_.data());
    centers_.to_joint_velocities(n, middle_v_.data());
    call(of, rows::energy_derivatives, n, middle_q_.data(), middle_v_.data(), nullptr, effort_.data(), momentum_.data(),
         potential_.data());
    if (!centers_.any())
      return;
    centers_.to_momenta(n, momentum_.data());
    centers_.to_rest(n, momentum_.data()); // rounding
    centers_.add_momenta(n, v_.data(), momentum_.data());
    middle_v_ = v_;
    centers_.to_joint_velocities(n, middle_v_.data());
  }

  void set_curved_sides(std::size_t run, double h) {
    const std::size_t row = run * nv_;
    for (std::size_t k = 0; k < nv_; ++k)
      w_[row + k] = momentum_[row + k] + h / 2 * column(half_J_, run, k, effort_);
    // w is (2) from here on, and (1) = Aᵀ(hv) w − h Aᵀ(½hv) f
    lu_[run].solve(w_.data() + row);
    for (std::size_t k = 0; k < nv_; ++k)
      left_[row + k] = p_[row + k] + h * column(half_A_, run, k, effort_) - column(A_, run, k, w_);
  }

  /// Element k of the product of a run's matrix, transposed, and its x.
  double column(const std::vector<double> &matrices, std::size_t run, std::size_t k,
                const std::vector<double> &x) const {
    const double *const matrix = matrices.data() + run * nv_ * nv_;
    double sum = 0;
    for (std::size_t i = 0; i < nv_; ++i)
      sum += matrix[i * nv_ + k] * x[run * nv_ + i];
    return sum;
  }

  /// A and J at ½hv and hv; the transpose of J(hv) as its factors.
  void set_jacobians(system &of, std::size_t n, double h) {
    centers_.to_rest(n, u_.data());
    call(of, rows::integrate_jacobians, n, middle_q_.data(), u_.data(), nullptr, half_A_.data(), half_J_.data());
    set_way(n, h);
    centers_.to_rest(n, u_.data());
    call(of, rows::integrate_jacobians, n, middle_q_.data(), u_.data(), nullptr, A_.data(), J_.data());
    for (std::vector<double> *by_u : {&A_, &J_, &half_A_, &half_J_})
      centers_.set_straight(n, by_u->data());
    for (std::size_t k = 0; k < n; ++k) {
      double *const J = J_.data() + k * nv_ * nv_;
      for (std::size_t i = 0; i < nv_; ++i)
        for (std::size_t j = 0; j < i; ++j)
          std::swap(J[i * nv_ + j], J[j * nv_ + i]);
      lu_[k].factor(nv_, J);
    }
  }

  mass_centers centers_;
  std::size_t nv_;
  bool has_momentum_ = false;
  std::vector<double> p_, v_, u_, middle_v_, middle_q_, effort_, momentum_, potential_, w_, left_, scratch_, power_,
      before_;
  std::vector<double> A_, J_, half_A_, half_J_; ///< (n, nv, nv)
  std::vector<outcome> found_;
  std::vector<unsigned char> moves_;
  std::vector<linear_solve> lu_;
  std::optional<closed_steps> loops_;
};

} // namespace

std::unique_ptr<method> make_variational(const system &of, std::size_t most) {
  return std::make_unique<variational>(of, most);
}

} // namespace ksl::simulating
