// KSL: a model with its arrays and the names of joints and links, and the workspace for one computation with it.
#pragma once

#include "ksl/engine/model/coupling.hpp"
#include "ksl/engine/model/loop_plan.hpp"
#include "ksl/engine/model/model.hpp"
#include "ksl/engine/model/description.hpp"
#include "ksl/engine/model/joints.hpp"
#include "ksl/result_error.hpp"

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
  double mass = 0;               ///< kg
  std::array<double, 3> point{}; ///< in the link's frame, m
};

/// What a program adds to a description.  A model keeps all of it in its own description.
struct model_options {
  /// The root link floats, as it also does if the description says so: a first joint `floating_base` with
  /// q = [x y z qx qy qz qw] and v = [linear, angular] in its frame.  If the description has a joint of that name, it is called
  /// `floating_root` instead, and a warning says so.
  bool floating_base = false;
  /// m/s², world axes; none: that of the description, (0, 0, −9.81) from a file
  std::optional<std::array<double, 3>> gravity;
  std::vector<payload> payloads;
  std::optional<physics_options> physics; ///< none: those of the description
};

/// The options that switch on the physics of these names: damping, friction, exact friction, armature, rotor, rotor bodies, spring, force
/// elements; or all, which is the six without exact friction and rotor bodies.  Throws description_error for any other name; it lists the known ones.
KSL_EXPORT physics_options physics_named(const std::vector<std::string> &names,
                                         double friction_width = physics_options().friction_width);
/// The names of the physics that options switch on.
KSL_EXPORT std::vector<std::string> names_of(const physics_options &options);

/// A sentence for messages: no link or joint (`what`) has this name.  It proposes a known name that is near, or lists the known ones.
KSL_EXPORT std::string unknown_name(const std::string &what, const std::string &name,
                                    const std::vector<std::string> &known);

/// An inertia about the origin of a link, in its axes, that replaces the link's own.
struct link_inertia {
  int link; ///< index into model::links()
  spatial_inertia<double> inertia;
};

/// A joint as a user sees it.  Every link is carried by exactly one joint.  For a fixed root it is called `base`, or `ground` if
/// the description has a joint, or another link, named `base`.
struct joint_row {
  std::string name;
  joint_kind kind;
  int link;             ///< the child link
  int parent_link;      ///< −1: the ground
  int q_index, v_index; ///< where its numbers in q and v begin; −1 for fixed joints and followers
  vec3<double> axis;    ///< unit vector in the joint's frame; for kinds that have one (joint_kind_row)
  vec3<double> axis2;   ///< second axis of universal joints, fixed in the child: a unit vector in the joint's frame
  double pitch;         ///< m/rad; of helical joints
  int description;      ///< index into robot_description::joints; −1 for base and floating_base
  /// For a follower, a mimic joint: position = multiplier × that of its leader + offset.  The leader is an index into joints()
  /// and follows no other joint; −1 for joints that are no followers.
  int leader = -1;
  double multiplier = 0, offset = 0;
};

/// A joint that closes a loop, as a user sees it.  It has no numbers in q and v.
struct loop_row {
  std::string name;
  joint_kind kind;
  int predecessor, successor;                   ///< links: the sides that a file calls parent and child
  SE3<double> predecessor_pose, successor_pose; ///< of its frame on each side, in the link's frame
  vec3<double> axis, axis2;                     ///< unit vectors, the same in both frames; for kinds that have them
  double pitch;                                 ///< m/rad; of helical joints
};

/// A spring, damper or cylinder between points of two links, as a user sees it.
struct force_element_row {
  std::string name;
  int link1, link2;            ///< indices into model::links()
  vec3<double> point1, point2; ///< in the links' frames, m
  force_element_numbers numbers;
};

namespace loops {
struct tables;
}
struct machine_code;

/// What a model consists of, and the views of it that kernels get.
struct model_parts {
  /// A unit quaternion [x y z w] in q: where it begins, and the joint that it belongs to.
  struct quaternion_in_q {
    int q_index;
    int joint; ///< index into joints()
  };
  struct position_range { double lower, upper; };

