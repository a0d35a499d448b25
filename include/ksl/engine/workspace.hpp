// KSL: workspaces, cut from one piece of memory.
#pragma once

#include "ksl/engine/body_lanes.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

/// Cuts arrays out of one piece of memory, aligned to 64 bytes; without memory it only measures.
class arena {
public:
  explicit arena(void *memory = nullptr) : next_(static_cast<char *>(memory)) {}

  template <class E> KSL_LANES E *take(int n) {
    char *const at = next_;
    const std::size_t bytes = (static_cast<std::size_t>(n) * sizeof(E) + 63) / 64 * 64;
    used_ += bytes;
    next_ = next_ ? next_ + bytes : nullptr;
    return reinterpret_cast<E *>(at);
  }
  std::size_t used() const { return used_; } ///< bytes

private:
  char *next_;
  std::size_t used_ = 0;
};

/// What any algorithm needs.
template <class T> struct data_workspace : data_view<T> {
  void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    const int n = model.bodies;
    const auto numbers = [&](int each, int of) { return memory.take<T>(room_for<T>(each, of)); };
    this->in_parent = memory.take<SE3<T>>(n);
    this->in_world = memory.take<SE3<T>>(n);
    this->sine = memory.take<T>(room_for_angles(model.nq));
    this->cosine = memory.take<T>(room_for_angles(model.nq));
    this->motion = numbers(9, n);
    this->wrench = numbers(6, n);
    this->rotation = numbers(9, n);
    this->inertia = numbers(21, n);
    this->offset = memory.take<vec3<T>>(n);
    this->axis = memory.take<joint_axis<T>>(n);
    this->twist = memory.take<screw<T>>(n);
    this->articulated = memory.take<articulated_state<T>>(n);
    this->link_wrench = memory.take<coscrew<T>>(model.links);
  }
};
template <class T> using inverse_dynamics_workspace = data_workspace<T>;
template <class T> using reactions_workspace = data_workspace<T>;
template <class T> using forward_dynamics_workspace = data_workspace<T>;
template <class T> using mass_matrix_workspace = data_workspace<T>;
template <class T> using frame_poses_workspace = data_workspace<T>;
template <class T> using energy_workspace = data_workspace<T>;
template <class T> using external_power_workspace = data_workspace<T>;

} // namespace KSL_ISA
} // namespace ksl
