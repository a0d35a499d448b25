// What is refused, and what is only said:
//
//     check_tree        names that are missing or given twice; numbers that aren't finite; links with two joints above them; several roots; cycles:
//                       refused, since that is no mechanism
//     check_inertias    inertias that no body has: a line for each, refused where a reader is strict
//     check_masses      mechanisms of which nothing that moves has mass: refused, unless they are for kinematics
//
// A fault names the first link or joint of the file that has it, and its line.
#include "description/structure/check.hpp"

#include "description/structure/force_elements.hpp"
#include "description/parts/joint_numbers.hpp"
#include "description/structure/loops.hpp"
#include "ksl/engine/model/joints.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

namespace ksl {

namespace {

using text::in_line;
using text::listed;
using text::quoted;

[[noreturn]] void refuse(const robot_description &robot, file_position at, const std::string &what) {
  text::refuse(robot.file, at.line, what);
}

std::size_t index(int i) { return static_cast<std::size_t>(i); }

/// Refuses empty names and duplicate names; `kind` is "link" or "joint".
template <class Item>
void check_names(const robot_description &robot, const std::vector<Item> &items, const std::string &kind) {
  std::map<std::string, file_position> first;
  for (const Item &item : items) {
    if (item.name.empty())
      refuse(robot, item.at, "a " + kind + " has no name; give it one");
    const auto [known, is_new] = first.try_emplace(item.name, item.at);
    if (!is_new)
      refuse(robot, item.at,
             "a second " + kind + " is named " + quoted(item.name) +
                 (known->second.line > 0 ? ", the first is in line " + std::to_string(known->second.line)
                                         : std::string()) +
                 "; rename one of them");
  }
}

/// Does the test hold for all ten numbers of an inertia?
template <class Test> bool all_of(const spatial_inertia<double> &I, Test test) {
  const double all[] = {I.m, I.h.x, I.h.y, I.h.z, I.Ixx, I.Iyy, I.Izz, I.Ixy, I.Iyz, I.Izx};
  return std::all_of(std::begin(all), std::end(all), test);
}

bool is_finite(double x) { return std::isfinite(x); }
bool is_zero(double x) { return x == 0; }

void check_numbers(const robot_description &robot) {
  for (const link_description &link : robot.links)
    if (const std::string fault = number_fault(link.inertia); !fault.empty())
      refuse(robot, link.at, "link " + link.name + ": " + fault);
  for (const joint_description &joint : robot.joints)
    check_joint_numbers(robot, joint);
}

/// The joint that carries each link, −1 for a root.  Refuses joints that don't connect two different links, and links with two
/// parents.
std::vector<int> joints_above(const robot_description &robot) {
  const int n = static_cast<int>(robot.links.size());
  std::vector<int> above(robot.links.size(), -1);
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    const joint_description &joint = robot.joints[j];
    const std::string who = "joint " + joint.name + ": ";
    if (joint.parent < 0 || joint.parent >= n || joint.child < 0 || joint.child >= n)
      refuse(robot, joint.at,
             who + "its parent is link number " + std::to_string(joint.parent) + ", its child number " +
                 std::to_string(joint.child) + ", expected 0 to " + std::to_string(n - 1) +
                 "; add both links before the joint");
    const std::string &child = robot.links[index(joint.child)].name;
    if (joint.parent == joint.child)
      refuse(robot, joint.at, who + "link " + child + " is both its parent and its child; name two links");
    int &joint_above = above[index(joint.child)];
    if (joint_above >= 0) {
      const joint_description &first = robot.joints[index(joint_above)];
      refuse(robot, joint.at,
             "link " + child + " has two parents, through joint " + first.name + in_line(first.at.line) +
                 " and joint " + joint.name + in_line(joint.at.line) +
                 "; the links of a robot form a tree: remove one of these joints");
    }
    joint_above = static_cast<int>(j);
  }
  return above;
}

[[noreturn]] void refuse_cycle(const robot_description &robot, const std::vector<int> &above, int link) {
  std::vector<std::string> links, joints;
  const int start = link;
  do {
    const joint_description &joint = robot.joints[index(above[index(link)])];
    links.push_back(robot.links[index(link)].name);
    joints.push_back(joint.name);
    link = joint.parent;
  } while (link != start);
  // collected from child to parent, reported from parent to child
  std::reverse(links.begin(), links.end());
  std::reverse(joints.begin(), joints.end());
  refuse(robot, robot.joints[index(above[index(start)])].at,
         "links " + listed(links) + " form a cycle; the links of a robot form a tree: remove one of the joints " +
             listed(joints));
}

/// Follows the parents of every link up to the root or to a link that has been visited.  If that was visited from the same
/// start, it is on a cycle.
/// Each link is visited once:
///
///     from link 5:   5 → 4 → root         all are met from 5
///     from link 6:   6 → 4                4 was met from 5, and leads to a root
///     from link 7:   7 → 9 → 8 → 7        7 was met from 7: a cycle
void check_cycles(const robot_description &robot, const std::vector<int> &above) {
  std::vector<int> met_from(robot.links.size(), -1);
  for (int start = 0; start < static_cast<int>(robot.links.size()); ++start) {
    int link = start;
    while (link >= 0 && met_from[index(link)] < 0) {
      met_from[index(link)] = start;
      const int joint = above[index(link)];
      link = joint < 0 ? -1 : robot.joints[index(joint)].parent;
    }
    if (link >= 0 && met_from[index(link)] == start)
      refuse_cycle(robot, above, link);
  }
}

int only_root(const robot_description &robot, const std::vector<int> &above) {
  std::vector<std::string> roots;
  int root = -1, second = -1;
  for (int link = 0; link < static_cast<int>(robot.links.size()); ++link) {
    if (above[index(link)] >= 0)
      continue;
    roots.push_back(robot.links[index(link)].name + in_line(robot.links[index(link)].at.line));
    if (root < 0)
      root = link;
    else if (second < 0)
      second = link;
  }
  if (second >= 0)
    refuse(robot, robot.links[index(second)].at,
           "links " + listed(roots) +
               " have no parent, but a robot has one root; join them by joints, or remove all "
               "but one");
  return root;
}

struct symmetric { double xx, yy, zz, xy, yz, zx; };

/// Eigenvalues in ascending order, by Jacobi rotations (Golub and Van Loan, Matrix Computations, 8.5).
void eigenvalues(const symmetric &A, double out[3]) {
  double a[3][3] = {{A.xx, A.xy, A.zx}, {A.xy, A.yy, A.yz}, {A.zx, A.yz, A.zz}};
  for (int sweep = 0; sweep < 16; ++sweep)
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (a[p][q] == 0)
          continue;
        // J = [c s; −s c] in the plane (p, q) makes a_pq zero: t = s / c is the smaller root of t² + 2 τ t − 1 = 0, so that a rotation is at most π/4
        const int r = 3 - p - q;
        const double tau = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = std::copysign(1.0, tau) / (std::fabs(tau) + std::hypot(1.0, tau));
        const double c = 1 / std::hypot(1.0, t), s = t * c;
        const double arp = a[r][p], arq = a[r][q], apq = a[p][q];
        a[p][p] -= t * apq;
        a[q][q] += t * apq;
        a[p][q] = a[q][p] = 0;
        a[r][p] = a[p][r] = c * arp - s * arq;
        a[r][q] = a[q][r] = s * arp + c * arq;
      }
  for (int i = 0; i < 3; ++i)
    out[i] = a[i][i];
  std::sort(out, out + 3);
}