  /// Bodies, links and gravity in one precision.
  template <class S> struct arrays {
    std::vector<ksl::body<S>> bodies;
    std::vector<ksl::link<S>> links;
    std::vector<spatial_inertia<S>> augmented;
    vec3<S> gravity;
    std::vector<S> inertia, theta0_sine, theta0_cosine; // contiguous, for lanes
    std::vector<S> lower, upper;
    std::vector<coordinate_physics<S>> physics; // (nv), or empty
    std::vector<ksl::follower<S>> followers;
    int first_angle = 0, angles_end = 0;
    std::shared_ptr<const loop_plan<S>> loops; ///< null for trees, and for loops without a plan

    model_view<S> view_of(const model_parts &m) const {
      return {static_cast<int>(bodies.size()),
              static_cast<int>(links.size()),
              m.expanded_nq_,
              m.expanded_nv_,
              m.pose_numbers_,
              m.longest_path_,
              m.tree_row_.empty() ? 0 : m.tree_row_.back(), // of a model that was moved from
              gravity,
              bodies.data(),
              links.data(),
              inertia.data(),
              augmented.data(),
              theta0_sine.data(),
              theta0_cosine.data(),
              m.tree_row_.data(),
              first_angle,
              angles_end,
              lower.data(),
              upper.data(),
              physics.empty() ? nullptr : physics.data(),
              loops ? &loops->view : nullptr};
    }
    coupling_view<S> coupling(int nq, int nv, const std::vector<int> &in_q, const std::vector<int> &in_v) const {
      return {static_cast<int>(followers.size()), followers.data(), nq, nv, in_q.data(), in_v.data()};
    }
  };

  robot_description description_;
  std::vector<joint_row> joints_;
  std::vector<loop_row> loops_;
  std::shared_ptr<const loops::tables> loop_tables_; ///< null without loops
  std::vector<force_element_row> force_elements_;
  std::vector<quaternion_in_q> quaternions_;
  std::vector<position_range> position_ranges_;
  std::vector<link_description> links_;
  std::vector<int> link_index_;  // in links_, for each link of the description
  std::vector<int> joint_above_; // in joints_, for each of links_
  std::vector<int> tree_row_ = {0};
  arrays<double> double_;
  arrays<float> single_;
  std::vector<int> in_q_, in_v_; // where a user's numbers are in the expanded arrays
  int nq_ = 0, nv_ = 0, expanded_nq_ = 0, expanded_nv_ = 0, pose_numbers_ = 0, longest_path_ = 0, moving_joints_ = 0,
      massless_joint_ = -1, acting_force_elements_ = 0;
  model_view<double> view_{};
  model_view<float> view_single_{};
  bool is_tree_alone_ = false;               ///< without loops, followers and force elements that act
  std::shared_ptr<const machine_code> code_; ///< for the constants of this very mechanism; null without

  /// Views look at arrays: they are set where these have been built, changed, copied or moved.
  void set_views() {
    view_ = double_.view_of(*this);
    view_single_ = single_.view_of(*this);
    is_tree_alone_ = loops_.empty() && double_.followers.empty() && acting_force_elements_ == 0;
  }
};

/// A mechanism, immutable after construction, shared between threads.
class KSL_EXPORT model : private model_parts {
public:
  /// Builds the arrays.  Throws description_error if the description is not a tree.
  explicit model(robot_description robot, const model_options &options = {});

  model(const model &other) : model_parts(other) { set_views(); }
  model(model &&other) noexcept : model_parts(std::move(other)) { set_views(); }
  model &operator=(const model &other) {
    if (this != &other)
      model_parts::operator=(other);
    set_views();
    return *this;
  }
  model &operator=(model &&other) noexcept {
    model_parts::operator=(std::move(other));
    set_views();
    return *this;
  }
  ~model() = default;

  /// The same mechanism with other inertias for some of its links: the structure is copied, not built again.  Throws
  /// description_error for a mass that is negative or a number that is not finite.  O(links).
  model with_inertias(const std::vector<link_inertia> &inertias) const;

  /// The same mechanism under another gravity, m/s² in world axes: on a wall, or on another planet.  Throws description_error for
  /// numbers that are not finite.  The structure is copied, not built again.
  model with_gravity(const std::array<double, 3> &gravity) const;

  /// The same mechanism with code that was compiled for it, by which batches are computed that it answers.  What is made of the model
  /// with other inertias or another gravity has none.
  model with_code(std::shared_ptr<const machine_code> code) const;
  const machine_code *code() const { return code_.get(); }

  int nq() const { return nq_; }
  int nv() const { return nv_; }

  /// How many elements of the lower triangle of the mass matrix the shape of the tree lets differ from zero.
  int tree_elements() const { return tree_row_.back(); }
  /// The index of the first element of each row, and of the end of the last row (nv + 1).
  const std::vector<int> &tree_rows() const { return tree_row_; }
  /// The column of each element.
  std::vector<int> tree_columns() const;
  /// These columns into an array (tree_elements()).
  void tree_columns(int *columns) const;

