// Coordinates of trees that nothing holds: the centre of mass of each, in place of the origin of its first link.
//
// A floating or planar joint on the ground carries its tree along straight lines and turns it.  With R its rotation, m the mass that it
// carries and x the centre of mass in the joint's fixed axes, a joint velocity v = (v_lin, y) moves
//
//     ẋ = R (v_lin + C y),   C = M_lin,y / m,                                                                     (1)
//
// since the rows v_lin of the mass matrix M give the tree's momentum in its own axes.  B is the matrix of (v_lin, y) ↦ (ẋ, y), which leaves
// all other coordinates as they are; joint momenta p and efforts become B⁻ᵀ p.  In these coordinates a constant velocity that is added to a
// tree changes ẋ alone, and the kinetic energy is ½ m ẋ² and what it is where the centre rests.
#pragma once

#include "simulate/system/system.hpp"

namespace ksl::simulating {

class mass_centers {
public:
  /// For at most `most` runs at once.
  mass_centers(const system &of, std::size_t most);

  /// Is there a tree of this kind?
  bool any() const { return !trees_.empty(); }
  /// (nv) flags: velocities of centres.
  const unsigned char *flags() const { return is_center_.data(); }

  /// From here on B is that of n positions q.
  void set_position(const system &of, std::size_t n, const double *q);
  /// Steps begin at the position that was set last.
  void begin_steps(std::size_t n, const double *q);
  /// out (n, nq) = where steps u (n, nv) lead from the positions q at which they begin; B is that of out.
  void move(const system &of, std::size_t n, const double *q, const double *u, double *out);
  /// du (nv): the rates of u where the step u leads to a position that moves with v, as manifold::rates.
  void rates(const system &of, const double *u, const double *v, double *du);

  void to_velocities(std::size_t n, double *v) const;                ///< v ← B v
  void to_joint_velocities(std::size_t n, double *v) const;          ///< v ← B⁻¹ v
  void to_momenta(std::size_t n, double *p) const;                   ///< p ← B⁻ᵀ p
  void to_joint_momenta(std::size_t n, double *p) const;             ///< p ← Bᵀ p
  void add_momenta(std::size_t n, const double *v, double *p) const; ///< p ← p + m ẋ
  void to_rest(std::size_t n, double *v) const;                      ///< v ← v with ẋ = 0
  /// M (nv, nv): the mass matrix of the first run as B⁻ᵀ M B⁻¹.
  void mass_matrix(double *M) const;

  /// Replaces blocks of matrices (n, nv, nv) by identities: derivatives of ⊕, whose centres move along straight lines.
  void set_straight(std::size_t n, double *by_u) const;

private:
  struct tree {
    std::size_t q, v, axes; ///< where its numbers in q and v begin; 3 for floating joints, 2 for planar ones
  };
  /// R of a tree at a position of its run, as rows of 3 numbers, and the centre of mass in its axes.
  struct placed { double R[3][3], center[3], mass; };
  /// f(tree, where it is, the run's row in arrays of nv numbers, the run's mass matrix)
  template <class F> void for_each(std::size_t n, F f) const;

  std::size_t nq_, nv_;
  std::vector<tree> trees_;
  std::vector<unsigned char> is_center_;
  std::vector<placed> placed_;
  std::vector<double> mass_, begin_, still_, moving_; ///< (n, nv, nv), (n, trees, 3), (n, nv), (nv)
};

} // namespace ksl::simulating
