// KSL: a robot as a file or a program describes it: links, joints, names.  Not made for speed; the constructor of ksl::model
// (ksl/model.hpp) converts it to the arrays that algorithms run on.
#pragma once

#include "ksl/algebra.hpp"
#include "ksl/engine/model/description_error.hpp"
#include "ksl/engine/model/joint.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace ksl {

/// A position in a file; line 0 if it was not read from a file.
struct file_position { int line = 0; };

/// A rotation in the numbers that a file gives, from which its matrix was computed.
struct given_rotation {
  enum form { none, rpy, quaternion } by = none; ///< none: the identity, or a matrix that a program gave
  std::array<double, 4> numbers{};               ///< roll, pitch, yaw; or x, y, z, w
};

/// An inertia in the numbers that a file or a program gives, from which the one about the link's origin was computed.
struct given_inertia {
  double mass = 0;
  vec3<double> center_of_mass{};   ///< in the link's axes
  given_rotation axes;             ///< those of `moments`, seen from the link's
  std::array<double, 6> moments{}; ///< Ixx Iyy Izz Ixy Iyz Izx about the centre of mass
};

struct link_description {
  std::string name;
  file_position at;
  /// Mass (kg), first moment (kg m) and inertia (kg m²) about the link's origin, in the link's axes; zero without <inertial>.
  spatial_inertia<double> inertia{};
  bool has_inertial = false;
  bool has_geometry = false; ///< has the link visual or collision geometry in the file
  /// What `inertia` was computed from, so that it is written with the same digits; of no effect once `inertia` is another.
  std::optional<given_inertia> given;
};

/// The numbers from which those of a joint were computed, so that they are written with the same digits; of no effect on what
/// has been changed since.
struct given_joint {
  given_rotation rotation;      ///< of its placement
  vec3<double> axis{}, axis2{}; ///< of any length; zero: not known
  double pitch = 0;             ///< metres a revolution
};

/// A limit or property that a file may omit.
using optional_number = std::optional<double>;

/// A joint that moves as another one does: position = multiplier × that joint's position + offset (rad or m).
struct mimic_description {
  std::string joint; ///< the other joint's name; it may mimic a third
  double multiplier = 1, offset = 0;
  file_position at;
};

/// Bounds of one number of a joint's position.
struct coordinate_limits {
  optional_number lower, upper; ///< rad or m
};

/// How many numbers of a joint's position can have bounds: that of joints with one coordinate, but not of continuous ones, and those of
/// other joints, unless they are quaternions.
inline int numbers_with_limits(const joint_kind_row &row) {
  return row.nv == 1 ? row.has_limits : row.nv > 1 && row.quaternion < 0 ? row.nq : 0;
}

struct joint_description {
  std::string name;
  file_position at;
  joint_kind kind = joint_kind::fixed;
  int parent = -1, child = -1; ///< indices into robot_description::links
  SE3<double> placement{};     ///< the joint's frame (the child link's at q = 0) in the parent link's frame
  /// unit vector in the joint's frame, for kinds that have one (joint_kind_row); zero: the usual
  /// one of the kind, which is x, but z for planar joints
  vec3<double> axis{0, 0, 0};
  vec3<double> axis2{0, 0, 0}; ///< likewise the second axis of universal joints, which must give it; fixed in the child
  optional_number pitch;       ///< m/rad; for kinds that have one (joint_kind_row), which must give it
  optional_number lower, upper;             ///< of its first number, rad or m
  std::array<coordinate_limits, 2> further; ///< of its second and third, for kinds with several (numbers_with_limits)
  optional_number effort;                   ///< N m or N
  optional_number velocity;                 ///< rad/s or m/s
  double damping = 0;                       ///< of each coordinate, N m s/rad or N s/m
  double friction = 0;                      ///< dry friction of each coordinate, N m or N
  /// of its smooth law (joint_physics.hpp), rad/s or m/s; physics_options has one for all others
  optional_number friction_width;
  double armature = 0;         ///< inertia that each coordinate feels besides that of the links, kg m² or kg
  double rotor_inertia = 0;    ///< of the motor's rotor about its own axis, kg m²
  double gear_ratio = 1;       ///< turns of the rotor for each of the joint; rad/m where the joint slides
  double spring_stiffness = 0; ///< N m/rad or N/m; of joints with one coordinate
  double spring_rest = 0;      ///< position where the spring is slack, rad or m
  bool is_rotor = false;       ///< does it carry the rotor of the joint that it mimics (physics_options::rotor_bodies)
  std::optional<mimic_description> mimic; ///< of joints with one coordinate
  given_joint given;
};

/// The numbers from which those of a joint that closes a loop were computed, as given_joint.
struct given_loop {
  given_rotation predecessor, successor; ///< of its frames
  vec3<double> axis{}, axis2{};
  double pitch = 0;
};

