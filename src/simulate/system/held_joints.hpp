// The exact laws of one run: coordinates on their limits, dry friction that sticks and slips, brakes.
//
// A coordinate that is held has no acceleration, and an effort λ holds it: with A the inverse of the mass matrix, and a₀ the accelerations
// without these efforts,
//
//     A_hh λ = −a₀_h.                                                                                                    (1)
//
// Friction holds while |λ| is at most the friction's effort F, a limit while λ pushes away from it, or pulls by F at most.  A coordinate that
// slides has the effort −F sign(v); one that begins to does so the way that it is accelerated.
//
// Modes of a coordinate; → where it changes, with the event that does it (event_search.hpp):
//
//                     v = 0: stops                   |λ| > F: lets go
//     slides_down  ───────────────→            ────────────────────────→  slides_down
//     slides_up    ───────────────→   sticks   ────────────────────────→  slides_up
//
//                     impacts die out             pulled by more than F: lets go
//     free         ───────────────→  at_lower  ────────────────────────→  free, or with friction slides_up
//     slides_…     ───────────────→  at_upper  ────────────────────────→  free, or with friction slides_down
//
// At an instant all coordinates without velocity are decided together, since efforts that hold one load the others: a linear complementarity
// problem, in which a held one has a = 0 and λ within bounds, or else a leads the way that λ could not stop (settle).
//
// In formulas, for all k at rest at once, with a = a₀ + A λ and F the friction of coordinate k:
//
//     sticks        a_k = 0    −F ≤ λ_k ≤ F         at_lower    a_k = 0    λ_k ≥ −F        at_upper    a_k = 0    λ_k ≤ F
//     slides_up     a_k ≥ 0    λ_k = −F             leaves it   a_k ≥ 0    λ_k = −F        leaves it   a_k ≤ 0    λ_k = F
//     slides_down   a_k ≤ 0    λ_k = F
//
// A block of mass m under an effort τ has A = 1/m and a₀ = τ/m, hence λ = −τ: it sticks while |τ| ≤ F, and slides with a = (τ ∓ F)/m.
//
// A is positive semidefinite: through loops, or at a dead centre, where no effort moves a coordinate, A_hh is singular, and what others hold already
// gets λ = 0 (solve).
#pragma once

#include "ksl/simulate.hpp"

#include <cstddef>
#include <vector>

namespace ksl::simulating {

/// A coordinate of a run in lanes.
struct held_coordinate {
  std::size_t run;
  int coordinate;
};

/// The mechanism whose coordinates are held, as far as the laws ask it.
class held_mechanism {
public:
  /// Accelerations a (n, nv) that an effort of 1 at each of n coordinates causes at rest, without gravity, in the position of its run;
  /// after accelerate at the same q.
  virtual void responses(const double *q, const std::vector<held_coordinate> &coordinates, double *a) = 0;

  /// a (n, nv) and power (n), of drives, external wrenches and dissipation, of the runs from `first` on at time t.  Returns false if a
  /// function ended the runs.  Numbers that overflow give NaN.
  virtual bool accelerate(double t, std::size_t first, std::size_t n, const double *q, const double *v, double *a,
                          double *power) = 0;

protected:
  held_mechanism() = default;
  held_mechanism(const held_mechanism &) = default;
  ~held_mechanism() = default;
};

class held_joints {
public:
  enum class mode : unsigned char { free, slides_down, slides_up, sticks, at_lower, at_upper };

  /// Of `runs` runs, of which the first is that of all calls that don't say which.
  held_joints(const exact_laws &laws, int nv, std::size_t runs);

  /// Efforts of friction where coordinates of n runs slide, added to tau (n, nv).
  void add_friction(std::size_t n, double *tau) const;

  /// Accelerations a (n, nv) of coordinates that nothing holds → a with those that are held; sets lets_go(), and holding() of the last run.
  void hold(held_mechanism &of, std::size_t n, const double *q, double *a);

  /// Must a coordinate of the run be let go, after hold().
  bool lets_go(std::size_t run) const { return lets_go_[run] != 0; }

  /// (nv) of a run.
  mode *modes(std::size_t run) { return mode_.data() + run * nv_; }

  /// Holds derivatives of accelerations, x (nv, nv) in columns, at the position of the last hold(): but for those of the mass matrix.
  void hold_derivatives(double *x);

  mode &at(int k) { return mode_[now_ + static_cast<std::size_t>(k)]; }
  mode at(int k) const { return mode_[now_ + static_cast<std::size_t>(k)]; }
  /// (nv) flags of those that are held, or null where none is.
  const unsigned char *flags();
  bool holds(int k) const { return at(k) >= mode::sticks; }
  double friction(int k) const { return friction_[static_cast<std::size_t>(k)]; }
  double holding(int k) const { return holding_[static_cast<std::size_t>(k)]; }

  /// By how much coordinate k is from being let go: F − |λ| for friction, but for rounding; the effort that pushes away from a limit, and F
  /// beside it.  −∞ at a dead centre, where no effort holds it.
  double margin(int k) const;

  /// A coordinate that is held moves from now on, the way that it is pushed.
  void let_go(int k);

  void set_brakes(bool engaged);

  /// Chooses the modes of coordinates without velocity, after something changed: friction holds where it can, and makes v exactly zero
  /// there, except at the coordinate `slides`, which has just been let go; −1: none.  a (nv) and power are those after it.  False if a
  /// function ended the run.
  bool settle(held_mechanism &of, double t, std::size_t run, const double *q, double *v, double *a, double *power,
              int slides);

  /// v after impacts on limits at q: those in `hits` (nv flags) are thrown back, others on limits are not passed.
  void impact(held_mechanism &of, const double *q, const unsigned char *hits, double *v);

  const exact_laws &laws() const { return laws_; }

private:
  mode way_out(int k) const;
  double wrong(held_mechanism &of, const double *q, const double *a, int k);
  void list_held();
  void solve(const double *right);
  void resist(double *a, std::ptrdiff_t stride);

  const exact_laws &laws_;
  std::size_t nv_, now_ = 0; ///< now_: where in mode_ those of the run that is looked at begin
  std::vector<mode> mode_;   ///< (runs, nv)
  std::vector<double> friction_, holding_;
  std::vector<double> left_;      ///< acceleration of a coordinate that is to be held and can't be; 0: it is
  std::vector<mode> let_go_;      ///< how a coordinate that was let go at this instant was held; free: it wasn't
  std::vector<double> let_go_at_; ///< |λ| then
  // all_columns_ (held coordinates of all runs, nv): row j is A e_j for the j-th of them, those of a run one after the other.  matrix_ (held, held)
  // is A_hh of one run, right_ (held) the right side of (1) and then λ.
  std::vector<double> all_columns_, matrix_, right_, wanted_, response_;
  double *columns_ = nullptr; ///< accelerations (held, nv) that efforts of 1 at the coordinates held_ cause
  std::vector<int> held_, pivot_;
  std::vector<held_coordinate> all_held_;
  std::vector<unsigned char> flags_, used_, lets_go_;
  bool any_ = false;
};

} // namespace ksl::simulating
