// Loops at a position: frames, errors, the Jacobian of the equations, and their rates.
#pragma once

#include "engine/loops/tables.hpp"
#include "engine/loops/tree_calls.hpp"

namespace ksl::loops {

class geometry {
public:
  geometry(const model &m, const tables &t) : tree_(m), t_(t) {}

  /// externals: how many external wrenches a call of tree() may have.
  void lay_out(arena &memory, int externals = 0);

  /// Sets frames and Jacobian at a position.
  void set_position(const double *q);

  /// (rows, nv) d(error) = K dv at closed positions.
  const double *jacobian() const { return K_; }
  /// The largest term of the scaled Jacobian, whose terms are lengths in those of the mechanism: 1 or more.  What the terms at a position are is
  /// no scale: of a hinge and a ball on its axis they are rounding.
  double size() const { return size_; }
  /// Pivots and singular values of the scaled Jacobian that are no larger are zero at this position.  The Jacobian of one that is open by e
  /// is off by some e.
  double zero() const;

  /// (rows) zero where the loops are closed: Tᵀ of the displacement that remains once each joint has the position that fits best.
  void error(double *out) const;

  /// (rows) Tᵀ (A_s − A_p − V_s × (V_s − V_p)), the rate of K v, for given motions.  terms (rows), may be null: the sums of the
  /// magnitudes of its terms.
  void acceleration(const double *q, const double *v, const double *a, double *out, double *terms);

  /// (rows) K v; terms as above.
  void velocity(const double *v, double *out, double *terms) const;

  /// Wrenches on links that the multipliers λ (rows) stand for: 2 a loop, at the origins of the links, in their axes.  Also sets the
  /// wrenches (loops, 6) of predecessors on successors at the joints' frames on the successors.
  void wrenches(const double *lambda, int *links, double *on_links, double *at_joints) const;

  /// How these wrenches vary with the multipliers and with the coordinates dq (nv), along the mechanism.
  void wrench_variations(const double *lambda, const double *dlambda, const double *dq, double *on_links,
                         double *at_joints) const;

  const SE3<double> &relative(int loop) const {
    return at_[loop].relative;
  } ///< the frame on the successor in that on the predecessor
  const SE3<double> &successor_frame(int loop) const { return at_[loop].successor; } ///< of the joint, in the world

  /// The axes in the world of the link on one side of a loop.
  mat3x3<double> link_axes(int loop, bool successor) const {
    const ksl::loops::loop &l = t_.loops[static_cast<std::size_t>(loop)];
    return pose(successor ? l.successor : l.predecessor).R;
  }

  /// A column in the axes of a loop's frame on the successor, about its origin; without the factor of a follower.
  screw<double> column_at_successor(int loop, int column) const;
  /// (rows of the loop) wrenches T in these axes.
  const coscrew<double> *wrenches_of(int loop) const { return at_[loop].T; }
  /// The first axis of a universal loop joint, fixed in the predecessor, in these axes.
  vec3<double> first_axis(int loop) const;

  /// Σ λ T of a loop, in these axes.
  coscrew<double> wrench(int loop, const double *lambda) const;

  const tree_calls &tree() const { return tree_; }
  const tables &of() const { return t_; }
  void *rest() const { return rest_; } ///< memory of calls

private:
  struct frames {
    SE3<double> predecessor, successor; ///< the joint's frames on both sides, in the world
    SE3<double> relative;               ///< the successor's in the predecessor's
    coscrew<double> T[6];               ///< in the axes of the successor's
  };

  SE3<double> pose(int slot) const;
  double sum_of_terms(const double *v) const;
  screw<double> relative_twist(int loop, const double *dq) const;
  void move_to_link(int loop, int side, const coscrew<double> &w, double *six) const;
  void set_columns(const double *q);
  void set_rows_of_universal(const loop &l, frames &f) const;

  tree_calls tree_;
  const tables &t_;
  double *poses_ = nullptr;          ///< (links, 4, 4)
  screw<double> *columns_ = nullptr; ///< at the child's origin, in world axes
  frames *at_ = nullptr;             ///< (loops)
  double *K_ = nullptr;
  double *twists_ = nullptr, *accelerations_ = nullptr; ///< (links, 6) in world axes, about the world's origin
  void *rest_ = nullptr;
  std::size_t rest_bytes_ = 0;
  bool is_measured_ = false;
  double size_ = 0;
};

} // namespace ksl::loops