/// A joint that closes a loop: it connects two links that the tree of joints connects already.  It is of any kind but floating, and has a
/// frame on either link; both frames coincide where its position is zero.  Axes have the same components in both.
struct loop_description {
  std::string name; ///< unlike those of all other joints, of the tree and of loops
  file_position at;
  joint_kind kind = joint_kind::fixed;
  /// indices into robot_description::links: the sides that a file calls parent and child
  int predecessor = -1, successor = -1;
  SE3<double> predecessor_pose{}, successor_pose{}; ///< of the joint's frame on each side, in the link's frame
  vec3<double> axis{0, 0, 0}, axis2{0, 0, 0};       ///< as in joint_description
  optional_number pitch;                            ///< m/rad
  given_loop given;
  double turned = 0, moved = 0; ///< rad and m, by which frames that were off by a file's digits have been made exact
};

/// The numbers of a force element between two points at a distance l.  It pulls them together, or with a negative force apart, with
///     preload + stiffness (l − free_length) + damping dl/dt,
/// and beyond its limits with stop_stiffness (l − limit) more.
struct force_element_numbers {
  double stiffness = 0;         ///< N/m
  double free_length = 0;       ///< m
  double damping = 0;           ///< N s/m
  double preload = 0;           ///< N
  optional_number lower, upper; ///< limits of the length, m
  double stop_stiffness = 0;    ///< N/m of one-sided stops at the limits; 0: a length beyond them is refused
};

/// A spring, damper or cylinder between a point of one link and a point of another.
struct force_element_description {
  std::string name; ///< unlike those of all other force elements
  file_position at;
  int link1 = -1, link2 = -1;      ///< indices into robot_description::links
  vec3<double> point1{}, point2{}; ///< in the links' frames, m
  force_element_numbers numbers;
};

/// How a joint, of the tree or of a loop, gives way under its wrench: what splits reactions that rigid bodies leave open.
struct joint_compliance {
  std::string joint; ///< empty: what fixes the root to the ground, whose name depends on those of the robot's joints
  /// (6, 6) by rows, symmetric and positive semidefinite: displacement, m and rad, for a wrench, force first, at the joint's frame on the child's
  /// side, in its axes.  Zero where the joint is rigid.
  std::array<double, 36> matrix{};
  /// (6, 6) by rows, the same way: Σ u uᵀ over the directions u in which nothing resists, so that no wrench is transmitted along them.
  std::array<double, 36> loose{};
};

/// The bounds of number c of the joint's position.
inline coordinate_limits limits_of(const joint_description &joint, int c) {
  return c == 0 ? coordinate_limits{joint.lower, joint.upper} : joint.further[static_cast<std::size_t>(c - 1)];
}

/// Which physics of joints a model has, besides that of rigid bodies.  None by default: the quantities of the textbook.
struct physics_options {
  bool damping = false, friction = false, armature = false, rotor = false, spring = false;
  bool force_elements = false; ///< springs, dampers and cylinders between points of two links
  /// Rotors are bodies, which turn with the joint's parent link, instead of inertia of the joint's coordinate (with_rotors).
  bool rotor_bodies = false;
  /// Dry friction has full strength at any speed but zero, instead of the smooth law.  For inverse dynamics only.
  bool exact_friction = false;
  double friction_width = 0.01; ///< of the smooth law, rad/s or m/s; for joints that have none of their own
};

/// All that a model is made of: a model of the description of another is a copy of it.
struct robot_description {
  std::string name;
  std::string file; ///< as given to the reader; empty for a robot built in a program
  std::vector<link_description> links;
  std::vector<joint_description> joints;                 ///< in the order of the file: a tree
  std::vector<loop_description> loops;                   ///< what closes loops of it
  std::vector<force_element_description> force_elements; ///< between points of two links
  /// Joints that have a motor.  None: they are not known, which inverse dynamics of a mechanism with loops needs.  Without loops every
  /// joint is taken to have one.
  std::optional<std::vector<std::string>> drives;
  /// The weight of each drive: where drives are more than freedoms, efforts are those with the least sum of weight × effort².  Empty: all 1.
  std::vector<double> drive_weights;
  std::vector<joint_compliance> compliances;  ///< of some joints; the others are rigid
  std::array<double, 3> gravity{0, 0, -9.81}; ///< m/s², world axes; files don't give it
  physics_options physics;                    ///< of the joints; files don't say so
  bool floating_base = false;                 ///< does the root float (model_options); files don't say so
  std::vector<std::string> unused;            ///< a line for each kind of content that KSL doesn't use
  std::vector<std::string> warnings; ///< a line for each thing that is suspicious but used, with link and condition
};

} // namespace ksl