  /// All joints: the moving ones in the order of q (depth first, children in file order), then the followers of mimic joints,
  /// which have no numbers in q and v of their own, then the fixed ones, `base` last.
  const std::vector<joint_row> &joints() const { return joints_; }
  /// Joints that close loops, in the order of the description.  A model without them is a tree.
  const std::vector<loop_row> &loops() const { return loops_; }
  /// Springs, dampers and cylinders between points of two links, whether they act or not.
  const std::vector<force_element_row> &force_elements() const { return force_elements_; }
  /// How many of them act: all, if physics_options name them, or none.
  int acting_force_elements() const { return acting_force_elements_; }
  /// The plan of their elimination, by which kernels compute; null without one.
  const loop_plan<double> *plan_of_loops() const { return double_.loops.get(); }
  /// What the library has computed about the loops.
  const loops::tables &loop_tables() const { return *loop_tables_; }

  int moving_joints() const { return moving_joints_; } ///< without followers
  /// Has it neither loops, nor followers, nor force elements that act?  Then calls go straight to the kernels.
  bool is_tree_alone() const { return is_tree_alone_; }
  int followers() const { return static_cast<int>(double_.followers.size()); }

  /// The first joint that can move without moving any mass, whatever the position: an index into joints(), or −1.  Its acceleration
  /// under given efforts is not determined.
  int massless_joint() const { return massless_joint_; }
  /// A sentence that names this joint and says how to mend the model; empty if there is none.
  std::string massless_joint_text() const;
  /// A sentence about a joint that moves no mass at some position: an index into joints().
  std::string massless_joint_text(int joint) const;

  using model_parts::quaternion_in_q;
  const std::vector<quaternion_in_q> &quaternions() const { return quaternions_; }

  /// The range of each number in q (nq): the limits of the description, those of followers included; where it gives none, −π to π
  /// for angles and −1 m to 1 m for lengths.  Of the numbers of quaternions, −1 to 1.
  using model_parts::position_range;
  const std::vector<position_range> &position_ranges() const { return position_ranges_; }

  /// Links, parents first, with name and inertia, payload included.
  const std::vector<link_description> &links() const { return links_; }

  /// Mass of all links, payloads included; and of the links that a joint carries, directly or not.  kg.
  double mass() const;
  double subtree_mass(int joint) const;

  /// The joints between the root and a link, indices into joints(), the root's first; the joint to the ground is one of them if
  /// it moves.  All links that a joint carries, directly or not, parents first.
  std::vector<int> support(int link) const;
  std::vector<int> subtree_links(int joint) const;
  /// These joints, or links, into an array, which may be null.  Return how many they are.
  int support(int link, int *joints) const;
  int subtree_links(int joint, int *links) const;

  /// The joint that carries a link, index into joints().
  int joint_above(int link) const { return joint_above_[static_cast<std::size_t>(link)]; }

  /// Index of a name, or −1.
  int find_joint(const std::string &name) const;
  int find_link(const std::string &name) const;

  /// Is dry friction discontinuous at rest?  Forward dynamics and derivatives of efforts are then undefined: C and Python refuse
  /// them; in C++ they are those of a very narrow smooth law, which no integrator and no optimiser can use.
  bool exact_friction() const { return description_.physics.friction && description_.physics.exact_friction; }
  /// A sentence that says so, and what to do about it.
  static std::string exact_friction_text();

  /// All that the model is made of, in file order, payloads included: model(m.description()) is a copy of m.
  const robot_description &description() const { return description_; }

  /// The arrays that algorithms run on, in double and in single precision; valid as long as the model lives.  They are those of
  /// the expanded mechanism, in which followers have numbers of their own: nq and nv of a view count them.
  const model_view<double> &view() const { return view_; }
  const model_view<float> &view_single() const { return view_single_; }
  template <class S> const model_view<S> &view_in() const {
    if constexpr (sizeof(S) == sizeof(double))
      return view();
    else
      return view_single();
  }

  /// How the numbers of the expanded mechanism follow from those of a user (engine/model/coupling.hpp).
  template <class S> coupling_view<S> coupling_in() const {
    if constexpr (sizeof(S) == sizeof(double))
      return double_.coupling(nq_, nv_, in_q_, in_v_);
    else
      return single_.coupling(nq_, nv_, in_q_, in_v_);
  }

private:
  friend class model_builder;
};

/// The workspace of a computation, and the only object that calls modify.  It is one block of memory, large enough for any
/// algorithm (engine/lanes/workspace.hpp), and is allocated by the constructor only.  Each thread needs a workspace of its own.  In
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
