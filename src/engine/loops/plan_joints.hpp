// What the joints of a plan are: their equations' directions, the columns of K that they have elements in, and the joints of the tree that
// their wrenches pass through.
#pragma once

#include "ksl/engine/model/loop_plan.hpp"

namespace ksl {
class model;
}

namespace ksl::loops {

/// Sets the joints of an empty plan, with columns, own columns, crossed joints and compliances; not yet which elements are numbers of the
/// model, whose places are those of pivots.
void add_joints(const model &m, loop_plan<double> &plan);

/// How equation i of a joint weighs a column of the successor's own coordinates.
double own_element(const closing_joint<double> &joint, int i, const screw<double> &own);

} // namespace ksl::loops
