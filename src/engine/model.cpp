// Builds the arrays of a model from a description: links in depth-first order, welded links lumped, joint frames turned
// so that the axis is z.
#include "ksl/model.hpp"

#include "ksl/engine/mass_matrix.hpp"

#include "load/check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ksl {
namespace {

using A = algebra<double>;

constexpr SE3<double> identity = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
constexpr plane_turn<double> none = {0, 1};

/// A rotation whose third column is the unit vector z.  Exact for the six coordinate directions.
mat3x3<double> frame_with_z(const vec3<double> &z) {
  // x is the coordinate axis after the one that z is closest to, made orthogonal to z
  const double ax = std::fabs(z.x), ay = std::fabs(z.y), az = std::fabs(z.z);
  vec3<double> x = az >= ax && az >= ay ? vec3<double>{1, 0, 0} : ax >= ay ? vec3<double>{0, 1, 0} : vec3<double>{0, 0, 1};
  vec3<double> y;
  A::axpy_vv(-A::dot_vv(&x, &z), &z, &x);
  A::vec3_normalize(&x);
  A::cross_vv(&z, &x, &y);
  return {x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z};
}

/// Exactly: a turn of 1e-9 leaves ones on the diagonal.
bool is_identity(const SE3<double> &D) {
  const mat3x3<double> &R = D.R;
  const bool zero = R.m01 == 0 && R.m02 == 0 && R.m12 == 0 && R.m10 == 0 && R.m20 == 0 && R.m21 == 0;
  return zero && R.m00 == 1 && R.m11 == 1 && R.m22 == 1 && D.t.x == 0 && D.t.y == 0 && D.t.z == 0;
}

bool has_axis(joint_kind kind) {
  return kind == joint_kind::revolute || kind == joint_kind::continuous || kind == joint_kind::prismatic;
}

/// Sine of the angle between z and the axis of a joint on a body.
double sine_to_axis(const mat3x3<double> &joint) { return std::hypot(joint.m02, joint.m12); }

/// Less than rounding leaves of a right angle or of none.
constexpr double negligible = 4 * std::numeric_limits<double>::epsilon();

/// By which turn about z, a quarter at most, the axis of a joint comes to lie in the plane of y and z.
plane_turn<double> turn_to_axis(const mat3x3<double> &joint) {
  const double sine = sine_to_axis(joint);
  if (sine < negligible)
    return none;
  const double sign = joint.m12 > 0 || (joint.m12 == 0 && joint.m02 < 0) ? -1 : 1;
  return {sign * joint.m02 / sine, -sign * joint.m12 / sine};
}

/// D = Rz(turn) D.
void turn_pose(const plane_turn<double> &turn, SE3<double> &D) {
  double dc[2] = {turn.sine, turn.cosine};
  SE3<double> about_z = identity;
  A::product_drdrz(&about_z.R, dc, &about_z.R);
  A::product_dd(&about_z, &D, &D);
}

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
      check_free_name("floating_base");
      add_moving_link(root, -1, {"floating_base", joint_kind::floating, -1, -1, 0, 0, {0, 0, 0}, -1}, identity, 0);
    } else {
      add_welded_link(root, -1, identity, 0);
      m_.double_.links.back().first = true;
      m_.double_.bodies[0].link = 0;
      fixed_joints_.push_back({ground_name(), joint_kind::fixed, 0, -1, -1, -1, {0, 0, 0}, -1});
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
    m_.double_.bodies.push_back({joint_kind::fixed, -1, 0, 0, 0, 0, -1, identity, none, none, none, true, {}});
  }

  bool names_joint(const std::string &name) const {
    for (const joint_description &j : m_.description_.joints)
      if (j.name == name)
        return true;
    return false;
  }

  void check_free_name(const std::string &name) const {
    if (names_joint(name))
      throw description_error(m_.description_.file + ": joint " + name +
                              " has the name of the joint that a floating base adds; rename it in the file");
  }

  /// `base`, unless a joint of the file has that name.
  std::string ground_name() const {
    std::string name = names_joint("base") ? "ground" : "base";
    while (names_joint(name))
      name += "_";
    return name;
  }

  /// Depth first, children in file order; without recursion, since chains can be long.
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
      fixed_joints_.push_back({j.name, j.kind, static_cast<int>(m_.double_.links.size()), parent, -1, -1, {0, 0, 0}, index});
      add_welded_link(j.child, parent, placement, p.body);
    } else {
      add_moving_link(j.child, parent, {j.name, j.kind, -1, parent, m_.nq_, m_.nv_, j.axis, index}, placement, p.body);
    }
  }

  void add_moving_link(int description_link, int parent, joint_row row, const SE3<double> &joint_placement, int parent_body) {
    SE3<double> canonical = identity; // in the joint's frame
    if (has_axis(row.kind))
      canonical.R = frame_with_z(row.axis);
    SE3<double> placement, pose;
    A::product_dd(&joint_placement, &canonical, &placement);
    A::SE3_inverted(&canonical, &pose);

    row.link = static_cast<int>(m_.double_.links.size());
    m_.double_.bodies.push_back(
        {row.kind, parent_body, m_.nq_, m_.nv_, m_.nv_, chain_to(row.kind, parent_body), row.link, placement, none, none, none, true, {}});
    m_.nq_ += row_of(row.kind).nq;
    m_.nv_ += row_of(row.kind).nv;
    m_.joints_.push_back(std::move(row));
    add_welded_link(description_link, parent, pose, static_cast<int>(m_.double_.bodies.size()) - 1);
    m_.double_.links.back().first = true;
  }

  /// Where the chain of bodies begins that a new one on this parent ends.
  int chain_to(joint_kind kind, int parent) const {
    const auto &bodies = m_.double_.bodies;
    const int added = static_cast<int>(bodies.size());
    return turns(kind) && parent == added - 1 && turns(bodies.back().kind) ? bodies.back().chain : added;
  }

  void add_welded_link(int description_link, int parent, const SE3<double> &pose, int body) {
    link_description l = m_.description_.links[static_cast<std::size_t>(description_link)];
    for (const payload &p : options_.payloads)
      if (p.link == l.name)
        add_payload(p, l);
    spatial_inertia<double> in_body;
    A::spatial_inertia_transformed(&l.inertia, &pose, &in_body);
    spatial_inertia<double> &lump = m_.double_.bodies[static_cast<std::size_t>(body)].inertia;
    A::spatial_inertia_added(&lump, &in_body, &lump);

    link_of_[static_cast<std::size_t>(description_link)] = static_cast<int>(m_.double_.links.size());
    m_.double_.links.push_back({body, parent, false, false, {}, pose, in_body});
    m_.links_.push_back(std::move(l));
  }

  void finish() {
    m_.moving_joints_ = static_cast<int>(m_.joints_.size());
    // the ground's joint was made first and is listed last
    if (!options_.floating_base) {
      m_.joints_.insert(m_.joints_.end(), fixed_joints_.begin() + 1, fixed_joints_.end());
      m_.joints_.push_back(fixed_joints_.front());
    } else {
      m_.joints_.insert(m_.joints_.end(), fixed_joints_.begin(), fixed_joints_.end());
    }
    m_.double_.gravity = {options_.gravity[0], options_.gravity[1], options_.gravity[2]};
    close_subtrees();
    choose_axes();
    round_to_single();
    lay_side_by_side(m_.double_);
    lay_side_by_side(m_.single_);
    for (const payload &p : options_.payloads)
      if (m_.find_link(p.link) < 0)
        throw description_error(m_.description_.file + ": no link " + p.link + " to carry the payload");
  }

  /// Where the numbers of each subtree end: bodies are in depth-first order.
  void close_subtrees() {
    std::vector<body<double>> &bodies = m_.double_.bodies;
    for (std::size_t i = bodies.size(); i-- > 0;) {
      body<double> &b = bodies[i];
      b.v_end = std::max(b.v_end, b.v_index + row_of(b.kind).nv);
      if (b.parent >= 0) {
        body<double> &parent = bodies[static_cast<std::size_t>(b.parent)];
        parent.v_end = std::max(parent.v_end, b.v_end);
      }
    }
  }

  /// Turns every canonical frame about its z axis, and takes the placements of joints apart into turns.
  void choose_axes() {
    std::vector<body<double>> &bodies = m_.double_.bodies;
    std::vector<plane_turn<double>> chosen(bodies.size(), none);
    for (std::size_t i = bodies.size(); i-- > 1;) { // of several joints on a body the first one decides
      const body<double> &b = bodies[i];
      const auto parent = static_cast<std::size_t>(b.parent);
      if (has_axis(b.kind) && has_axis(bodies[parent].kind) && sine_to_axis(b.placement.R) >= negligible)
        chosen[parent] = turn_to_axis(b.placement.R);
    }
    for (link<double> &l : m_.double_.links)
      turn_link(chosen[static_cast<std::size_t>(l.body)], l);
    for (std::size_t i = 1; i < bodies.size(); ++i) {
      body<double> &b = bodies[i];
      turn_pose(inverse(chosen[static_cast<std::size_t>(b.parent)]), b.placement);
      if (has_axis(b.kind))
        take_apart(b, chosen[i]);
      turn_inertia(chosen[i], b.inertia);
    }
  }

  static void turn_inertia(const plane_turn<double> &turn, spatial_inertia<double> &I) {
    SE3<double> back = identity;
    turn_pose(inverse(turn), back);
    if (!is_identity(back))
      A::spatial_inertia_transformed(&I, &back, &I);
  }

  static void turn_link(const plane_turn<double> &turn, link<double> &l) {
    turn_pose(inverse(turn), l.pose);
    turn_inertia(turn, l.inertia);
    const double R[3][3] = {{l.pose.R.m00, l.pose.R.m01, l.pose.R.m02},
                            {l.pose.R.m10, l.pose.R.m11, l.pose.R.m12},
                            {l.pose.R.m20, l.pose.R.m21, l.pose.R.m22}};
    for (int z = 0; z < 3; ++z) {
      if (!l.first || R[0][z] != 0 || R[1][z] != 0)
        continue;
      const int x = (z + 1) % 3, y = (z + 2) % 3;
      l.along_axis = true;
      l.turn = {{-R[1][x], R[0][x]}, R[2][z], {x, y, z}};
    }
  }

  /// placement = Rz(before) Rx(lean) Rz(…) of a joint, whose body's frame is turned by `chosen` against the joint's.
  static void take_apart(body<double> &b, const plane_turn<double> &chosen) {
    mat3x3<double> &R = b.placement.R, rest = R;
    b.before = turn_to_axis(R);
    b.straight = std::fabs(b.before.sine) * sine_to_axis(R) < negligible;
    if (b.straight)
      b.before = none;
    vec3<double> axis = {R.m02, R.m12, R.m22};
    turn_back_z(b.before, axis);
    const double length = std::hypot(axis.y, axis.z);
    b.lean = {-axis.y / length, axis.z / length};
    double before[2] = {b.before.sine, b.before.cosine}, lean[2] = {b.lean.sine, b.lean.cosine};
    A::product_drdrz(&identity.R, before, &R);
    A::product_drdrx(&R, lean, &R);
    A::product_drinvdr(&R, &rest, &rest);
    b.after = product(plane_turn<double>{rest.m10, rest.m00}, chosen);
  }

  void round_to_single() {
    const auto &d = m_.double_;
    for (const body<double> &b : d.bodies)
      m_.single_.bodies.push_back({b.kind, b.parent, b.q_index, b.v_index, b.v_end, b.chain, b.link, spread<float>(b.placement),
                                   spread<float>(b.before), spread<float>(b.lean), spread<float>(b.after), b.straight,
                                   spread<float>(b.inertia)});
    for (const link<double> &l : d.links)
      m_.single_.links.push_back({l.body, l.parent, l.first, l.along_axis,
                                  {spread<float>(l.turn.about_z), static_cast<float>(l.turn.sense),
                                   {l.turn.slot[0], l.turn.slot[1], l.turn.slot[2]}},
                                  spread<float>(l.pose), spread<float>(l.inertia)});
    m_.single_.gravity = spread<float>(d.gravity);
  }

  /// The constants that kernels read for several bodies or joints at once.
  template <class S> void lay_side_by_side(model::arrays<S> &a) const {
    const int bodies = static_cast<int>(a.bodies.size());
    const auto angles = static_cast<std::size_t>(room_for_angles(m_.nq_));
    a.inertia.assign(static_cast<std::size_t>(room_for<S>(10, bodies)), S(0));
    a.after_sine.assign(angles, S(0));
    a.after_cosine.assign(angles, S(1));
    a.first_angle = m_.nq_;
    for (int i = 0; i < bodies; ++i) {
      const body<S> &b = a.bodies[static_cast<std::size_t>(i)];
      body_at<S>(i).put(b.inertia, a.inertia.data());
      if (!turns(b.kind))
        continue;
      a.after_sine[static_cast<std::size_t>(b.q_index)] = b.after.sine;
      a.after_cosine[static_cast<std::size_t>(b.q_index)] = b.after.cosine;
      a.first_angle = std::min(a.first_angle, b.q_index);
      a.angles_end = b.q_index + 1;
    }
  }

  model &m_;
  const model_options &options_;
  std::vector<std::vector<int>> children_; // joints that leave each link of the description
  std::vector<int> link_of_;               // index in links_ of each link of the description
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

