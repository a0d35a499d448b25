// Steps on the manifold of positions, for n runs in rows.  A step from q₀ is a joint velocity u, and leads to q₀ ⊕ u.
//
//     q₀ ⊕ u      joints with one axis: q₀ + u;  poses and rotations: Q₀ exp(u)
//     q₁ ⊖ q₀     the shortest u with q₀ ⊕ u = q₁
//
// Methods for vector spaces are made for u, whose rates are J(u)⁻¹ v.  u = 0 at the beginning of each step, far from the singularity of J at a
// rotation of 2π.
#pragma once

#include "ksl/model.hpp"

#include <cstddef>
#include <vector>

namespace ksl::simulating {

class manifold {
public:
  explicit manifold(const model &m);

  /// Where in q the number is whose rate a coordinate of v is; −1 for coordinates of curved joints.
  int number_in_q(int v) const { return number_in_q_[static_cast<std::size_t>(v)]; }

  /// Are all velocities the rates of numbers in q?  Then ⊕ is addition.
  bool is_flat() const { return curved_.empty(); }

  /// out (n, nq) = q ⊕ u
  void move(std::size_t n, const double *q, const double *u, double *out) const;

  /// u (n, nv) = q1 ⊖ q0
  void difference(std::size_t n, const double *q0, const double *q1, double *u) const;

  /// du (n, nv): the rates of u where q₀ ⊕ u moves with the joint velocities v.  With Q = Q₀ exp u and J the right Jacobian of the
  /// exponential, v = J(u) du/dt (Munthe-Kaas, High order Runge–Kutta methods on manifolds, 1999).
  void rates(std::size_t n, const double *u, const double *v, double *du) const;

  /// v (n, nv) = J(u) du: the reverse.
  void velocities(std::size_t n, const double *u, const double *du, double *v) const;

  /// The largest rotation (rad) of a joint with a quaternion, or in a plane with two slides, in the step u (nv): J is singular at 2π.
  double largest_turn(const double *u) const;

private:
  /// A joint whose velocities are not the rates of its numbers in q: its velocities are coordinates of a twist.
  struct curved_joint {
    int v_index, nv;
    int coordinate[6];
  };
  template <class Jacobian>
  void map(std::size_t n, const double *u, const double *x, double *out, Jacobian jacobian) const;

  const model &m_;
  std::vector<curved_joint> curved_;
  std::vector<int> number_in_q_;
};

} // namespace ksl::simulating
