// Builds the arrays of a model from a description.  Links come in depth-first order, links welded by fixed joints are lumped
// into one body, and joint frames are rotated so that the axis is z.
#include "ksl/model.hpp"

#include "engine/canonical_axes.hpp"
#include "engine/joint_physics.hpp"
#include "engine/largest_workspace.hpp"
#include "load/check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ksl {
namespace {

using A = algebra<double>;

constexpr vec3<double> none = {0, 0, 0}; ///< of a joint without an axis

/// A rotation whose third column is the unit vector z.  Exact for the six coordinate directions.
mat3x3<double> frame_with_z(const vec3<double> &z) {
  // x is the next coordinate axis (cyclically) after the one that z is closest to, made orthogonal to z
  const double ax = std::fabs(z.x), ay = std::fabs(z.y), az = std::fabs(z.z);
  vec3<double> x = az >= ax && az >= ay ? vec3<double>{1, 0, 0} : ax >= ay ? vec3<double>{0, 1, 0} : vec3<double>{0, 0, 1};
  vec3<double> y;
  A::axpy_vv(-A::dot_vv(&x, &z), &z, &x);
  A::vec3_normalize(&x);
  A::cross_vv(&z, &x, &y);
  return {x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z};
}

/// A frame at the joint's origin with z along the unit vector z.
SE3<double> with_z(const vec3<double> &z) { return {frame_with_z(z), {0, 0, 0}}; }

/// Adds a point mass to a link's inertia.
void add_payload(const payload &p, link_description &l) {
  const vec3<double> c = {p.point[0], p.point[1], p.point[2]};
  spatial_inertia<double> I;
  A::spatial_inertia_fromMassCentroid(p.mass, &c, 0, 0, 0, 0, 0, 0, &I);
  A::spatial_inertia_added(&l.inertia, &I, &l.inertia);
}

} // namespace

class model_builder {
public:
  model_builder(model &m, const model_options &options) : m_(m), options_(options) {}

  void build() {
    const int root = check_tree(m_.description_);
    collect_children();
    add_ground();
    if (options_.floating_base) {
      const std::string name = free_name("floating_base", "floating_root");
      if (name != "floating_base")
        m_.description_.warnings.push_back(
            "joint floating_base of the file keeps its name; the joint that the floating base adds is called " + name);
      add_moving_link(root, -1, {name, joint_kind::floating, -1, -1, 0, 0, none, none, 0, -1}, identity, 0);
    } else {
      add_welded_link(root, -1, identity, 0);
      m_.double_.links.back().carried_by_moving_joint = true;
      m_.double_.bodies[0].link = 0;
      fixed_joints_.push_back({free_name("base", "ground"), joint_kind::fixed, 0, -1, -1, -1, none, none, 0, -1});
    }
    descend(root);
    finish();
  }

private:
  void collect_children() {
    const robot_description &robot = m_.description_;
    children_.resize(robot.links.size());
    link_of_.assign(robot.links.size(), -1);
    for (std::size_t j = 0; j < robot.joints.size(); ++j)
      children_[static_cast<std::size_t>(robot.joints[j].parent)].push_back(static_cast<int>(j));
  }

  void add_ground() {
    m_.double_.bodies.push_back(new_body(joint_kind::fixed, -1, -1, identity));
    m_.double_.bodies.back().is_base = true;
  }

  bool names_joint(const std::string &name) const {
    for (const joint_description &j : m_.description_.joints)
      if (j.name == name)
        return true;
    return false;
  }

  /// A name for a joint that is added to those of the file: the usual one, or one that no joint of the file has.
  std::string free_name(const char *usual, const char *otherwise) const {
    std::string name = names_joint(usual) ? otherwise : usual;
    while (names_joint(name))
      name += "_";
    return name;
  }

  /// Depth first, children in file order.  Not recursive, since chains can be long.
  void descend(int root) {
    std::vector<int> pending;
    push_children(root, pending);
    while (!pending.empty()) {
      const joint_description &j = m_.description_.joints[static_cast<std::size_t>(pending.back())];
      const int index = pending.back();
      pending.pop_back();
      add_link(j, index);
      push_children(j.child, pending);
    }
  }

  void push_children(int description_link, std::vector<int> &pending) const {
    const std::vector<int> &joints = children_[static_cast<std::size_t>(description_link)];
    pending.insert(pending.end(), joints.rbegin(), joints.rend());
  }

