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

/// These joints become fixed ones at these positions; their names and the links are kept.  Followers (mimic joints) become fixed with
/// their leaders, where these hold them, and not alone.
KSL_EXPORT robot_description with_frozen_joints(const robot_description &robot,
                                                const std::vector<frozen_joint> &joints);

/// A rigid body is welded to a link.
KSL_EXPORT robot_description with_payload(const robot_description &robot, const std::string &link,
                                          const link_mass &payload);

/// The root of another robot is welded to a link, at `pose` in that link's frame, by a joint PREFIXmount; if it floats,
/// it floats there, on a joint PREFIXfloating_base.  The names of its links and joints get the prefix.  Both must have
/// the same gravity.
KSL_EXPORT robot_description merged(const robot_description &robot, const robot_description &other,
                                    const std::string &parent_link, const SE3<double> &pose,
                                    const std::string &prefix = "");

/// The links that a link carries, and itself as the root, which is fixed unless it is that of a robot that floats.
/// A follower among them needs its leader there.
KSL_EXPORT robot_description subtree(const robot_description &robot, const std::string &link);

/// Adds a frame: a massless link welded to another by a joint NAME_joint.
KSL_EXPORT robot_description with_frame(const robot_description &robot, const std::string &name,
                                        const std::string &link, const SE3<double> &pose);

} // namespace ksl
