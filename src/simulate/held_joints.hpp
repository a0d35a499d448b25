// The exact laws of one run: coordinates on their limits, dry friction that sticks and slips, brakes.
//
// A coordinate that is held has no acceleration, and an effort λ holds it: with A the inverse of the mass matrix, and a₀ the accelerations
// without these efforts,
//
//     A_hh λ = −a₀_h.                                                                                                    (1)
//
// Friction holds while |λ| is at most the friction's effort F, a limit while λ pushes away from it.  A coordinate that slides has the
// effort −F sign(v).
#pragma once

#include "ksl/simulate.hpp"

#include <vector>

namespace ksl::simulating {

class system;

class held_joints {
public:
  enum class mode : unsigned char { free, slides_down, slides_up, sticks, at_lower, at_upper };

  held_joints(const exact_laws &laws, int nv);

  /// Efforts of friction where coordinates slide, added to tau (nv).
  void add_friction(double *tau) const;

  /// Accelerations a of coordinates that nothing holds → a with those that are held; sets holding().
  void hold(system &of, const double *q, double *a);

  mode &at(int k) { return mode_[static_cast<std::size_t>(k)]; }
  mode at(int k) const { return mode_[static_cast<std::size_t>(k)]; }
  bool holds(int k) const { return at(k) >= mode::sticks; }
  double friction(int k) const { return friction_[static_cast<std::size_t>(k)]; }
  double holding(int k) const { return holding_[static_cast<std::size_t>(k)]; }

  /// By how much coordinate k is from being let go: F − |λ| for friction, the effort that pushes away from a limit.
  double margin(int k) const;

  void engage_brakes();

  /// Chooses the modes of coordinates without velocity, after something changed: friction holds where it can, except at the coordinate
  /// `slides`, which has just been let go; −1: none.  a (nv) and power are those after it.  False if a function ended the run.
  bool settle(system &of, double t, std::size_t run, const double *q, const double *v, double *a, double *power,
              int slides);

  /// v after impacts on limits at q: those in `hits` (nv flags) are thrown back, others on limits are not passed.
  void impact(system &of, const double *q, const unsigned char *hits, double *v);

  const exact_laws &laws() const { return laws_; }

private:
  void list_held();
  void solve(const double *right);

  const exact_laws &laws_;
  std::vector<mode> mode_;
  std::vector<double> friction_, holding_, columns_, matrix_, right_;
  std::vector<int> held_, pivot_;
  bool any_ = false;
};

} // namespace ksl::simulating
