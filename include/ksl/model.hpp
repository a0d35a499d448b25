// KSL: a model with its arrays and the names of joints and links, and the workspace for one computation with it.
#pragma once

#include "ksl/engine/model.hpp"
#include "ksl/engine/description.hpp"
#include "ksl/engine/joints.hpp"

#include <array>
#include <cstddef>
#include <memory>
#include <new>
#include <string>
#include <vector>

namespace ksl {

/// A point mass fixed to a link.
struct payload {
  std::string link;
  double mass = 0;                ///< kg
  std::array<double, 3> point{};  ///< in the link's frame, m
};

/// Which physics of joints a model has, besides that of rigid bodies.  None by default: the quantities of the textbook.
struct physics_options {
  bool damping = false, friction = false, armature = false, rotor = false, spring = false;
  /// Dry friction has full strength at any speed but zero, instead of the smooth law.  For inverse dynamics only.
  bool exact_friction = false;
  double friction_width = 0.01; ///< of the smooth law, rad/s or m/s; for joints that have none of their own
};

struct model_options {
  /// The root link floats: a first joint `floating_base` with q = [x y z qx qy qz qw] and v = [linear, angular] in its
  /// frame.  If the description has a joint of that name, it is called `floating_root` instead, and a warning says so.
  bool floating_base = false;
  std::array<double, 3> gravity{0, 0, -9.81}; ///< m/s², world axes
  std::vector<payload> payloads;
  physics_options physics;
};

/// A joint as a user sees it.  Every link is carried by exactly one joint.  For a fixed root it is called `base`, or `ground` if
/// the description has a joint named `base`.
struct joint_row {
  std::string name;
  joint_kind kind;
  int link;              ///< the child link
  int parent_link;       ///< −1: the ground
  int q_index, v_index;  ///< where its numbers in q and v begin; −1 for fixed joints
  vec3<double> axis;     ///< unit vector in the joint's frame; for kinds that have one (joint_kind_row)
  vec3<double> axis2;    ///< second axis of universal joints, fixed in the child: a unit vector in the joint's frame
  double pitch;          ///< m/rad; of helical joints
  int description;       ///< index into robot_description::joints; −1 for base and floating_base
};

/// A mechanism, immutable after construction, shared between threads.
class KSL_EXPORT model {
public:
  /// Builds the arrays.  Throws description_error if the description is not a tree.
  explicit model(robot_description robot, const model_options &options = {});

  int nq() const { return nq_; }
  int nv() const { return nv_; }

  /// All joints: the moving ones in the order of q (depth first, children in file order), then the fixed ones, `base` last.
  const std::vector<joint_row> &joints() const { return joints_; }
  int moving_joints() const { return moving_joints_; }

  /// A unit quaternion [x y z w] in q: where it begins, and the joint that it belongs to.
  struct quaternion_in_q {
    int q_index;
    int joint; ///< index into joints()
  };
  const std::vector<quaternion_in_q> &quaternions() const { return quaternions_; }

  /// Links, parents first, with name and inertia, payload included.
  const std::vector<link_description> &links() const { return links_; }

  /// Index of a name, or −1.
  int find_joint(const std::string &name) const;
  int find_link(const std::string &name) const;

  /// Is dry friction discontinuous at rest?  Forward dynamics and derivatives are then undefined.
  bool exact_friction() const { return exact_friction_; }

  /// The description that the model was built from, in file order.
  const robot_description &description() const { return description_; }

  /// The arrays that algorithms run on, in double and in single precision; valid as long as the model lives.
  model_view<double> view() const { return double_.view(nq_, nv_, pose_numbers_); }
  model_view<float> view_single() const { return single_.view(nq_, nv_, pose_numbers_); }
  template <class S> model_view<S> view_in() const {
    if constexpr (sizeof(S) == sizeof(double))
      return view();
    else
      return view_single();
  }

private:
  /// Bodies, links and gravity in one precision.
  template <class S> struct arrays {
    std::vector<ksl::body<S>> bodies;
    std::vector<ksl::link<S>> links;
    vec3<S> gravity;
    std::vector<S> inertia, theta0_sine, theta0_cosine; // contiguous, for lanes
    std::vector<coordinate_physics<S>> physics; // (nv), or empty
    int first_angle = 0, angles_end = 0;

    model_view<S> view(int nq, int nv, int pose_numbers) const {
      return {static_cast<int>(bodies.size()), static_cast<int>(links.size()), nq, nv, pose_numbers, gravity, bodies.data(),
              links.data(), inertia.data(), theta0_sine.data(), theta0_cosine.data(), first_angle, angles_end, physics.empty() ? nullptr : physics.data()};
    }
  };

  robot_description description_;
  std::vector<joint_row> joints_;
  std::vector<quaternion_in_q> quaternions_;
  std::vector<link_description> links_;
  arrays<double> double_;
  arrays<float> single_;
  int nq_ = 0, nv_ = 0, pose_numbers_ = 0, moving_joints_ = 0;
  bool exact_friction_ = false;

  friend class model_builder;
};

/// The workspace of a computation, and the only object that calls modify.  It is one block of memory, large enough for any
/// algorithm (engine/workspace.hpp), and is allocated by the constructor only.  Each thread needs a workspace of its own.  In
/// debug builds fresh memory is NaN.
class KSL_EXPORT data {
public:
  explicit data(const model &m);

  void *memory() { return memory_.get(); }
  std::size_t bytes() const { return bytes_; }

  /// nv zeros, for calls without velocity or acceleration.
  template <class S> const S *zero() const {
    if constexpr (sizeof(S) == sizeof(double))
      return zero_.data();
    else
      return zero_single_.data();
  }

private:
  static constexpr std::align_val_t alignment{64};
  struct aligned_delete {
    void operator()(void *p) const { ::operator delete(p, alignment); }
  };
  std::size_t bytes_;
  std::unique_ptr<void, aligned_delete> memory_;
  std::vector<double> zero_;
  std::vector<float> zero_single_;
};

} // namespace ksl
