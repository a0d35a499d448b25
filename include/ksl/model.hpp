// KSL: a model that owns its arrays and knows its names, and the workspace for one computation with it.
#pragma once

#include "ksl/engine/data.hpp"
#include "ksl/engine/description.hpp"

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace ksl {

/// A point mass fixed to a link.
struct payload {
  std::string link;
  double mass = 0;                ///< kg
  std::array<double, 3> point{};  ///< in the link's frame, m
};

struct model_options {
  /// The root link floats: a first joint `floating_base` with q = [x y z qx qy qz qw] and v = [linear, angular] in its
  /// frame.  It is called `floating_root`, and a warning says so, where the description has a joint of that name.
  bool floating_base = false;
  std::array<double, 3> gravity{0, 0, -9.81}; ///< m/s², world axes
  std::vector<payload> payloads;
};

/// A joint as a user names it.  Every link has just one that carries it; that of a fixed root is `base`, or
/// `ground` where the description has a joint of that name.
struct joint_row {
  std::string name;
  joint_kind kind;
  int link;              ///< the child link
  int parent_link;       ///< −1: the ground
  int q_index, v_index;  ///< where its numbers begin; −1 for fixed joints
  vec3<double> axis;     ///< unit vector in the joint's frame; for kinds with one axis
  int description;       ///< index into robot_description::joints; −1 for base and floating_base
};

/// A mechanism, immutable after construction, shared between threads.
class KSL_EXPORT model {
public:
  /// Builds the arrays.  Throws description_error where the description is no tree.
  explicit model(robot_description robot, const model_options &options = {});

  int nq() const { return nq_; }
  int nv() const { return nv_; }

  /// All joints: the moving ones in the order of q (depth first, children in file order), then the fixed ones, `base` last.
  const std::vector<joint_row> &joints() const { return joints_; }
  int moving_joints() const { return moving_joints_; }

  /// Links, parents first.  `links()[i].name` and its inertia, payload included.
  const std::vector<link_description> &links() const { return links_; }

  /// Index of a name, or −1.
  int find_joint(const std::string &name) const;
  int find_link(const std::string &name) const;

  /// The description that the model was built from, in file order.
  const robot_description &description() const { return description_; }

  /// The arrays that algorithms run on, in double and in single precision; valid as long as the model lives.
  model_view<double> view() const { return double_.view(nq_, nv_); }
  model_view<float> view_single() const { return single_.view(nq_, nv_); }

private:
  /// Bodies, links and gravity in one precision.
  template <class S> struct arrays {
    std::vector<ksl::body<S>> bodies;
    std::vector<ksl::link<S>> links;
    vec3<S> gravity;
    std::vector<S> inertia, after_sine, after_cosine; // side by side
    int first_angle = 0, angles_end = 0;

    model_view<S> view(int nq, int nv) const {
      return {static_cast<int>(bodies.size()), static_cast<int>(links.size()), nq, nv, gravity, bodies.data(), links.data(),
              inertia.data(), after_sine.data(), after_cosine.data(), first_angle, angles_end};
    }
  };

  robot_description description_;
  std::vector<joint_row> joints_;
  std::vector<link_description> links_;
  arrays<double> double_;
  arrays<float> single_;
  int nq_ = 0, nv_ = 0, moving_joints_ = 0;

  friend class model_builder;
};

/// Workspace of one computation; allocated here and nowhere else.  In debug builds fresh memory is NaN.
class KSL_EXPORT data {
public:
  explicit data(const model &m);
  data_view<double> view() {
    return {in_parent_.data(), in_world_.data(),   sine_.data(),    cosine_.data(), motion_.data(),      wrench_.data(),
            rotation_.data(),  inertia_.data(), offset_.data(), axis_.data(),
            twist_.data(),     articulated_.data(), link_wrench_.data()};
  }

  /// nv zeros: no velocity, no acceleration.
  const double *zero() const { return zero_.data(); }

private:
  std::vector<SE3<double>> in_parent_, in_world_;
  std::vector<double> sine_, cosine_, motion_, wrench_, rotation_, inertia_;
  std::vector<vec3<double>> offset_;
  std::vector<joint_axis<double>> axis_;
  std::vector<screw<double>> twist_;
  std::vector<articulated_state<double>> articulated_;
  std::vector<coscrew<double>> link_wrench_;
  std::vector<double> zero_;
};

} // namespace ksl
