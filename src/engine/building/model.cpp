// The model: its options and queries.
#include "ksl/model.hpp"

#include "ksl/engine/steps/tree_rows.hpp"

#include "description/structure/check.hpp"
#include "engine/model/joint_physics.hpp"
#include "engine/building/model_builder.hpp"
#include "text/characters.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>

namespace ksl {
namespace {

using A = algebra<double>;

/// Adds a point mass to a link's inertia.
void add_payload(const payload &p, robot_description &robot) {
  const auto named = [&](const std::string &name) {
    return std::find_if(robot.links.begin(), robot.links.end(),
                        [&](const link_description &l) { return l.name == name; });
  };
  auto l = named(p.link);
  if (l == robot.links.end() && p.link.starts_with("link:")) // as calls of models take it
    l = named(p.link.substr(5));
  if (l == robot.links.end()) {
    std::vector<std::string> names;
    for (const link_description &link : robot.links)
      names.push_back(link.name);
    text::refuse(robot.file, 0,
                 "no link " + p.link + " to carry the payload" +
                     text::suggestion(p.link, names, "name one of " + text::listed(names)));
  }
  const vec3<double> c = {p.point[0], p.point[1], p.point[2]};
  spatial_inertia<double> I;
  // (m, m c, −m [c]×²) about the link's origin, which adds up
  A::spatial_inertia_fromMassCentroid(p.mass, &c, 0, 0, 0, 0, 0, 0, &I);
  A::spatial_inertia_added(&l->inertia, &I, &l->inertia);
  l->has_inertial = true;
}

robot_description with_options(robot_description robot, const model_options &options) {
  robot.gravity = options.gravity.value_or(robot.gravity);
  robot.floating_base |= options.floating_base;
  robot.physics = options.physics.value_or(robot.physics);
  for (const payload &p : options.payloads)
    add_payload(p, robot);
  return with_rotors(std::move(robot));
}

} // namespace

model::model(robot_description robot, const model_options &options) {
  description_ = with_options(std::move(robot), options);
  model_builder(*this).build();
}

// What doesn't depend on inertias stays: structure, canonical axes, which follow from placements alone, tables and plan of loops.
model model::with_inertias(const std::vector<link_inertia> &inertias) const {
  model m = *this;
  for (const link_inertia &of : inertias) {
    const std::string fault = number_fault(of.inertia);
    if (!fault.empty())
      throw description_error("link " + m.links_[static_cast<std::size_t>(of.link)].name + ": " + fault);
    m.links_[static_cast<std::size_t>(of.link)].inertia = of.inertia;
    m.links_[static_cast<std::size_t>(of.link)].has_inertial = true;
  }
  for (std::size_t i = 0; i < m.link_index_.size(); ++i) {
    const link_description &link = m.links_[static_cast<std::size_t>(m.link_index_[i])];
    m.description_.links[i].inertia = link.inertia;
    m.description_.links[i].has_inertial = link.has_inertial;
  }
  model_builder(m).add_inertias();
  // compiled code is for the inertias of this model
  m.code_ = nullptr;
  return m;
}

// Rounded for single precision as the builder rounds it; views hold a copy of it.
model model::with_gravity(const std::array<double, 3> &gravity) const {
  for (const double x : gravity)
    if (!std::isfinite(x))
      throw description_error("gravity must have three finite numbers, m/s² in world axes");
  model m = *this;
  m.description_.gravity = gravity;
  m.double_.gravity = {gravity[0], gravity[1], gravity[2]};
  m.single_.gravity = {static_cast<float>(gravity[0]), static_cast<float>(gravity[1]), static_cast<float>(gravity[2])};
  m.set_views();
  m.code_ = nullptr;
  return m;
}

model model::with_code(std::shared_ptr<const machine_code> code) const {
  model m = *this;
  m.code_ = std::move(code);
  return m;
}

double model::mass() const {
  double sum = 0;
  for (const link_description &l : links_)
    sum += l.inertia.m;
  return sum;
}

/// Links of a subtree are a range, [link of the joint, that + n).
double model::subtree_mass(int joint) const {
  double sum = 0;
  const int first = joints_[static_cast<std::size_t>(joint)].link, n = subtree_links(joint, nullptr);
  for (int l = first; l < first + n; ++l)
    sum += links_[static_cast<std::size_t>(l)].inertia.m;
  return sum;
}

int model::support(int link, int *joints) const {
  int n = 0;
  for (int l = link; l >= 0;) {
    const int above = joint_above(l);
    const joint_row &joint = joints_[static_cast<std::size_t>(above)];
    if (joint.parent_link >= 0 || joint.v_index >= 0) { // the weld of the root to the ground is no joint of the robot
      if (joints)
        joints[n] = above;
      ++n;
    }
    l = joint.parent_link;
  }
  if (joints)
    std::reverse(joints, joints + n);
  return n;
}

std::vector<int> model::support(int link) const {
  std::vector<int> joints(static_cast<std::size_t>(support(link, nullptr)));
  support(link, joints.data());
  return joints;
}

/// Links are numbered depth first, so that those of a subtree follow each other.
int model::subtree_links(int joint, int *links) const {
  const int first = joints_[static_cast<std::size_t>(joint)].link, all = static_cast<int>(links_.size());
  int end = first + 1;
  // a link belongs to the subtree as long as its parent does; the first whose parent is before the subtree ends it
  while (end < all && double_.links[static_cast<std::size_t>(end)].parent >= first)
    ++end;
  for (int l = first; links && l < end; ++l)
    links[l - first] = l;
  return end - first;
}

std::vector<int> model::subtree_links(int joint) const {
  std::vector<int> links(static_cast<std::size_t>(subtree_links(joint, nullptr)));
  subtree_links(joint, links.data());
  return links;
}

std::string unknown_name(const std::string &what, const std::string &name, const std::vector<std::string> &known) {
  return "no " + what + " named " + text::quoted(name) + text::suggestion(name, known, "known: " + text::listed(known));
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

std::string model::massless_joint_text() const {
  return massless_joint_ < 0 ? "" : massless_joint_text(massless_joint_);
}

std::string model::massless_joint_text(int index) const {
  const joint_row &joint = joints_[static_cast<std::size_t>(index)];
  return text::printable("joint " + joint.name + (index == massless_joint_ ? "" : ", at this position,") +
                         " can move without moving any mass, so that its acceleration is not determined; give link " +
                         links_[static_cast<std::size_t>(joint.link)].name +
                         " or a link beyond it mass and inertia, or fix the joint");
}

std::string model::exact_friction_text() {
  return "exact dry friction jumps at rest, so that accelerations under given efforts and derivatives are not determined; take the smooth "
         "law, \"friction\", with a width";
}

std::vector<int> model::tree_columns() const {
  std::vector<int> columns(static_cast<std::size_t>(tree_elements()));
  tree_columns(columns.data());
  return columns;
}

/// The column of each element of the tree-sparse mass matrix, row by row: the coordinates on the path from the ground to that of the row.  A body
/// with one coordinate that carries two such bodies:
///
///     M    x  x  x        tree_row_   0  1     3             columns   0 | 0 1 | 0 2
///          x  x  .
///          x  .  x        M_12 = 0: neither carries the other
void model::tree_columns(int *columns) const {
  const model_view<double> m = view();
  for (int i = 1; i < m.bodies; ++i)
    for (int c = 0; c < m.body[i].nv; ++c) {
      int *const row = columns + tree_row_[static_cast<std::size_t>(m.body[i].v_index + c)];
      row[m.body[i].ancestors + c] = m.body[i].v_index + c;
      for_each_ancestor(m, i, c, [&](index column, index place) { row[place] = static_cast<int>(column); });
    }
}

} // namespace ksl
