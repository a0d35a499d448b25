// Mimic joints: which joint leads each of them.
#pragma once

#include "ksl/engine/model/description.hpp"

#include <string>
#include <vector>

namespace ksl {

/// The joint that a follower moves with, and how: position = multiplier × that joint's + offset.
struct leader_of_joint {
  int joint = -1; ///< index into robot_description::joints; −1 for joints that follow no other
  double multiplier = 1, offset = 0;
};

/// The leader of each joint of the description.  Chains of followers are resolved, so that no leader is itself a follower.
/// Throws description_error if a leader doesn't exist or doesn't move, if a joint follows itself, directly or through others, and
/// if one of the two has not exactly one coordinate.
std::vector<leader_of_joint> leaders_of(const robot_description &robot);

/// A line for each joint whose coupling no machine has: a multiplier of 0, which holds it still, and numbers beyond 1e-9 to 1e9.
std::vector<std::string> check_couplings(const robot_description &robot);

} // namespace ksl
