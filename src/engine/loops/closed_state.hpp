// The dynamics of a mechanism with loops, for one state in double precision.
//
// The tree carries the loops: its joints have the coordinates, and the wrenches of the joints that close loops are external wrenches on
// their two links.  With K the Jacobian of the loops' equations and λ their multipliers,
//
//     M a + b = τ + Kᵀ λ,   K v = 0,   K a + K̇ v = 0.                                                              (1)
//
// Elimination gives coordinates from which all others follow: v = G v_i.  Since K G = 0, (1) times Gᵀ has no multipliers:
//
//     inverse dynamics   Gᵀ E τ_d = Gᵀ (M a + b), τ_d the efforts of the drives;                                  (2)
//     forward dynamics   Gᵀ M G a_i = Gᵀ (τ − b − M a₀), a = G a_i + a₀.                                            (3)
//
// The multipliers then follow from the rows of (1) that belong to dependent coordinates.
//
// Sizes, with r the rank of K: K (rows, nv), G (nv, f) with f = nv − r freedoms, E (nv, drives) with a 1 for each drive at its coordinate.  Where
// the drives are the independent coordinates, Gᵀ E is the identity, and τ_d are the numbers of Gᵀ (M a + b).  a₀ has K a₀ = −K̇ v and is zero at
// independent coordinates.  rows − r redundant equations leave λ determined but for the solutions of Kᵀ λ = 0, patterns of wrenches.
//
// A planar four-bar of revolute joints, three of the tree and one that closes the loop, has nv = 3 and 5 equations.  Those of the force across its
// plane and of both moments hold whatever moves: r = 2, f = 1, and three patterns, of wrenches that no motion of the plane tells.
//
// A state goes so, each line using what those above have left:
//
//     set_position(q)                     frames and K; elimination; G; are all loops closed
//       inverse_dynamics(q, v, a)         are v and a those of closed loops; (2): τ_d; λ from τ_d
//       forward_dynamics(q, v, τ)         a₀ (steady_acceleration); (3): a;  set_multipliers: λ of this motion
//       velocity_jump(q, impulses)        (3), integrated over an impact: Δv
//     set_reactions                       λ + Σ η_k n_k, n_k the patterns' multipliers, in place of λ
//     all_wrenches                        Σ λ T of each loop, as wrenches on its two links
#pragma once

#include "engine/loops/elimination.hpp"
#include "engine/loops/geometry.hpp"
#include "ksl/loops.hpp"

namespace ksl::loops {

/// Why a state has no result.
struct finding {
  enum class kind {
    none,
    open,         ///< the position doesn't close a loop
    velocity,     ///< velocities don't keep it closed
    acceleration, ///< accelerations don't
    no_drives,    ///< nobody said which joints have motors
    few_drives,   ///< the drives leave freedoms
    idle_effort,  ///< a body that turns idly needs an effort
    no_column,    ///< a result exists only where drives leave no freedom, not even of idle bodies
    more_drives,  ///< they are more than the freedoms, where they must be as many
    massless      ///< a freedom moves no mass
  } what = kind::none;
  int row = -1; ///< equation, or coordinate in v
  double value = 0, allowed = 0;
  int freedoms = 0;

  explicit operator bool() const { return what != kind::none; }
};

/// How far states of a call may be open, relative to `length` or to the terms of the equation.
template <class S>
inline constexpr double accepted_of = sizeof(S) == 8 ? loop_tolerance::accepted : loop_tolerance::accepted_single;

class closed_state {
public:
  /// accepted: how far states may be open, as accepted_of.
  closed_state(const model &m, double accepted)
      : m_(m), t_(m.loop_tables()), g_(m, t_), tolerance_(accepted_within(t_, accepted)),
        is_single_(accepted == loop_tolerance::accepted_single) {}

  /// externals: how many external wrenches a call may have.
  void lay_out(arena &memory, int externals);

  /// Coordinates that are to be the independent ones, where they determine the motion: (nv) flags, n of them.
  struct preferred {
    const unsigned char *coordinates;
    int n;
  };

  /// Frames, Jacobian and elimination, which prefers tables::kept; a finding if a loop is open there.
  finding set_position(const double *q) { return set_position(q, kept()); }
  finding set_position(const double *q, preferred kept);

  /// Elimination alone, wherever the loops are.
  void set_open_position(const double *q) { set_open_position(q, kept()); }
  void set_open_position(const double *q, preferred kept);

  /// From here on: as if the mechanism had no weight, no physics of joints and no force elements.
  void take_weight_off() { has_weight_ = false; }

  /// A call of the tree that carries the loops.
  void call(const algorithm_row &row, const state_view<double> &s) const {
    if (has_weight_)
      g_.tree().call(row, g_.rest(), s);
    else
      g_.tree().call_weightless(row, g_.rest(), s);
  }

  /// Efforts (nv) of the drives at (q, v, a), and the multipliers.  v and a null are zero.
  finding inverse_dynamics(const double *q, const double *v, const double *a, const external_wrenches<double> &e,
                           double *tau);

  /// The accelerations (nv) at rest of the independent coordinates; with gains, those that correct errors of the loops.
  finding steady_acceleration(const double *q, const double *v, double *a, const stabilisation *gains = nullptr);

  /// Takes the angular accelerations of idle bodies along their lines off a (nv), where these bodies' coordinates are independent; of all, or of those that
  /// move no mass.
  void stop_idle_bodies(const double *q, const double *v, double *a, bool all);

