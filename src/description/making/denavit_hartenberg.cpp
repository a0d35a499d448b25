// Chains of links from tables of Denavit–Hartenberg parameters.
//
// From the frame of row i − 1 to that of row i, Rx(α, a) being a rotation by α about x and a displacement by a along it, and Rz(θ, d) likewise,
//
//     standard    Rz(θ, d) Rx(α, a)    joint i is about z of frame i − 1     (Denavit and Hartenberg 1955)
//     modified    Rx(α, a) Rz(θ, d)    joint i is about z of frame i         (Craig, Introduction to Robotics)
//
// θ of joints that turn and d of those that slide are where the joint is at zero.  What comes before the joint's motion is the joint's placement, and
// what comes behind it is the pose of the row's frame in the child: in the standard convention the row's link, welded to a massless one.
#include "ksl/builder.hpp"

#include "ksl/engine/model/joints.hpp"
#include "text/words.hpp"

#include <cmath>

namespace ksl {

namespace {

using A = algebra<double>;

SE3<double> about_z(double angle, double along) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {{c, s, 0, -s, c, 0, 0, 0, 1}, {0, 0, along}};
}
SE3<double> about_x(double angle, double along) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {{1, 0, 0, 0, c, s, 0, -s, c}, {along, 0, 0}};
}

/// The joint in the frame of the row before, and the row's frame in the joint's child link.
struct placement { SE3<double> joint, frame; };

placement placement_of(const dh_row &row, dh_convention convention) {
  const bool slides = row.kind == joint_kind::prismatic;
  if (convention == dh_convention::modified) {
    // the joint's axis is z of its own frame, hence a constant displacement along or about it may come first
    placement p = {about_x(row.alpha, row.a), about_z(0, 0)};
    const SE3<double> constant = about_z(row.theta, row.d);
    A::product_dd(&p.joint, &constant, &p.joint);
    return p;
  }
  // the joint's axis is z of the frame before; a joint that turns stays at that frame's origin
  placement p = {about_z(row.theta, slides ? row.d : 0), about_z(0, slides ? 0 : row.d)};
  const SE3<double> across = about_x(row.alpha, row.a);
  A::product_dd(&p.frame, &across, &p.frame);
  return p;
}

void check_row(const std::string &who, const dh_row &row) {
  for (const double x : {row.a, row.alpha, row.d, row.theta})
    if (!std::isfinite(x))
      text::refuse({}, 0, who + "one of a, alpha, d, theta is not finite; mend the table");
  const joint_kind_row kind = row_of(row.kind);
  if (row.kind != joint_kind::prismatic && !only_turns(row.kind))
    text::refuse({}, 0, who + "its kind is " + kind.name + "; a table has revolute, continuous and prismatic joints");
}

/// Adds joint and link of each row.
void add_rows(builder &robot, const std::string &parent, const std::vector<dh_row> &rows, dh_convention convention,
              const std::string &prefix) {
  std::string before = parent;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string number = std::to_string(i + 1), joint = prefix + "joint" + number,
                      link = prefix + "link" + number;
    check_row("row " + number + " of the table: ", rows[i]);
    const placement p = placement_of(rows[i], convention);
    joint_options options = rows[i].options;
    options.axis = vec3<double>{0, 0, 1};
    robot.add_link(link, rows[i].mass);
    if (convention == dh_convention::modified) {
      robot.add_joint(joint, rows[i].kind, before, link, p.joint, options);
    } else {
      // the link's frame is at its end; a massless link at its start, where the joint is, is welded to it
      robot.add_link(link + "_start");
      robot.add_joint(joint, rows[i].kind, before, link + "_start", p.joint, options);
      robot.add_joint(joint + "_end", joint_kind::fixed, link + "_start", link, p.frame);
    }
    before = link;
  }
}

} // namespace

builder &builder::add_dh_chain(const std::string &parent, const std::vector<dh_row> &rows, dh_convention convention,
                               const std::string &prefix) {
  const std::size_t links = robot_.links.size(), joints = robot_.joints.size();
  try {
    add_rows(*this, parent, rows, convention, prefix);
  } catch (...) { // the whole table or nothing of it
    cut_to(links, joints);
    throw;
  }
  return *this;
}

} // namespace ksl
