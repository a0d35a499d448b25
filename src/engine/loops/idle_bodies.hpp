// Bodies that turn idly: a rod with balls at both ends turns about its own line, and nothing else moves.
#pragma once

#include "engine/loops/tables.hpp"
#include "engine/loops/tree_calls.hpp"

namespace ksl::loops {

/// Bodies that turn alone at a closed position q (nq): a motion of the mechanism turns each about a line while the drives and all other bodies stand still.
/// Bodies that have no mass, and at which no loop ends, may move with it: they are inside of its joints.
std::vector<idle_body> bodies_that_turn_alone(const model &m, const std::vector<double> &q);

/// Adds them to the tables.  Of those whose mass doesn't move, which are idle, a coordinate is kept independent, as those of drives are.
void keep(std::vector<idle_body> bodies, tables &t);

/// Sets out (nv), by which velocities turn an idle body about its line at q; jacobian: memory (6, nv).
void set_spin_row(const tree_calls &tree, void *rest, const idle_body &body, const double *q, double *jacobian,
                  double *out);

/// The angular acceleration of an idle body along its line.
double spin_rate(const tree_calls &tree, void *rest, const idle_body &body, const double *q, const double *v,
                 const double *a);

} // namespace ksl::loops
