// What is integrated: forward dynamics of n runs under drives and external wrenches.
//
//     M(q) a + b(q, v) = τ + τ_f + λ,     b: bias, with gravity, springs, dampers and external wrenches                    (1)
//
//     set_efforts    τ, of drives: a function, or given over time, a controller, gravity; cut at limits
//     add_friction   τ_f = −F sign(v), where coordinates slide                                   (held_joints.hpp)
//     accelerate_…   a₀ without λ: forward dynamics in lanes; with loops by closed_mechanism.hpp
//     hold           λ, where coordinates are held: a = a₀ + A λ, zero there
//     set_power      of all that isn't conservative; its integral is the work among the results
//
// One object belongs to one thread: its arrays are those of the runs that are computed together.
#pragma once

#include "simulate/system/closed_mechanism.hpp"
#include "simulate/system/held_joints.hpp"
#include "simulate/system/manifold.hpp"
#include "simulate/system/motion_asked.hpp"

#include "engine/kernels/algorithm_rows.hpp"
#include "engine/elements/dampers.hpp"
#include "ksl/engine/algorithms/batch_view.hpp"
#include "ksl/simulate.hpp"

#include <algorithm>
#include <memory>
#include <optional>

namespace ksl::simulating {

class system final : public held_mechanism {
public:
  /// For at most `most` runs at once.
  system(const model &m, const simulation &task, std::size_t most);

  /// As held_mechanism has it; efforts stay in tau().
  bool accelerate(double t, std::size_t first, std::size_t n, const double *q, const double *v, double *a,
                  double *power) override;
  const double *tau() const { return tau_.data(); }

  /// Where numbers x (n, nv) that follow from q and v are not finite: the force elements that have no force there are remembered.
  void note_elements(std::size_t n, const double *q, const double *v, const double *x);
  /// The last one of run k of those computed together; −1: none.
  int element(std::size_t k) const { return element_.empty() ? -1 : element_[k]; }
  void forget_elements() { std::fill(element_.begin(), element_.end(), -1); }

  /// Brakes engage: drives may be without effort from then on.  Not a question of time: a step may end at this very time.
  void set_brakes(bool engaged) {
    if (held_)
      held_->set_brakes(engaged);
    is_cut_ = engaged && task_.laws.cut_efforts;
  }

  /// What holds coordinates of the run; null without exact laws.
  held_joints *held() { return held_ ? &*held_ : nullptr; }
  /// (nv) of the first run; null without exact laws.
  held_joints::mode *held_modes() { return held_ ? held_->modes(0) : nullptr; }

  /// The derivatives of the accelerations of a run by q and v, (nv, nv) each, with those of its drives; false as above.
  bool derivatives(double t, std::size_t run, const double *q, const double *v, double *by_q, double *by_v);

  /// power (n): of efforts tau, of external wrenches and of what dissipates.
  void set_power(std::size_t n, const double *q, const double *v, const double *tau, double *power);

  /// The efforts of external wrenches, damping and friction, out (n, nv), after set_efforts.
  void set_outer_efforts(std::size_t n, const double *q, const double *v, double *out);

  /// The efforts of the drives alone into tau(), and the wrenches; false as above.
  bool set_efforts(double t, std::size_t first, std::size_t n, const double *q, const double *v);

  void responses(const double *q, const std::vector<held_coordinate> &coordinates, double *a) override;

  const model &of() const { return m_; }
  const manifold &space() const { return space_; }
  /// The tree that carries the loops, for the variational method; without loops the model itself.
  const model &tree() const { return tree_ ? *tree_ : m_; }
  /// Moves q and v to the nearest closed ones at which joints that are held stand; as closed_mechanism::project.
  bool project(double *q, double *v, double &opened) {
    return closed_->project(q, v, opened, held_ ? held_->flags() : nullptr);
  }
  /// Are accelerations, of one run, those of the nearest closed state.
  void close_first(bool closes) { closes_first_ = closes; }
  closed_mechanism *closed() { return closed_ ? &*closed_ : nullptr; }
  std::size_t nq() const { return nq_; }
  std::size_t nv() const { return nv_; }
  std::size_t evaluations() const { return evaluations_; }

private:
  bool add_derivatives(double t, std::size_t run, const double *q, const double *v, double *by_q, double *by_v);
  void set_wrenches(double t, std::size_t first, std::size_t n);
  void follow(double t, std::size_t first, std::size_t n, const double *q, const double *v);
  void add_gravity(std::size_t n, const double *q);
  void add_inverse_dynamics(std::size_t n, const double *q, const double *v);
  void keep_limits(std::size_t n);
  batch_view<double> batch_of(std::size_t n, const double *q, const double *v, const double *a,
                              const double *tau) const;
  void accelerate_closed(std::size_t n, const double *q, const double *v, double *a);
  void accelerate_nearest(const double *q, const double *v, double *a);
  void call(const algorithm_row &row, std::size_t n, const double *q, const double *v, const double *a,
            const double *tau, double *out);
  void call_tree(const algorithm_row &row, const batch_view<double> &inputs, double *out, std::size_t columns);
  external_wrenches<double> wrenches_of(std::size_t k) const {
    return {static_cast<int>(links_.size()), links_.data(), wrenches_.data() + 6 * links_.size() * k,
            task_.external_axes};
  }

  const model &m_;
  const simulation &task_;
  const drive_law &law_;
  manifold space_;
  std::optional<motion_asked> asked_;
  std::optional<closed_mechanism> closed_;
  std::optional<model> tree_;
  std::optional<held_joints> held_;
  std::optional<elements::dampers> dampers_;
  std::optional<elements::found_forces> forces_; ///< where elements act
  std::vector<int> element_;
  std::size_t nq_, nv_, evaluations_ = 0;
  bool is_cut_ = false, closes_first_ = false;
  std::vector<double> moved_, tau_, wanted_, error_, computed_, applied_, moving_, positions_, inverses_, parts_;
  std::vector<int> links_;
  std::vector<double> wrenches_; ///< (most, links, 6)
  std::vector<external_rows<double>> external_;
  std::vector<double> shifted_, changed_, rates_; ///< of derivatives
};

} // namespace ksl::simulating