  /// Accelerations a (nv) under efforts tau (nv) at all coordinates, those without a drive included; with gains those that correct errors of the
  /// loops, too.  Leaves the factors of Gᵀ M G, for solve_again.
  finding forward_dynamics(const double *q, const double *v, const double *tau, const external_wrenches<double> &e,
                           double *a, const stabilisation *gains = nullptr);

  /// The jump (nv) of velocities under impulses.
  finding velocity_jump(const double *q, const external_wrenches<double> &impulses, double *jump);

  /// Replaces the multipliers, which balance, by those of least energy in the joints that have compliances, and among these, which are all
  /// where no joint has one, by those of least norm: the sum of the squares of all joints' wrenches, each at its frame on the side called
  /// child, in N and N m.  Before all of that, by those of least norm along directions in which nothing resists: zero where that balances.
  void set_reactions(const double *q, const double *v, const double *a, const external_wrenches<double> &e);

  /// Patterns of wrenches that may be added, orthonormal over all joints, each (joints + loops, 6): as many as there are redundant equations.
  /// Returns how many of them, the first ones, store no energy in compliances and stay open.  Those of a position are set once.
  int set_patterns(const double *q);
  const double *pattern(int k) const { return patterns_ + k * pattern_length(); }
  /// The first n of them into out (n, joints + loops, 6), without what is smaller than `least` and does not count.
  void copy_patterns(int n, double least, double *out) const;
  int pattern_length() const { return 6 * (joints() + static_cast<int>(t_.loops.size())); }

  /// External wrenches and those of the loops' joints together.
  external_wrenches<double> all_wrenches(const external_wrenches<double> &e);
  /// (loops, 6) predecessors on successors, after all_wrenches.
  const double *loop_wrenches() const { return at_joints_; }

  /// What is null stands for zeros (nv).
  const double *zeros_or(const double *x) const { return x ? x : zero_; }

  geometry &at() { return g_; }
  const geometry &at() const { return g_; }
  const tables &of() const { return t_; }
  const elimination &solved() const { return k_; }
  int joints() const { return static_cast<int>(m_.joints().size()); }
  const double *multipliers() const { return lambda_; }

  /// Elements of G, (nv, freedoms).
  const double *G() const { return G_; }
  double G(int v, int free) const { return G_[v * k_.freedoms() + free]; }

  /// Sets τ_d with Gᵀ E τ_d = Gᵀ y; of least norm where there are more drives than freedoms.
  finding efforts_of_drives(const double *y, double *tau);

  /// Solves Gᵀ M G x = r, with the mass matrix at q; r (freedoms) = Gᵀ y is replaced.  The motion of an idle body that moves no mass
  /// is left as it is, if y has no effort along it.
  finding solve_inertia(const double *q, double *r, const double *y);
  bool has_massless_idle() const { return has_massless_idle_; }
  /// Solves Gᵀ M G x = r for another r, by the factors that solve_inertia or forward_dynamics has left.
  void solve_again(double *r) const;

  /// The multipliers of a motion under efforts tau (nv), which balance.
  void set_multipliers(const double *q, const double *v, const double *a, const double *tau,
                       const external_wrenches<double> &e);

private:
  finding check(finding::kind what, const double *values, const double *terms, bool lengths) const;
  void set_G();
  finding efforts_of_least_norm(double *wanted, double *tau);
  preferred kept() const { return {t_.is_kept.data(), static_cast<int>(t_.kept.size())}; }
  double rounding_of_idle(const idle_body &body, const double *y) const;
  finding no_effort_of_idle(const double *y, double *tau) const;
  const model &m_;
  const tables &t_;
  geometry g_;
  elimination k_;
  double tolerance_;
  bool is_single_; ///< states of single precision, which are a little open
  double *rows_[3] = {}, *lambda_ = nullptr, *null_lambda_ = nullptr;
  double *zero_ = nullptr, *tree_ = nullptr, *left_ = nullptr, *a0_ = nullptr, *G_ = nullptr, *M_ = nullptr,
         *MG_ = nullptr, *H_ = nullptr, *small_ = nullptr;
  int take_apart(const tables::matrices_of_joints &metric, int patterns);
  reaction_request all_joints() const;

  // patterns_ (redundant, joints + loops, 6) with null_lambda_ (redundant, rows), their multipliers, row for row; reactions_ is one such row.
  // wrenches_ and wrench_links_: [ external ones of the call | successor, predecessor of loop 0 | of loop 1 | … ]
  bool has_weight_ = true, has_massless_idle_ = false;
  unsigned char *massless_ = nullptr; ///< (freedoms) is it the motion of an idle body that moves no mass
  int patterns_known_ = -1;           ///< how many of the present position have been set
  double *reactions_ = nullptr, *patterns_ = nullptr;
  double *energy_ = nullptr; ///< (patterns, patterns) of patterns with each other
  double *stiff_ = nullptr;  ///< (patterns) those of each with itself, once they are diagonal
  int open_ = 0;             ///< patterns without energy
  int free_ = 0;             ///< patterns, the first ones, without a wrench along directions in which nothing resists
  double *wrenches_ = nullptr, *at_joints_ = nullptr;
  int *wrench_links_ = nullptr, *joint_links_ = nullptr;
};

} // namespace ksl::loops
