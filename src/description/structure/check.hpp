// Checks that a description is a mechanism, and that its inertias are physically possible.
#pragma once

#include "ksl/engine/model/description.hpp"

#include <set>

namespace ksl {

/// Throws description_error unless the links form one tree: names unique, every joint between two links, one root, no
/// cycle, no link with two parents, no negative mass, all axes of length 1; and for loop joints that
/// can't close a loop of it (loops.hpp).  Returns the index of the root link.
int check_tree(const robot_description &robot);

/// A line for each link whose inertia no rigid body can have: mass without negative sign, inertia matrix about the
/// centroid positive semidefinite, principal moments within the triangle inequality, to a relative tolerance of 1e-6
/// of the largest moment; mass and moments that a machine can have.  Rotors, which the physics "rotor bodies" adds, are left out.
std::vector<std::string> check_inertias(const robot_description &robot);

/// What no inertia can be, as the end of a sentence about its link; empty if there is nothing: a mass that is negative, a number that
/// is not finite.
std::string number_fault(const spatial_inertia<double> &inertia);

/// The principal moments about the centroid, in ascending order.  The mass must not be zero.
std::array<double, 3> principal_moments(const spatial_inertia<double> &inertia);

/// A line for each link that moves, has geometry and has no mass, since its weight would be missing without notice.  A link
/// moves if a joint that isn't fixed carries it, directly or through welded links, or if the root floats.  Links named in
/// `with_payload` have a mass.  Throws description_error if links move and none of them has a mass; with `masses_optional`
/// this gives a single line instead.  The links must form a tree.
std::vector<std::string> check_masses(const robot_description &robot, bool floating_base,
                                      const std::set<std::string> &with_payload, bool masses_optional);

/// How masses that are missing are given: in a URDF or SDF text, or by whatever else made the links.
std::string mend_of_masses(const robot_description &robot);

/// Adds these lines to the warnings.  If strict, throws description_error instead, with the first line and how to mend it.
void warn_of_links(robot_description &robot, const std::vector<std::string> &lines, bool strict,
                   const std::string &mend);

} // namespace ksl
