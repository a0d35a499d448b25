// KSL: joints that close loops as algorithms see them, with a plan of the elimination of their equations.
//
// The plan is made once, at a closed position of the model (src/engine/loops/plan.cpp): which equations and coordinates are pivots, in what
// order, and which elements can differ from zero.  So all states of a batch take the same steps, lane by lane.  A state whose pivots are too
// small, or that isn't closed, gets NaN, and is computed again with pivots of its own (src/engine/loops/algorithms.hpp).
#pragma once

#include "ksl/algebra.hpp"

namespace ksl {

/// How a joint's equations of rotation are seen to hold, without the joint's position.
enum class loop_turns : int {
  freely, ///< there are none, or that of a universal joint
  about,  ///< the axes of both sides are parallel
  not_at_all
};

/// A joint that closes a loop, between two bodies.  Equations of translation come first.
///
/// The loop's lists are parts of arrays of the view, which have the lists of all loops one after the other:
///
///     ground ─ … ─ common ─┬─ … ─ successor     column, pitch, own   [ … | successor's side | predecessor's side | … ]
///                          └─ … ─ predecessor                            ↑ begin            ↑ middle             ↑ end
///
/// from the common body outwards; own_begin is where the last body of the successor's side, it itself, begins.  `through` likewise.
template <class T> struct closing_joint {
  int predecessor, successor;          ///< bodies
  SE3<T> on_predecessor, on_successor; ///< its frame, in the bodies' canonical frames
  bool is_turned;                      ///< has the frame on the successor other axes than this body
  loop_turns turns;
  vec3<T> axis;         ///< in its frame; if it turns about one
  int forces, moments;  ///< how many equations of each
  vec3<T> direction[6]; ///< (forces + moments) of the force or moment of each, in its frame on the successor
  int along[6];         ///< which axis of this frame each is, or −1
  int first_row;
  /// of those on the successor's side, then on the predecessor's: from the common body outwards
  int columns_begin, columns_middle, columns_end;
  int own_begin; ///< where the columns begin that move the successor relative to its parent; they end at columns_middle
  int elements_begin, elements_end; ///< in loop_view::element
  /// where the joints begin that its wrench passes through, those of the predecessor's side, and where they end, in loop_view::through
  int through_begin, through_middle, through_end;
  int mixed;      ///< of a helical joint: which equation has a moment beside its force; −1 for others
  vec3<T> turn;   ///< this moment
  vec3<T> across; ///< a unit vector across the axis
  T pitch;
  /// is it universal: the first axis is fixed in the predecessor, and its last moment is about the normal of both
  bool has_two_axes;
  vec3<T> axis2;
  T cosine; ///< of the angle between them
};

/// A coordinate that moves one end of a loop: its number in the motion subspace of a body (joints/column.hpp), and in v.
struct loop_column { int body, coordinate, v; };

/// An element of K that is a number of the model: of a coordinate of the successor's own, about the joint's frame on it.
template <class T> struct loop_element {
  int row, place; ///< in K
  T value;
};

/// One step of the elimination: lists are places in loop_view::list.
struct loop_pivot {
  int row, column;
  int rows_begin, rows_end;       ///< equations below that have the column
  int columns_begin, columns_end; ///< columns that the row has: later steps, then pivots + number of an independent one
  int later_begin, later_end;     ///< steps whose columns these are
};

/// The pattern of an equation that follows from others: wrenches that balance.  Lists are places in loop_view::list.
struct loop_pattern {
  int loops_begin, loops_end; ///< the loops whose joints have a wrench in the pattern
  /// earlier patterns that share joints with this one; they are taken off first, in their order
  int earlier_begin, earlier_end;
  int places_begin, places_end; ///< joints, as of joint_compliance_view, that have a wrench in it then
};

/// How a joint gives way under the wrench through it: about the joint's origin, in the axes of the body that it carries, or, if it closes a
/// loop, in those of its frame on the successor.
template <class T> struct joint_compliance_view {
  int joint; ///< its place in loop_view::crossed, or after these the place of a loop
  T matrix[6][6];
};

/// All joints that close loops, and the elimination of their equations.  In numbers: nv = pivots + freedoms coordinates of the expanded mechanism,
/// and rows = pivots + redundant equations, those of loops and below them one for each follower.
///
///     joint (loops)       ranges of ── column, pitch, own     [ joint 0: successor's side | predecessor's side | joint 1 … ]
///                                   ── element                [ numbers of joint 0 | of joint 1 | … | of followers: 1 and −r each ]
///                                   ── through                [ joint 0: both sides | … ], places in crossed
///     pivot (pivots)      ranges of ── list                   columns, rows and later steps of each; then fill, and lists of patterns
///     pattern (rows − pivots)       ── list                   its loops, earlier patterns, joints
///
/// A place of K, (rows, nv): the step of a pivot's coordinate, or pivots + number among the independent ones.  place[v] says which, in signs.
template <class T> struct loop_view {
  int loops, rows, pivots, freedoms;
  bool drives_are_independent; ///< are the independent coordinates those of the drives
  bool steady; ///< are accelerations those at which independent coordinates have none, whatever is given
  int drives;
  const int *drive;     ///< (drives) their coordinates in v, where they are more than the freedoms
  const T *drive_scale; ///< of each, 1/√weight
  const closing_joint<T> *joint;
  const loop_column *column;
  const T *pitch; ///< of each column, of helical joints
  /// of each column that moves a successor relative to its parent: it, about the joint's frame and in its axes
  const screw<T> *own;
  const loop_element<T> *element; ///< those of such columns that differ from zero
  int first_coupling;             ///< the row of the first follower's equation; those of followers are the last rows
  int couplings_begin, couplings_end; ///< in `element`: those of followers' equations
  const loop_pivot *pivot;
  const int *list;
  /// in `list`, pairs of a row and a column: elements of K that are zero until elimination fills them
  int fill_begin, fill_end;
  const int *independent; ///< (freedoms) coordinates in v, ascending
  const int *place;       ///< (nv) of a coordinate among the independent ones, or −1 − its step
  const int *redundant;   ///< (rows − pivots) equations
  int crossings, compliances;
  bool crosses_welds;
  const int *crossed; ///< (crossings) joints of the tree that wrenches of loops pass through, by their child links
  const int *through; ///< places in `crossed`, from the link outwards that both ends of a loop have in common
  const joint_compliance_view<T> *compliance;
  const int *compliance_of;          ///< (crossings + loops) the compliance of each joint, or −1
  const loop_pattern *pattern;       ///< of each redundant equation
  const T *row_scale, *column_scale; ///< (rows), (nv): all terms become lengths
  T length;
  T tolerance; ///< how far a state may be from a closed one, relative to lengths
};

} // namespace ksl
