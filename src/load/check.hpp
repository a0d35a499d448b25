// Is a description a mechanism, and are its bodies bodies?
#pragma once

#include "ksl/engine/description.hpp"

namespace ksl {

/// Throws description_error unless the links form one tree: names unique, every joint between two links, one root, no
/// cycle, no link with two parents, no negative mass.  Returns the index of the root link.
int check_tree(const robot_description &robot);

/// A line for each link whose inertia no rigid body can have: mass without negative sign, inertia matrix about the
/// centroid positive semidefinite, principal moments within the triangle inequality, to a relative tolerance of 1e-6
/// of the largest moment.
std::vector<std::string> check_inertias(const robot_description &robot);

} // namespace ksl