  void add_link(const joint_description &j, int index) {
    const int parent = link_of_[static_cast<std::size_t>(j.parent)];
    const link<double> &p = m_.double_.links[static_cast<std::size_t>(parent)];
    SE3<double> placement; // of the joint's frame in the parent body's canonical frame
    A::product_dd(&p.pose, &j.placement, &placement);
    if (j.kind == joint_kind::fixed) {
      fixed_joints_.push_back({j.name, j.kind, static_cast<int>(m_.double_.links.size()), parent, -1, -1, none, none, 0, index});
      add_welded_link(j.child, parent, placement, p.body);
    } else {
      const joint_kind_row kind = row_of(j.kind);
      add_moving_link(j.child, parent,
                      {j.name, j.kind, -1, parent, m_.nq_, m_.nv_, kind.has_axis ? axis_of(j) : none, kind.has_axis2 ? j.axis2 : none,
                       kind.has_pitch ? *j.pitch : 0, index},
                      placement, p.body);
    }
  }

  void add_moving_link(int description_link, int parent, joint_row row, const SE3<double> &joint_placement, int parent_body) {
    const joint_kind_row kind = row_of(row.kind);
    SE3<double> canonical = kind.has_axis ? with_z(row.axis) : identity, placement, pose; // in the joint's frame
    A::product_dd(&joint_placement, &canonical, &placement);
    row.link = static_cast<int>(m_.double_.links.size());
    if (kind.has_axis2) {
      // a massless body turns about the first axis; the second is placed on it
      const int inside = add_body(joint_kind::revolute, parent_body, -1, placement, 0);
      const SE3<double> second = with_z(row.axis2);
      A::product_dinvd(&canonical, &second, &placement);
      add_body(joint_kind::revolute, inside, row.link, placement, 0);
      m_.double_.bodies.back().ends_universal = true;
      canonical = second;
    } else {
      add_body(row.kind, parent_body, row.link, placement, row.pitch);
    }
    if (kind.quaternion >= 0)
      m_.quaternions_.push_back({row.q_index + kind.quaternion, static_cast<int>(m_.joints_.size())});
    m_.joints_.push_back(std::move(row));
    A::SE3_inverted(&canonical, &pose);
    add_welded_link(description_link, parent, pose, static_cast<int>(m_.double_.bodies.size()) - 1);
    m_.double_.links.back().carried_by_moving_joint = true;
  }

  /// Adds a body, and its joint's numbers to q and v.  Returns its index.
  int add_body(joint_kind kind, int parent, int link, const SE3<double> &placement, double pitch) {
    const joint_kind_row row = row_of(kind);
    m_.double_.bodies.push_back(new_body(kind, parent, link, placement));
    m_.double_.bodies.back().pitch = pitch;
    m_.nq_ += row.nq;
    m_.nv_ += row.nv;
    m_.pose_numbers_ += row.pose_numbers;
    return static_cast<int>(m_.double_.bodies.size()) - 1;
  }

  /// A body on a joint whose numbers in q and v follow those of all joints so far.
  body<double> new_body(joint_kind kind, int parent, int link, const SE3<double> &placement) const {
    const joint_kind_row row = row_of(kind);
    body<double> b{};
    b.kind = kind == joint_kind::continuous ? joint_kind::revolute : kind;
    b.parent = parent;
    b.q_index = m_.nq_, b.v_index = b.v_end = m_.nv_;
    b.nv = row.nv;
    b.angle_index = row.angle < 0 ? -1 : m_.nq_ + row.angle;
    b.chain_start = chain_start(kind, parent);
    b.pose_index = m_.pose_numbers_;
    b.link = link;
    b.is_base = parent == 0 && row.is_free;
    b.no_offset = true;
    b.placement = placement;
    b.offset = b.alpha = b.theta0 = no_rotation;
    return b;
  }

  /// body::chain_start for a new body on this parent.
  int chain_start(joint_kind kind, int parent) const {
    const auto &bodies = m_.double_.bodies;
    const int added = static_cast<int>(bodies.size());
    return only_turns(kind) && parent == added - 1 && only_turns(bodies.back().kind) ? bodies.back().chain_start : added;
  }

  void add_welded_link(int description_link, int parent, const SE3<double> &pose, int body) {
    link_description l = m_.description_.links[static_cast<std::size_t>(description_link)];
    for (const payload &p : options_.payloads)
      if (p.link == l.name)
        add_payload(p, l);
    link_of_[static_cast<std::size_t>(description_link)] = static_cast<int>(m_.double_.links.size());
    m_.double_.links.push_back({body, parent, false, false, {}, pose, {}});
    m_.links_.push_back(std::move(l));
  }

