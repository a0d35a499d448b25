// KSL: a robot as a file or a program describes it: links, joints, names.  Not made for speed; the constructor of ksl::model
// (ksl/model.hpp) converts it to the arrays that algorithms run on.
#pragma once

#include "ksl/algebra.hpp"
#include "ksl/engine/joint.hpp"

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace ksl {

/// Thrown if a description can't be read or is not a mechanism.  The message names file, line, link or joint, what is wrong and
/// how to mend it.
struct KSL_EXPORT description_error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A position in a file; line 0 if it was not read from a file.
struct file_position {
  int line = 0;
};

struct link_description {
  std::string name;
  file_position at;
  /// Mass (kg), first moment (kg m) and inertia (kg m²) about the link's origin, in the link's axes; zero without <inertial>.
  spatial_inertia<double> inertia{};
  bool has_inertial = false;
  bool has_geometry = false; ///< has the link visual or collision geometry in the file
};

/// A limit or property that a file may omit.
using optional_number = std::optional<double>;

struct joint_description {
  std::string name;
  file_position at;
  joint_kind kind = joint_kind::fixed;
  int parent = -1, child = -1;   ///< indices into robot_description::links
  SE3<double> placement{};       ///< the joint's frame (the child link's at q = 0) in the parent link's frame
  vec3<double> axis{0, 0, 0};    ///< unit vector in the joint's frame, for kinds that have one (joint_kind_row); zero: the usual
                                 ///< one of the kind, which is x, but z for planar joints
  vec3<double> axis2{0, 0, 0};   ///< likewise the second axis of universal joints, which must give it; fixed in the child
  optional_number pitch;         ///< m/rad; for kinds that have one (joint_kind_row), which must give it
  optional_number lower, upper;  ///< rad or m
  optional_number effort;        ///< N m or N
  optional_number velocity;      ///< rad/s or m/s
  double damping = 0;            ///< of each coordinate, N m s/rad or N s/m
  double friction = 0;           ///< dry friction of each coordinate, N m or N
  optional_number friction_width; ///< of its smooth law (joint_physics.hpp), rad/s or m/s; model_options has one for all others
  double armature = 0;           ///< inertia that each coordinate feels besides that of the links, kg m² or kg
  double rotor_inertia = 0;      ///< of the motor's rotor about its own axis, kg m²
  double gear_ratio = 1;         ///< turns of the rotor for each of the joint; rad/m where the joint slides
  double spring_stiffness = 0;   ///< N m/rad or N/m; of joints with one coordinate
  double spring_rest = 0;        ///< position where the spring is slack, rad or m
};

struct robot_description {
  std::string name;
  std::string file; ///< as given to the reader; empty for a robot built in a program
  std::vector<link_description> links;
  std::vector<joint_description> joints; ///< in the order of the file
  std::vector<std::string> unused;       ///< a line for each kind of content that KSL doesn't use
  std::vector<std::string> warnings;     ///< a line for each thing that is suspicious but used, with link and condition
};

} // namespace ksl