namespace {

/// n elements; in debug builds every number of theirs is NaN, so that what is read before it is written shows.
template <class Element> std::vector<Element> fresh(int n) {
  std::vector<Element> elements(static_cast<std::size_t>(n));
#ifndef NDEBUG
  static_assert(sizeof(Element) % sizeof(double) == 0);
  double *numbers = reinterpret_cast<double *>(elements.data());
  std::fill_n(numbers, elements.size() * sizeof(Element) / sizeof(double), std::numeric_limits<double>::quiet_NaN());
#endif
  return elements;
}

} // namespace

data::data(const model &m) {
  const int bodies = m.view().bodies, links = m.view().links;
  const auto numbers = [](int each, int n) { return fresh<double>(room_for<double>(each, n)); };
  in_parent_ = fresh<SE3<double>>(bodies);
  in_world_ = fresh<SE3<double>>(bodies);
  sine_ = fresh<double>(room_for_angles(m.nq()));
  cosine_ = fresh<double>(room_for_angles(m.nq()));
  motion_ = numbers(9, bodies);
  wrench_ = numbers(6, bodies);
  rotation_ = numbers(9, bodies);
  inertia_ = numbers(21, bodies);
  offset_ = fresh<vec3<double>>(bodies);
  axis_ = fresh<joint_axis<double>>(bodies);
  twist_ = fresh<screw<double>>(bodies);
  articulated_ = fresh<articulated_state<double>>(bodies);
  link_wrench_ = fresh<coscrew<double>>(links);
  zero_.resize(static_cast<std::size_t>(m.nv()));
}

} // namespace ksl