/// The inertia matrix about the centroid.
/// By the theorem of parallel axes, I_c = I_o − m (c·c 1 − c cᵀ), h = m c; the products of inertia are elements of the matrix, −∫xy dm.
symmetric about_centroid(const spatial_inertia<double> &I) {
  const vec3<double> c = {I.h.x / I.m, I.h.y / I.m, I.h.z / I.m};
  return {I.Ixx - (I.h.y * c.y + I.h.z * c.z),
          I.Iyy - (I.h.z * c.z + I.h.x * c.x),
          I.Izz - (I.h.x * c.x + I.h.y * c.y),
          I.Ixy + I.h.x * c.y,
          I.Iyz + I.h.y * c.z,
          I.Izx + I.h.z * c.x};
}

/// kg and kg m²: nothing that is built goes beyond, as python/ksl/base/judged.py has it for formats that are read there.
constexpr double least_mass = 1e-15, largest_mass = 1e12, largest_moment = 1e18;

/// Describes what makes an inertia impossible for a rigid body, or for any machine; empty if it is possible.
/// With λ₁ ≥ λ₂ ≥ λ₃ the moments about principal axes through the centroid, λ₂ + λ₃ − λ₁ = 2 ∫x² dm ≥ 0, x along the first axis: no body has a moment
/// above the sum of the other two (Traversaro, Brossette, Escande, Nori, Identification of Fully Physical Consistent Inertial Parameters using
/// Optimization on Manifolds, 2016).
std::string fault_of(const spatial_inertia<double> &I) {
  using text::shown;
  if (!all_of(I, is_finite))
    return "mass or inertia is not finite";
  if (I.m < 0)
    return "mass " + shown(I.m) + " is negative";
  if (I.m == 0)
    return all_of(I, is_zero) ? "" : "mass 0 with an inertia that is not zero";
  if (I.m < least_mass || I.m > largest_mass)
    return "mass " + shown(I.m) + " kg; expected " + shown(least_mass) + " to " + shown(largest_mass) + " kg, or 0";
  const auto [least, middle, largest] = principal_moments(I);
  if (largest > largest_moment)
    return "a principal moment of " + shown(largest) + " kg m²; expected at most " + shown(largest_moment);
  // the matrix about the origin has lost digits that are small relative to m |c|², which is no fault of the file
  const double rounding = 1e-14 * (I.h.x * I.h.x + I.h.y * I.h.y + I.h.z * I.h.z) / I.m;
  const double tolerance = 1e-6 * std::max(std::fabs(largest), std::fabs(least)) + rounding;
  // a moment within the tolerance of zero is reported as zero
  const auto said = [&](double moment) { return shown(std::fabs(moment) <= tolerance ? 0 : moment); };
  const std::string are = "principal moments " + said(largest) + ", " + said(middle) + ", " + said(least) + ": ";
  if (least < -tolerance)
    return are + "the smallest is negative";
  if (largest > middle + least + tolerance)
    return are + "the largest exceeds the sum of the other two by " + shown(largest - middle - least);
  return "";
}

