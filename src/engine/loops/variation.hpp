// How the equations of loops vary with position and velocity.
//
// All is in the axes of a joint's frame on the successor s, where the wrenches T of the joint are constant.  J_c is the column of a
// coordinate, about an axis that is fixed in the body c behind it.  Seen from s, that body moves with V_c − V_s, hence
//
//     dJ_c = J_c × Ξ_c,   Ξ_c = (V_s − V_c)[dq],   V_s − V_c = Σ_k p_ck J_k dq_k,                                    (1)
//
// where k runs over the coordinates of the loop on the way from c to s; p_ck is 1 for those on the side of s, −1 for those on the side of
// the predecessor p.  The relative twist is W = Σ σ_c J_c v_c, σ = 1 on the side of s, −1 on that of p, and the loop demands
//
//     Tᵀ W = 0,    Tᵀ Ẇ = 0,   Ẇ = Σ σ_c (J_c a_c + (J_c × U_c) v_c),   U_c = (V_s − V_c)[v].                          (2)
//
// With X_k the part of the sum W that coordinate k moves as s sees it, all that lies before k on the way from p to s, and Y_k that of Ẇ,
// Jacobi's identity makes one walk along this way of what (1) does to (2):
//
//     dW = σ_k X_k × J_k dq_k,    dẆ = σ_k (Y_k × J_k − X_k × ((W − X_k) × J_k)) dq_k.                                  (3)
//
// How: for k on the side of s, dJ_c = J_c × J_k for all c before k, and nothing for those behind it, so dW = Σ σ_c v_c J_c × J_k over c before k.  In
// Ẇ the rate J_c × U_c has two factors that vary, and dU_c = (part of U_c before k) × J_k.  With U_c = B_c + (W − X_k), B_c that part,
//
//     (J_c × J_k) × U_c + J_c × (B_c × J_k) = (J_c × U_c) × J_k − J_c × ((W − X_k) × J_k)       by Jacobi's identity, twice,
//
// whose sum over c, with the J_c a_c, is the bracket of (3).  On the side of p the signs p_ck and σ_k are both −1.
//
// A universal joint's last equation is N · ω = 0, N = u₁ × u₂, whose u₁ is fixed in p: du₁ = u₁ × (ω_s − ω_p)[dq].
#pragma once

#include "engine/loops/geometry.hpp"

namespace ksl::loops {

class variation {
public:
  variation(const model &m, const tables &t) : m_(m), t_(t) {}

  void lay_out(arena &memory);

  /// Sets the matrices below, at the position that g has.
  void set(const geometry &g, const double *v, const double *a, const double *lambda);

  const double *velocity_by_q() const { return velocity_by_q_; }         ///< (rows, nv) ∂(K v)/∂q
  const double *acceleration_by_q() const { return acceleration_by_q_; } ///< (rows, nv) ∂(K a + K̇ v)/∂q
  const double *acceleration_by_v() const { return acceleration_by_v_; } ///< (rows, nv) the same by v
  const double *wrench_by_q() const { return wrench_by_q_; }             ///< (nv, nv) ∂(Kᵀ λ)/∂q, λ held

private:
  struct element {
    screw<double> J, X, Y, rate; ///< rate: J × U
    double sigma, v, a;
    int coordinate, group;
  };
  /// What a universal joint's last equation is made of: N, its rate, and their variations.
  struct normal_vector {
    vec3<double> u1, N, rate;
    double length;
  };

  void set_loop(const geometry &g, int loop, const double *v, const double *a);
  void set_sums();
  double sign(int c, int k) const;
  void vary(const geometry &g, int loop, const element &by);
  void vary_wrenches(const coscrew<double> &f, double normal, const vec3<double> &axis2, int k);

  const model &m_;
  const tables &t_;
  element *at_ = nullptr;
  int n_ = 0;                  ///< coordinates of the loop in hand
  screw<double> W_{}, rate_{}; ///< W and Ẇ
  normal_vector normal_{};
  double *velocity_by_q_ = nullptr, *acceleration_by_q_ = nullptr, *acceleration_by_v_ = nullptr,
         *wrench_by_q_ = nullptr;
};

} // namespace ksl::loops
