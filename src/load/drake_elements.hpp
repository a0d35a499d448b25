// Elements of Drake between two bodies, which URDF and SDF files have: its documentation of both formats describes them.
//
//     URDF    <drake:linear_spring_damper> <drake:linear_spring_damper_body_A name="arm"/> <drake:linear_spring_damper_p_AP value="0 0 1"/> …
//     SDF     <drake:linear_spring_damper> <drake:linear_spring_damper_body_A>arm</…> <drake:linear_spring_damper_p_AP>0 0 1</…> …
#pragma once

#include "text/element.hpp"

#include "ksl/engine/model/description.hpp"

#include <functional>
#include <set>

namespace ksl::readers {

/// The index of the link that a child element of Drake's names; refuses others.
using link_lookup = std::function<int(const text::element &child, const std::string &name)>;

/// <drake:ball_constraint>: a spherical joint that closes a loop, at a point of each body.  Values stand in attributes in URDF, and as text in SDF.
loop_description ball_constraint_in(const text::element &at, const link_lookup &link);

/// <drake:linear_spring_damper>: a force element.
force_element_description spring_damper_in(const text::element &at, const link_lookup &link);

bool is_drake_element(std::string_view tag);

/// Adds such an element to the robot; of those that close loops only `with_loops`.  `taken`: the names of all joints and force elements,
/// to which its own is added.
void add_drake_element(const text::element &at, const link_lookup &link, bool with_loops, std::set<std::string> &taken,
                       robot_description &robot);

} // namespace ksl::readers