/// Which links move: on a joint of their own, with a link that they are welded to, or with a floating root.
std::vector<bool> moving_links(const robot_description &robot, bool floating_base) {
  const std::vector<int> above = joints_above(robot);
  // links that are welded to each other are decided at once, by what carries the uppermost of them
  //     ground ─ base ═ plate ─ revolute ─ arm ═ tool        ═ welded        base and plate rest, arm and tool move
  enum { unknown, rests, moves };
  std::vector<int> state(robot.links.size(), unknown);
  for (int start = 0; start < static_cast<int>(robot.links.size()); ++start) {
    int link = start;
    while (state[index(link)] == unknown) {
      const int joint = above[index(link)];
      if (joint < 0)
        state[index(link)] = floating_base ? moves : rests;
      else if (robot.joints[index(joint)].kind != joint_kind::fixed)
        state[index(link)] = moves;
      else
        link = robot.joints[index(joint)].parent;
    }
    // the links visited on the way up are welded to this one
    for (int welded = start; welded != link; welded = robot.joints[index(above[index(welded)])].parent)
      state[index(welded)] = state[index(link)];
  }
  std::vector<bool> moving;
  for (const int s : state)
    moving.push_back(s == moves);
  return moving;
}

} // namespace

std::string number_fault(const spatial_inertia<double> &inertia) {
  if (!all_of(inertia, is_finite))
    return "its inertia about the link's origin is not finite; mend its numbers";
  if (inertia.m < 0)
    return "its mass is " + text::shown(inertia.m) + ", negative; a mass is zero or more, in kg";
  return {};
}

