// Builds the arrays of a model from a description: links in depth-first order, welded links lumped, joint frames turned
// so that the axis is z.
#include "ksl/model.hpp"

#include "ksl/engine/body_lanes.hpp"

#include "engine/canonical_axes.hpp"
#include "load/check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ksl {
namespace {

using A = algebra<double>;

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
      add_moving_link(root, -1, {name, joint_kind::floating, -1, -1, 0, 0, {0, 0, 0}, -1}, identity, 0);
    } else {
      add_welded_link(root, -1, identity, 0);
      m_.double_.links.back().first = true;
      m_.double_.bodies[0].link = 0;
      fixed_joints_.push_back({free_name("base", "ground"), joint_kind::fixed, 0, -1, -1, -1, {0, 0, 0}, -1});
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
    m_.double_.bodies.push_back({joint_kind::fixed, -1, 0, 0, 0, 0, -1, identity, no_turn, no_turn, no_turn, true, {}});
  }

  bool names_joint(const std::string &name) const {
    for (const joint_description &j : m_.description_.joints)
      if (j.name == name)
        return true;
    return false;
  }

  /// The usual name of a joint that is no joint of the file, or the next one that no joint of the file has.
  std::string free_name(const char *usual, const char *otherwise) const {
    std::string name = names_joint(usual) ? otherwise : usual;
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
        {row.kind, parent_body, m_.nq_, m_.nv_, m_.nv_, chain_to(row.kind, parent_body), row.link, placement, no_turn, no_turn, no_turn, true, {}});
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
    choose_canonical_axes(m_.double_.bodies, m_.double_.links);
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
