// KSL: the tolerances of closed mechanisms.  All solvers, closing, simulation, and Python (ksl._core.loop_tolerances) read them here.
// docs/loops.md, "Tolerances", is this table in words.
//
// Four errors follow from one another:
//
//     rounding    what double precision leaves of equations that have been solved: `closed`;
//     a state     how far open it may be: `accepted`.  The Jacobian of a state that is open by e is off by some e, and its singular values
//                 below `rank_by_opening` e are not known: they count as zero;
//     a file      frames that let a mechanism move but for `few_digits` are meant to let it move: they are made exact at load
//                 (src/engine/loops/exact_frames.hpp), or, where joints of the tree have few digits, equations agree to t.digits only, and
//                 what agrees to `rank_by_digits` of that counts as equal;
//     the rest    is named at load.
//
// "Lengths" are those of the mechanism (src/engine/loops/tables.hpp), which follow from its joints and masses: angles count as lengths times it.
#pragma once

namespace ksl::loop_tolerance {

// Positions, in lengths.
inline constexpr double closed = 1e-12;                          ///< equations of loops are solved
inline constexpr double accepted = 1e-6, accepted_single = 1e-3; ///< states of a call are closed
inline constexpr double corrected = 1e-2; ///< states of a call are closed where their errors are corrected (stabilise=)
/// frames are meant to be exact: half of the fourth decimal of an angle, rad
inline constexpr double few_digits = 5e-5;
inline constexpr double nearly_moves = 2e-2; ///< frames of a mechanism that nearly moves: they are named

// Rates.
/// states, and motions that are asked for: the terms of an equation before they cancel
inline constexpr double rates = accepted;
/// rates that are rounding whatever the terms are: lengths per second, or second squared
inline constexpr double at_rest = closed;
inline constexpr double rates_between_steps = 1e-14; ///< velocities that simulation takes as closed: the terms

// Ranks: pivots and singular values of the scaled equations, all of whose terms are lengths, so that the largest is 1 or more.
inline constexpr double rank = 1e-9; ///< the largest term
/// the opening of the state, the digits of the file
inline constexpr double rank_by_opening = 100, rank_by_digits = 10;
inline constexpr double closed_by_digits = 3;   ///< how far open closed positions are, beside the digits of the file
inline constexpr double unsure = accepted;      ///< singular values that may be due to the error of a position
inline constexpr double nearly_singular = 1e-3; ///< Newton steps by elimination alone; positions that `ksl check` names
inline constexpr double plan_pivot = 1e-2;      ///< pivots of the plan of kernels
inline constexpr double plan_rest = rank, plan_rest_single = 1e-4; ///< what a plan leaves of redundant equations

// Inertias and patterns, beside the terms that made them.
/// the last: single states in double precision
inline constexpr double inertia = 1e-13, inertia_single = 1e-5, inertia_of_single = 1e-10;
inline constexpr double open_component = rank; ///< elements of patterns, whose norm is 1

} // namespace ksl::loop_tolerance
