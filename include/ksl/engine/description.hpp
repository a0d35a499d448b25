// KSL: a robot as a file or a program describes it: links, joints, names.  Nothing here is fast; make_model
// (engine/model.hpp) turns it into the arrays that algorithms run on.
#pragma once

#include "ksl/algebra.hpp"
#include "ksl/engine/joint.hpp"

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace ksl {

/// What is said when a description can't be read or is no mechanism.  The message names file, line, link or joint, what
/// is wrong and how to mend it.
struct KSL_EXPORT description_error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Where something stands in a file; line 0 for what was not read from one.
struct file_position {
  int line = 0;
};

struct link_description {
  std::string name;
  file_position at;
  /// Mass (kg), first moment (kg m) and inertia (kg m²) about the link's origin, in the link's axes; zero without <inertial>.
  spatial_inertia<double> inertia{};
  bool has_inertial = false;
  bool has_geometry = false; ///< the file shows its shape, for the eye or for collisions
};

/// A bound or property that a file may leave out.
using optional_number = std::optional<double>;

struct joint_description {
  std::string name;
  file_position at;
  joint_kind kind = joint_kind::fixed;
  int parent = -1, child = -1;   ///< indices into robot_description::links
  SE3<double> placement{};       ///< the joint's frame (the child link's at q = 0) in the parent link's frame
  vec3<double> axis{1, 0, 0};    ///< unit vector in the joint's frame; for kinds that have one (joint_kind_row)
  optional_number pitch;         ///< m/rad; for kinds that have one (joint_kind_row), which must give it
  optional_number lower, upper;  ///< rad or m
  optional_number effort;        ///< N m or N
  optional_number velocity;      ///< rad/s or m/s
  double damping = 0, friction = 0; ///< read and listed, never applied unless asked for
};

struct robot_description {
  std::string name;
  std::string file; ///< as given to the reader; empty for a robot built in a program
  std::vector<link_description> links;
  std::vector<joint_description> joints; ///< in the order of the file
  std::vector<std::string> unused;       ///< a line each: what the file holds and nothing here uses
  std::vector<std::string> warnings;     ///< a line each: what is odd and used all the same, with link and condition
};

} // namespace ksl