/// Of a mass above zero.
std::array<double, 3> principal_moments(const spatial_inertia<double> &inertia) {
  std::array<double, 3> moments{};
  eigenvalues(about_centroid(inertia), moments.data());
  return moments;
}

/// In the order in which a fault hides others: names, numbers, ends of joints, cycles, loops and force elements, which name links, and then the root.
int check_tree(const robot_description &robot) {
  if (robot.links.empty())
    refuse(robot, {}, "the robot has no link; it needs at least one");
  check_names(robot, robot.links, "link");
  check_names(robot, robot.joints, "joint");
  check_numbers(robot);
  const std::vector<int> above = joints_above(robot);
  check_cycles(robot, above);
  check_loops(robot);
  check_force_elements(robot);
  return only_root(robot, above);
}

std::vector<std::string> check_inertias(const robot_description &robot) {
  std::vector<bool> is_rotor(robot.links.size(), false); // without mass, since its mass is that of the motor's link
  for (const joint_description &joint : robot.joints)
    if (joint.is_rotor)
      is_rotor[static_cast<std::size_t>(joint.child)] = true;
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    const link_description &link = robot.links[i];
    if (const std::string fault = is_rotor[i] ? "" : fault_of(link.inertia); !fault.empty())
      lines.push_back(text::printable("link " + link.name + in_line(link.at.line) + ": " + fault));
  }
  return lines;
}

std::string mend_of_masses(const robot_description &robot) {
  const auto in_text = [](const link_description &link) { return link.at.line > 0; };
  const bool of_xml = std::any_of(robot.links.begin(), robot.links.end(), in_text);
  return of_xml ? "add <inertial> to these links" : "give these links a mass";
}

std::vector<std::string> check_masses(const robot_description &robot, bool floating_base,
                                      const std::set<std::string> &with_payload, bool masses_optional) {
  const std::vector<bool> moving = moving_links(robot, floating_base);
  std::vector<std::string> names, lines;
  bool any_mass = false;
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    const link_description &link = robot.links[i];
    if (!moving[i])
      continue;
    names.push_back(link.name);
    if (link.inertia.m > 0 || with_payload.count(link.name))
      any_mass = true;
    else if (link.has_geometry)
      lines.push_back(text::printable("link " + link.name + in_line(link.at.line) +
                                      ": moves and has geometry, but no mass: its weight and inertia are missing"));
  }
  if (any_mass || names.empty())
    return lines;
  const std::string what =
      "none of the links that move (" + listed(names) + ") has a mass: neither gravity nor motion would cause a wrench";
  if (!masses_optional)
    refuse(robot, {},
           what + "; " + mend_of_masses(robot) +
               "; masses=\"optional\" in Python (masses_optional in C and C++) reads the "
               "file as it is, for kinematics");
  return {text::printable(what)};
}

void warn_of_links(robot_description &robot, const std::vector<std::string> &lines, bool strict,
                   const std::string &mend) {
  if (!strict || lines.empty()) {
    robot.warnings.insert(robot.warnings.end(), lines.begin(), lines.end());
    return;
  }
  std::string what;
  for (std::size_t i = 0; i < lines.size() && i < 3; ++i)
    what += lines[i] + "; ";
  if (lines.size() > 3)
    what += std::to_string(lines.size() - 3) + " more such links; ";
  refuse(robot, {}, what + mend + ", or read the file without strict");
}

} // namespace ksl
