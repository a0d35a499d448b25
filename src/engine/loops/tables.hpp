// What the loops of a model are made of, as far as it doesn't depend on a position: which coordinates move the two ends of each, and
// the wrenches that its joint can exert.
//
//     loops      [ loop 0 | loop 1 | … ]                           each has rows of K, and a range of supports
//     supports   [ of loop 0: successor's side, then predecessor's, outwards from the common link | of loop 1 | … ]   a column with its sign
//     columns    [ coordinates of a joint | of another | … ]       each once, however many loops it moves; a user's coordinate v, and the child's twist for it
//     links      [ of the model ]                                  column::link, loop::predecessor and loop::successor are places in this list
//
// The four-bar ground ─j1─ a ─j2─ b, ground ─j3─ c, with a loop joint from c, the predecessor, to b, the successor:
//
//     columns    [ j1 | j2 | j3 ]
//     supports   [ (j1, 1) (j2, 1) | (j3, −1) ]      Tᵀ (V_s − V_p) = Tᵀ (J₁ v₁ + J₂ v₂ − J₃ v₃)
//
#pragma once

#include "ksl/engine/algorithms/loops/tolerances.hpp"
#include "ksl/model.hpp"

#include <algorithm>
#include <atomic>
#include <memory>
#include <vector>

namespace ksl::loops {

/// A coordinate of a joint of the tree that moves one end of a loop and not the other.
struct column {
  int v;               ///< the user's coordinate: for followers, that of the leader
  double factor;       ///< 1; for followers, the multiplier
  int link;            ///< index into tables::links: the joint's child link
  screw<double> twist; ///< of the child for a unit velocity, in the child's axes
  double turning;      ///< the length of its angular half
  int angle; ///< index in q of the second angle of a universal joint, whose first coordinate this is; −1 for others
  vec3<double> about; ///< the axis of that angle
};

/// A coordinate with the sign that it has in the motion of the successor relative to the predecessor.
struct support {
  int column;
  double sign;
  int group; ///< coordinates that move the same body, numbered along the way from the common link to either end
};

/// A joint that closes a loop.  Its equations are Tᵀ (V_s − V_p) = 0, with the twists of successor and predecessor at the joint's frame on
/// the successor, in its axes.  T are the wrenches that the joint can exert, a basis of H̄* (Coscrews page, (7)).
struct loop {
  joint_kind kind;
  int predecessor, successor; ///< indices into tables::links
  SE3<double> on_predecessor, on_successor;
  mat3x3<double> canonical; ///< axes of the joint's frame whose z is the joint's axis
  vec3<double> axis, axis2; ///< of universal joints, in the joint's frame
  double pitch;
  int turns;      ///< about how many directions the joint turns
  bool slides[3]; ///< along which of the canonical axes it slides, whatever it turns by
  int first_row, rows;
  coscrew<double> T[6];           ///< (rows); the last of a universal joint depends on the position
  int support_begin, support_end; ///< in tables::supports
  double length;                  ///< m: of the ways around it
};

/// Bytes that calls of one state need (algorithms.hpp), once they have been counted; 0 before.
struct bytes_of_calls { std::atomic<std::size_t> in_double{0}, in_single{0}; };

/// A body that turns alone about a line that is fixed in it, while the drives and all other bodies stand still.  It is idle if its mass is the same all round
/// the line, so that no mass moves, as that of a rod with balls at both ends: then efforts don't depend on how far it has turned.
struct idle_body {
  int link;                   ///< of the model
  vec3<double> direction;     ///< of the line, in the link's axes; a unit vector
  int coordinate;             ///< in v, that tells how far it has turned
  std::vector<int> moved;     ///< all that move with it
  std::vector<double> motion; ///< (nv) how, at the position at which it was found
  bool is_even;               ///< is its mass the same all round the line
};

struct tables {
  std::shared_ptr<bytes_of_calls> bytes = std::make_shared<bytes_of_calls>();
  std::vector<int> links; ///< of the model: those whose poses are needed
  std::vector<column> columns;
  std::vector<support> supports;
  std::vector<loop> loops;
  int rows = 0;      ///< of all loops
  double length = 1; ///< of the mechanism, m: rows of moments are multiplied by it, coordinates that turn divided
  /// to which equations that follow from others agree, in lengths: the digits of the file, where frames can't be made exact
  double digits = 0;
  std::vector<unsigned char> row_turns;    ///< (rows) is it an equation of rotation
  std::vector<unsigned char> column_turns; ///< (nv) does the coordinate turn
  std::vector<double> row_scale;           ///< (rows) 1 for equations of translation, `length` for those of rotation
  std::vector<double> column_scale;        ///< (nv) 1 for coordinates that slide, 1 / length for those that turn
  /// (6, 6) of joints, and where each is among all joints: those of the tree, then those of loops.
  using matrices_of_joints = std::vector<std::pair<int, std::array<double, 36>>>;
  /// Compliances.
  matrices_of_joints compliances;
  /// Of joints with stiffnesses: Σ u uᵀ over the directions u in which nothing resists, where there are some.
  matrices_of_joints loose;
  std::vector<int> drives;              ///< coordinates in v that have a motor, ascending
  std::vector<double> drive_scale;      ///< 1 / √weight of each
  std::vector<unsigned char> is_driven; ///< (nv)
  bool drives_are_known = false;
  std::vector<idle_body> idle, uneven; ///< bodies that turn alone, whose mass is the same all round, and others
  std::vector<int>
      kept; ///< coordinates of drives and of idle bodies, ascending: independent wherever they determine the motion
  std::vector<double> kept_scale; ///< drive_scale of each; negative at those of idle bodies, which must need no effort
  std::vector<unsigned char> is_kept; ///< (nv)
  /// Where there are idle bodies, (nv): 3 at their coordinates, 2 at drives, 0 at what else moves with idle bodies, 1 at others.  Eliminated in this order, the
  /// coordinate of an idle body stays independent, and moves nothing but the body.
  std::vector<unsigned char> stages;
};

/// A limit of states, or of motions that are asked for, where the file's digits are fewer.
inline double accepted_within(const tables &t, double accepted) {
  return accepted + loop_tolerance::rank_by_digits * t.digits;
}

/// What counts as zero beside the largest term of the equations at a position that is open by so many lengths.  A position that is far open
/// is one of another mechanism.
inline double rank_within(const tables &t, double opened) {
  using namespace loop_tolerance;
  const double least = std::max(rank, rank_by_digits * t.digits);
  if (!(opened <= accepted_within(t, accepted_single)))
    return least;
  return std::max(least, std::min(rank_by_opening * opened, nearly_singular));
}

/// The tables of a model with loops; its arrays have been built.
tables make_tables(const model &m);

/// The unit twists of a kind's coordinates in the child's axes, for joints other than universal ones.
std::vector<screw<double>> unit_twists(joint_kind kind, const vec3<double> &axis, double pitch);

} // namespace ksl::loops
