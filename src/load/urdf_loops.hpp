// Reads the elements of URDF files that close loops.  <constraint> is that of the proposal for urdfdom (ros/urdfdom 264), <loop_joint>
// that of Isaac Sim and older versions of Drake, <loop> and <coupling> those of URDF+ (arXiv 2411.19753).
#pragma once

#include "load/urdf_names.hpp"
#include "text/unused.hpp"

#include <set>
#include <string>

namespace ksl::readers {

/// Is this <constraint>, <loop_joint> or <loop>?
bool is_loop(std::string_view tag);

/// Would another reader close a loop by this element, which is named otherwise here: <Constraint>, <ros:loop_joint>?
bool is_foreign_loop(std::string_view tag);

/// The joint of a <constraint>, <loop_joint> or <loop>.  minor: of the URDF version 1.minor.
loop_description loop_in(const element &loop, const links_by_name &links, int minor, text::unused_list &unused);

/// A <force_element>, which is KSL's own: numbers as attributes, and in <link1 link="..." xyz="..."/> and <link2> a point of each link.
force_element_description force_element_in(const element &of, const links_by_name &links);

/// The joints that close loops, of those that have been read: links with several parents.  Those with motors, by their names, stay in the tree
/// where they can, since they are coordinates there.  The other joints are then a tree, if the file describes a mechanism.
void split_loops(robot_description &robot, const std::set<std::string> &motors, text::unused_list &unused);

/// The joint that moves each link: the nearest above it that isn't fixed, −1 if there is none.  The joints are a tree.
std::vector<int> moving_joints(const robot_description &robot);

/// A <coupling>: the joint that moves its successor turns `ratio` times as far as that which moves its predecessor.  It becomes a mimic
/// joint; couplings between chains of several joints are refused.  moving: of moving_joints.
void read_coupling(const element &coupling, robot_description &robot, const links_by_name &links,
                   const std::vector<int> &moving);

} // namespace ksl::readers
