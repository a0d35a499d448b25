// KSL: models that a program describes, link by link and joint by joint, or from a table of Denavit–Hartenberg
// parameters.
#pragma once

#include "ksl/model.hpp"

#include <map>
#include <string>
#include <vector>

namespace ksl {

/// Mass, kg; centre of mass in the link's axes, m; inertia about the centre of mass in the link's axes, kg m².
struct link_mass {
  double mass = 0;
  vec3<double> center_of_mass{};
  mat3x3<double> inertia{};
};

/// What a joint may have besides kind, links and pose.  Vectors are in the joint's frame and of any length.
struct joint_options {
  /// kinds with an axis, or with two, need them (planar: z if not given); others must not have them
  std::optional<vec3<double>> axis, axis2;
  optional_number pitch;            ///< m/rad, positive for a right-handed screw; helical joints need it
  optional_number lower, upper;     ///< of its first number, rad or m
  optional_number effort, velocity; ///< N m or N; rad/s or m/s
  /// of each coordinate (joint_description has the units); model_options::physics applies them
  double damping = 0, friction = 0;
  std::optional<mimic_description> mimic; ///< the joint that it follows, which may be added later
  optional_number friction_width;         ///< rad/s or m/s
  double armature = 0, rotor_inertia = 0, gear_ratio = 1;
  double spring_stiffness = 0, spring_rest = 0; ///< of joints with one coordinate
  /// limits of its second and third number: cylindrical, universal, planar, translation
  std::array<coordinate_limits, 2> further;
};

/// What a joint that closes a loop may have besides kind, links and frames, as joint_options.
struct loop_options {
  std::optional<vec3<double>> axis, axis2; ///< with equal components in the frames on both links
  optional_number pitch;
};

/// A row of a table of Denavit–Hartenberg parameters: m and rad.
struct dh_row {
  double a = 0, alpha = 0, d = 0, theta = 0; ///< theta is added to q of a revolute joint, d to q of a prismatic one
  joint_kind kind = joint_kind::revolute;    ///< revolute, continuous or prismatic
  link_mass mass;                            ///< in the axes of the row's frame
  joint_options options;                     ///< limits and losses; the axis is the table's
};

/// Where frame i is: after the transformation Rz(theta) Tz(d) Tx(a) Rx(alpha), at the end of link i (Denavit and
/// Hartenberg, 1955); or after Rx(alpha) Tx(a) Rz(theta) Tz(d), at its start (Craig, Introduction to Robotics, 3.4).
enum class dh_convention { standard, modified };

/// How strictly a description is judged.
struct check_options {
  bool strict = false;          ///< warnings about inertias and masses are errors
  bool masses_optional = false; ///< moving links of which none has a mass are no error
};

/// Collects links and joints.  A call throws description_error for what it is given, build for what is missing;
/// messages name the link or joint, what was found and how to mend it.  After an exception it holds what it held before.
class KSL_EXPORT builder {
public:
  explicit builder(std::string name, std::array<double, 3> gravity = {0, 0, -9.81});

  /// For readers of other formats: the file that messages name, a line for each kind of content that isn't carried over, and
  /// warnings, a line each.
  builder &read_from(const std::string &file, const std::vector<std::string> &unused,
                     const std::vector<std::string> &warnings = {});

  /// The link that no joint carries is the root.
  builder &add_link(const std::string &name, const link_mass &mass = {});

  /// pose: of the joint in the parent link; the child link's frame is the joint's.  Both links have been added before.
  builder &add_joint(const std::string &name, joint_kind kind, const std::string &parent, const std::string &child,
                     const SE3<double> &pose, const joint_options &options = {});

  /// A joint that closes a loop, of any kind but floating, between two links that have been added before.  predecessor_pose, successor_pose:
  /// of its frame on either side, in that link's frame; where the loop is closed and its position is zero, they coincide.
  builder &add_loop(const std::string &name, joint_kind kind, const std::string &predecessor,
                    const std::string &successor, const SE3<double> &predecessor_pose,
                    const SE3<double> &successor_pose, const loop_options &options = {});

  /// A spring, damper or cylinder between two points, each in the frame of a link that has been added before.  It has no effect unless
  /// physics_options name force elements.
  builder &add_force_element(const std::string &name, const std::string &link1, const vec3<double> &point1,
                             const std::string &link2, const vec3<double> &point2,
                             const force_element_numbers &numbers = {});

  /// The joints that have a motor.  Inverse dynamics of mechanisms with loops need to know them.
  builder &set_drives(const std::vector<std::string> &joints, const std::vector<double> &weights = {});

  /// Adds joint1, link1, joint2, link2, … to a link, names after the prefix.  The frame of link i is that of row i.
  builder &add_dh_chain(const std::string &parent, const std::vector<dh_row> &rows, dh_convention convention,
                        const std::string &prefix = "");

  /// What has been added.  Throws unless the links form one tree.  Inertias that no body can have are warnings, or
  /// errors if strict.
  robot_description description(const check_options &how = {}) const;

  /// The model of that, with the checks and options of ksl::load.
  model build(const model_options &options = {}, const check_options &how = {}) const;

private:
  void cut_to(std::size_t links, std::size_t joints) noexcept;
  int link_named(const std::string &who, const std::string &end, const std::string &name) const;

  robot_description robot_;
  std::map<std::string, int> links_, joints_; // joints of loops are among these
};

/// The model of a description, with the checks that ksl::load makes of what it has read: whether links that move have a
/// mass.
KSL_EXPORT model model_of(robot_description robot, const model_options &options = {}, const check_options &how = {});

/// The kind of that name or other name (joint_kind_row).  Throws description_error, naming the known ones.
KSL_EXPORT joint_kind joint_kind_named(const std::string &name);

} // namespace ksl
