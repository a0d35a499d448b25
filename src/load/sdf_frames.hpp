// The frames of an SDF model, and where they are: http://sdformat.org/tutorials?tut=pose_frame_semantics.
#pragma once

#include "load/sdf_values.hpp"
#include "text/element.hpp"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace ksl::readers::sdf {

inline const std::string own_frame = "__model__"; ///< what SDF calls a model's own frame in its scope

/// Frames by full name: "arm::hand" is frame hand of the nested model arm, "arm::__model__" that model's own frame, and "world"
/// the one that all poses lead to.
///
///     world ←─ A ←─ B ←─ C              ←─ relative_to; each frame has its pose X in the frame that it points to
///               ↖
///                 D ←─ E
///
/// The pose of E in C is (X_B X_C)⁻¹ X_D X_E, over A, the nearest frame that leads to both.
class frame_graph {
public:
  struct frame {
    std::string scope;       ///< what precedes the names below: "" or "arm::"
    std::string relative_to; ///< the frame in which `pose` is
    std::string attached_to; ///< the frame that it moves with; empty for links
    SE3<double> pose;
    element where; ///< for messages
  };

  /// Adds a frame.  Refuses a name that exists.
  void add(const std::string &full_name, frame f);

  bool has(const std::string &full_name) const { return frames_.count(full_name) > 0; }

  /// Moves a model so that one of its frames is at the pose that the file gives the model (placement_frame).
  void place_by(const std::string &model, const std::string &placement_frame, const element &where);

  /// The full name of what `name` means in a scope.  `role` says in messages what it is named for: "relative_to".
  std::string found(const std::string &scope, const std::string &name, const element &where,
                    const std::string &role) const;

  /// Pose of one frame in another, by full names.
  SE3<double> relative(const std::string &in, const std::string &of) const;

  /// The link that a frame moves with, or "world".
  std::string link_of(const std::string &full_name) const;

private:
  static constexpr int unknown = -1;
  struct place {
    std::string relative_to; ///< full name
    int depth;
  };

  int depth(const std::string &from) const;
  /// The pose of a frame in the world.  Those on the way are kept, so that all of a long chain take linear time.
  SE3<double> in_world(const std::string &full_name) const;
  /// As relative(), by the path over the nearest frame that leads to both.  None if the path has more than about `most` frames.
  std::optional<SE3<double>> relative_within(std::size_t most, const std::string &in, const std::string &of) const;
  const frame &at(const std::string &full_name) const { return frames_.find(full_name)->second; }

  std::map<std::string, frame> frames_;
  // found when they are asked for, after all frames have been added; poses in the world after all models have been
  // placed
  mutable std::map<std::string, place> places_;
  mutable std::map<std::string, SE3<double>> in_world_;
  mutable std::map<std::string, std::string> links_;
  std::vector<std::string> names_; ///< in the order of the file
};

SE3<double> product(const SE3<double> &a, const SE3<double> &b);
SE3<double> inverse(const SE3<double> &a);

} // namespace ksl::readers::sdf
