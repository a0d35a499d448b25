// KSL: robots made from other robots.  Each function takes a description, which a model has (model::description), and
// returns another; ksl::model makes the model of it.  All throw description_error, which names the link or joint and
// how to mend it.
#pragma once

#include "ksl/builder.hpp"

namespace ksl {

/// The same robot with another root.  The joints between the two roots are reversed: parent and child change places,
/// and the axis its direction, so that q, v, effort and limits of every joint keep their values and meaning.  Links
/// keep their frames: the child of a reversed joint is therefore a massless link NAME_frame at the joint, to which the
/// link that was its parent is welded.  Joints on that path must be fixed or move on one axis.  A root that is fixed is
/// at the world's origin, with its axes; one that floats floats.
KSL_EXPORT robot_description with_root(const robot_description &robot, const std::string &link);

/// A joint and its position, as many numbers as its kind has in q.
struct frozen_joint {
  std::string joint;
  std::vector<double> q;
};

/// Fixes joints at the given positions; their names and the links are kept.  Followers (mimic joints) are fixed with their leaders, at
/// the positions that follow from these.  A follower can't be fixed alone.  Joints that close loops have no positions, and can't be
/// fixed; drives that are fixed are drives no more.
KSL_EXPORT robot_description with_frozen_joints(const robot_description &robot,
                                                const std::vector<frozen_joint> &joints);

/// Welds a rigid body to a link.
KSL_EXPORT robot_description with_payload(const robot_description &robot, const std::string &link,
                                          const link_mass &payload);

/// Welds the root of another robot to a link, at `pose` in that link's frame, by a joint PREFIXmount.  If the other robot
/// floats, it then floats there, on a joint PREFIXfloating_base.  The names of its links and joints get the prefix.  Both
/// robots must have the same gravity.  Where only one of them says which joints have a motor, those of the other are all of its joints
/// if it has no loops; else the drives of both are unknown.
KSL_EXPORT robot_description merged(const robot_description &robot, const robot_description &other,
                                    const std::string &parent_link, const SE3<double> &pose,
                                    const std::string &prefix = "");

struct subtree_options {
  /// loops and force elements that lose an end are left out, instead of being refused: the rest is another machine
  bool drop_loops = false;
};

/// A robot of a link and all that it carries.  The link is the root; it is fixed unless it is the root of a robot that floats.
/// If a follower (mimic joint) belongs to it, its leader must, too; likewise both ends of a loop.
KSL_EXPORT robot_description subtree(const robot_description &robot, const std::string &link,
                                     const subtree_options &options = {});

/// Adds a frame: a massless link welded to another by a joint NAME_joint.
KSL_EXPORT robot_description with_frame(const robot_description &robot, const std::string &name,
                                        const std::string &link, const SE3<double> &pose);

/// Adds joints that close loops; their links are indices into robot.links.
KSL_EXPORT robot_description with_loops(robot_description robot, std::vector<loop_description> loops);

/// Adds springs, dampers and cylinders between points of two links, which are indices into robot.links.
KSL_EXPORT robot_description with_force_elements(robot_description robot,
                                                 std::vector<force_element_description> elements);

/// The robot with its loops cut: without the joints that close them, and without drives.
KSL_EXPORT robot_description without_loops(robot_description robot);

/// Gives joints compliance, in place of what they had.  Reactions of mechanisms with loops are then those of least energy.
KSL_EXPORT robot_description with_compliances(robot_description robot, std::vector<joint_compliance> compliances);

/// Says which joints have a motor, in place of what the robot says.  weights: of each, of the squares of efforts where these are more than
/// the freedoms; empty: all 1.
KSL_EXPORT robot_description with_drives(robot_description robot, std::vector<std::string> joints,
                                         std::vector<double> weights = {});

} // namespace ksl