  void finish() {
    m_.moving_joints_ = static_cast<int>(m_.joints_.size());
    // the joint to the ground was created first and is listed last
    if (!options_.floating_base) {
      m_.joints_.insert(m_.joints_.end(), fixed_joints_.begin() + 1, fixed_joints_.end());
      m_.joints_.push_back(fixed_joints_.front());
    } else {
      m_.joints_.insert(m_.joints_.end(), fixed_joints_.begin(), fixed_joints_.end());
    }
    m_.double_.gravity = {options_.gravity[0], options_.gravity[1], options_.gravity[2]};
    close_subtrees();
    choose_canonical_axes(m_.double_.bodies, m_.double_.links);
    add_inertias();
    add_angles();
    m_.double_.physics = joint_physics(m_.description_, m_.joints_, m_.nv_, options_.physics);
    m_.exact_friction_ = options_.physics.friction && options_.physics.exact_friction;
    round_to_single();
    for (const payload &p : options_.payloads)
      if (m_.find_link(p.link) < 0)
        throw description_error(m_.description_.file + ": no link " + p.link + " to carry the payload");
  }

  /// Sets where the numbers of each subtree end in v.  Bodies are in depth-first order.
  void close_subtrees() {
    std::vector<body<double>> &bodies = m_.double_.bodies;
    for (std::size_t i = bodies.size(); i-- > 0;) {
      body<double> &b = bodies[i];
      b.has_children = b.v_end > b.v_index;
      b.v_end = std::max(b.v_end, b.v_index + b.nv);
      if (b.parent >= 0) {
        body<double> &parent = bodies[static_cast<std::size_t>(b.parent)];
        parent.v_end = std::max(parent.v_end, b.v_end);
      }
    }
  }

  /// Transforms the inertia of each link from its own frame to its body's.  The inertia of a body is the sum over its links.
  void add_inertias() {
    auto &d = m_.double_;
    d.inertia.assign(static_cast<std::size_t>(padded_size<double>(10, static_cast<int>(d.bodies.size()))), 0);
    for (std::size_t i = 0; i < d.links.size(); ++i) {
      link<double> &l = d.links[i];
      const bodies_at<double, double> body{l.body};
      A::spatial_inertia_transformed(&m_.links_[i].inertia, &l.pose, &l.inertia);
      spatial_inertia<double> sum = body.get<spatial_inertia>(d.inertia.data());
      A::spatial_inertia_added(&sum, &l.inertia, &sum);
      body.put(sum, d.inertia.data());
    }
  }

  /// The constants theta0 of joint angles, as contiguous arrays that can be loaded into lanes.
  void add_angles() {
    auto &d = m_.double_;
    const auto angles = static_cast<std::size_t>(padded(m_.nq_) + padded(1));
    d.theta0_sine.assign(angles, 0);
    d.theta0_cosine.assign(angles, 1);
    d.first_angle = m_.nq_;
    for (const body<double> &b : d.bodies) {
      if (b.angle_index < 0)
        continue;
      const auto k = static_cast<std::size_t>(b.angle_index);
      d.theta0_sine[k] = b.theta0.sine;
      d.theta0_cosine[k] = b.theta0.cosine;
      d.first_angle = std::min(d.first_angle, b.angle_index);
      d.angles_end = b.angle_index + 1;
    }
  }

  void round_to_single() {
    const auto &d = m_.double_;
    auto &s = m_.single_;
    for (const body<double> &b : d.bodies)
      s.bodies.push_back(spread<float>(b));
    for (const link<double> &l : d.links)
      s.links.push_back(spread<float>(l));
    s.gravity = spread<float>(d.gravity);
    s.inertia.assign(d.inertia.begin(), d.inertia.end());
    s.theta0_sine.assign(d.theta0_sine.begin(), d.theta0_sine.end());
    s.theta0_cosine.assign(d.theta0_cosine.begin(), d.theta0_cosine.end());
    for (const coordinate_physics<double> &c : d.physics)
      s.physics.push_back(spread<float>(c));
    s.first_angle = d.first_angle, s.angles_end = d.angles_end;
  }

  model &m_;
  const model_options &options_;
  std::vector<std::vector<int>> children_; // joints of the description whose parent each of its links is
  std::vector<int> link_of_;               // index in links_, for each link of the description
  std::vector<joint_row> fixed_joints_;
};

model::model(robot_description robot, const model_options &options) : description_(std::move(robot)) {
  model_builder(*this, options).build();
}

int model::find_joint(const std::string &name) const {
  for (std::size_t i = 0; i < joints_.size(); ++i)
    if (joints_[i].name == name)
      return static_cast<int>(i);
  return -1;
}

int model::find_link(const std::string &name) const {
  for (std::size_t i = 0; i < links_.size(); ++i)
    if (links_[i].name == name)
      return static_cast<int>(i);
  return -1;
}

data::data(const model &m)
    : bytes_(largest_workspace(m.view())), memory_(::operator new(bytes_, alignment)), zero_(static_cast<std::size_t>(m.nv())),
      zero_single_(zero_.size()) {
#ifndef NDEBUG
  std::fill_n(static_cast<double *>(memory_.get()), bytes_ / sizeof(double), std::numeric_limits<double>::quiet_NaN());
#endif
}

} // namespace ksl
