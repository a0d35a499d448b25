// A workspace that owns its memory, for any scalar: the one place where tests lay out the arrays of data_view.
#pragma once

#include "ksl/engine/forward_dynamics.hpp"

#include <vector>

template <class T> class owned_workspace {
public:
  explicit owned_workspace(const ksl::model_view<ksl::scalar_of<T>> &m)
      : in_parent_(m.bodies), in_world_(m.bodies), sine_(ksl::room_for_angles(m.nq)), cosine_(sine_.size()),
        motion_(ksl::room_for<T>(9, m.bodies)), wrench_(ksl::room_for<T>(6, m.bodies)), rotation_(motion_.size()),
        inertia_(ksl::room_for<T>(21, m.bodies)), offset_(m.bodies), axis_(m.bodies), twist_(m.bodies),
        articulated_(m.bodies), link_wrench_(m.links) {}

  ksl::data_view<T> view() {
    return {in_parent_.data(), in_world_.data(), sine_.data(),  cosine_.data(), motion_.data(),      wrench_.data(),    rotation_.data(),
            inertia_.data(),   offset_.data(),   axis_.data(), twist_.data(),  articulated_.data(), link_wrench_.data()};
  }

private:
  std::vector<ksl::SE3<T>> in_parent_, in_world_;
  std::vector<T> sine_, cosine_, motion_, wrench_, rotation_, inertia_;
  std::vector<ksl::vec3<T>> offset_;
  std::vector<ksl::joint_axis<T>> axis_;
  std::vector<ksl::screw<T>> twist_;
  std::vector<ksl::articulated_state<T>> articulated_;
  std::vector<ksl::coscrew<T>> link_wrench_;
};
