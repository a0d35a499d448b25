// What becomes of a description; "expanded" are the numbers of all joints, of which a user's q and v leave out followers:
//
//     description   base ── j1 ── arm ─┬─ weld ── sensor
//                                      └─ j2 ── hand             j2 is a mimic joint: 2 j1
//
//     links         0 base    1 arm    2 sensor    3 hand         depth first
//     bodies        0 ground, with base    1 arm, with sensor    2 hand
//     q̂, v̂          (j1, j2), in the order of bodies              in_q_ = in_v_ = (0): a user has j1
//     joints        j1 | j2 | weld, that of base to the ground    those of users' numbers, followers, fixed ones; the ground's last
//
// Frames: a link's own is given relative to its joint's; a body's canonical one (ksl/engine/model/model.hpp) is chosen once all bodies are there, and
// poses, placements and inertias are then in it.  So build() makes links and bodies in frames whose z is the joint's axis, and finish() the rest.
#include "engine/building/model_builder.hpp"

#include "description/structure/check.hpp"
#include "description/parts/joint_numbers.hpp"
#include "description/structure/loops.hpp"
#include "engine/building/inertias.hpp"
#include "engine/model/canonical_axes.hpp"
#include "engine/model/joint_physics.hpp"
#include "engine/loops/exact_frames.hpp"
#include "engine/loops/idle_bodies.hpp"
#include "engine/loops/plan.hpp"
#include "engine/loops/tables.hpp"
#include "engine/model/massless_joint.hpp"
#include "text/limits.hpp"
#include "text/rounding.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>

namespace ksl {
namespace {

using A = algebra<double>;

constexpr vec3<double> none = {0, 0, 0}; ///< of a joint without an axis

/// A frame at the joint's origin with z along the unit vector z.
SE3<double> with_z(const vec3<double> &z) { return {frame_with_z(z), {0, 0, 0}}; }

} // namespace

void model_builder::build() {
  const nearest_rounding rounding;
  const int root = check_tree(m_.description_);
  leaders_ = leaders_of(m_.description_);
  collect_children();
  add_ground();
  if (m_.description_.floating_base) {
    const std::string name = floating_base_name(m_.description_);
    if (name != "floating_base")
      warn("joint floating_base of the file keeps its name; the joint that the floating base adds is called " + name);
    add_moving_link(root, -1, {name, joint_kind::floating, -1, -1, 0, 0, none, none, 0, -1}, identity, 0);
  } else {
    add_welded_link(root, -1, identity, 0);
    m_.double_.links.back().carried_by_moving_joint = true;
    m_.double_.bodies[0].link = 0;
    const bool other_link = names_other_link("base", root);
    fixed_joints_.push_back(
        {free_name(other_link ? "ground" : "base", "ground"), joint_kind::fixed, 0, -1, -1, -1, none, none, 0, -1});
  }
  descend(root);
  if (static_cast<std::size_t>(m_.expanded_nv_) > text::limits::coordinates)
    text::refuse(m_.description_.file, 0,
                 "the robot has " + std::to_string(m_.expanded_nv_) + " coordinates, more than " +
                     std::to_string(text::limits::coordinates) + "; split it, or fix some joints");
  finish();
}

/// The joints that close loops, with the links' indices of the model, once all its arrays are there.
void model_builder::add_loops() {
  for (const loop_description &loop : m_.description_.loops) {
    const joint_kind_row kind = row_of(loop.kind);
    m_.loops_.push_back({loop.name, loop.kind, m_.link_index_[static_cast<std::size_t>(loop.predecessor)],
                         m_.link_index_[static_cast<std::size_t>(loop.successor)], loop.predecessor_pose,
                         loop.successor_pose, kind.has_axis ? axis_of(as_tree_joint(loop)) : none,
                         kind.has_axis2 ? loop.axis2 : none, kind.has_pitch ? *loop.pitch : 0});
  }
  if (!m_.loops_.empty()) {
    // Each step needs those before: frames, since their digits decide ranks; a regular position, at which idle bodies are found; another one, since
    // these change which coordinates are to be independent there; the plan, made at that.
    fit_loops();
    std::vector<double> q = loops::regular_position(m_);
    if (add_idle_bodies(q))
      q = loops::regular_position(m_);
    m_.double_.loops = loops::make_plan(m_, q);
    if (m_.double_.loops)
      m_.single_.loops = loops::rounded(*m_.double_.loops);
  }
}

/// The tables of loops, whose frames are made exact where they are off by the digits of the file.
void model_builder::fit_loops() {
  loops::tables tables = loops::make_tables(m_);
  const loops::frame_fit fit = loops::fit_frames(m_, tables, m_.description_);
  for (const std::string &note : fit.notes)
    warn(note);
  for (std::size_t l = 0; l < m_.loops_.size() && fit.is_changed; ++l) {
    const loop_description &exact = m_.description_.loops[l];
    m_.loops_[l].predecessor_pose = exact.predecessor_pose, m_.loops_[l].successor_pose = exact.successor_pose;
  }
  if (fit.is_changed)
    tables = loops::make_tables(m_);
  tables.digits = fit.digits;
  m_.loop_tables_ = std::make_shared<const loops::tables>(std::move(tables));
}

/// Bodies that turn alone at this position.  Returns whether some are idle.
bool model_builder::add_idle_bodies(const std::vector<double> &q) {
  std::vector<loops::idle_body> bodies;
  if (!q.empty())
    bodies = loops::bodies_that_turn_alone(m_, q);
  if (bodies.empty())
    return false;
  loops::tables tables = *m_.loop_tables_;
  loops::keep(std::move(bodies), tables);
  const bool are_idle = !tables.idle.empty();
  m_.loop_tables_ = std::make_shared<const loops::tables>(std::move(tables));
  return are_idle;
}

void model_builder::add_force_elements() {
  const robot_description &robot = m_.description_;
  for (const force_element_description &of : robot.force_elements)
    m_.force_elements_.push_back({of.name, m_.link_index_[static_cast<std::size_t>(of.link1)],
                                  m_.link_index_[static_cast<std::size_t>(of.link2)], of.point1, of.point2,
                                  of.numbers});
  m_.acting_force_elements_ = robot.physics.force_elements ? static_cast<int>(m_.force_elements_.size()) : 0;
}

void model_builder::add_inertias() {
  const nearest_rounding rounding;
  sum_inertias();
  augment_inertias();
  auto &s = m_.single_;
  for (std::size_t i = 0; i < s.links.size(); ++i)
    s.links[i].inertia = spread<float>(m_.double_.links[i].inertia);
  s.inertia.assign(m_.double_.inertia.begin(), m_.double_.inertia.end());
  for (std::size_t i = 0; i < s.augmented.size(); ++i)
    s.augmented[i] = spread<float>(m_.double_.augmented[i]);
  m_.set_views();
  find_massless_joint();
}

/// Looks for a joint that moves no mass.  A line of the warnings names it, unless nothing has mass, since such a model is for
/// kinematics.  If the model was made from another one with other inertias, the line of that model is removed first.
void model_builder::find_massless_joint() {
  const std::string beginning = "forward dynamics are refused: ";
  std::vector<std::string> &lines = m_.description_.warnings;
  std::erase_if(lines, [&](const std::string &line) { return line.compare(0, beginning.size(), beginning) == 0; });
  // a loop may give mass to a joint that moves none in the tree: each state of a closed mechanism is judged by itself
  m_.massless_joint_ = m_.description_.loops.empty() ? ksl::massless_joint(m_) : -1;
  if (m_.massless_joint_ >= 0 && m_.mass() > 0)
    warn(beginning + m_.massless_joint_text());
}

/// Adds a line to the warnings, unless it is there.  The description may be that of another model, which has the line already.
void model_builder::warn(const std::string &line) {
  std::vector<std::string> &lines = m_.description_.warnings;
  if (std::find(lines.begin(), lines.end(), line) == lines.end())
    lines.push_back(line);
}

void model_builder::collect_children() {
  const robot_description &robot = m_.description_;
  children_.resize(robot.links.size());
  m_.link_index_.assign(robot.links.size(), -1);
  for (std::size_t j = 0; j < robot.joints.size(); ++j)
    children_[static_cast<std::size_t>(robot.joints[j].parent)].push_back(static_cast<int>(j));
}

void model_builder::add_ground() {
  m_.double_.bodies.push_back(new_body(joint_kind::fixed, -1, -1, identity));
  m_.double_.bodies.back().is_base = true;
}

/// A name for a joint that the file doesn't have: the usual one, or if a joint of the file has that name, one that no joint has.
std::string model_builder::free_name(const char *usual, const char *otherwise) const {
  const auto is_taken = [&](const std::string &name) {
    return text::has_name(m_.description_.joints, name) || text::has_name(m_.description_.loops, name);
  };
  return text::free_name(is_taken(usual) ? otherwise : usual, is_taken);
}

/// Has a link other than the root this name?  A joint that the model adds is then not called so, since it would be taken for the joint
/// that carries that link.
bool model_builder::names_other_link(const char *name, int root) const {
  const std::vector<link_description> &links = m_.description_.links;
  for (std::size_t l = 0; l < links.size(); ++l)
    if (links[l].name == name && static_cast<int>(l) != root)
      return true;
  return false;
}

/// Adds all links, depth first, children in the order of the file.  Not recursive, since chains can be long.
void model_builder::descend(int root) {
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

/// In reverse, since the last is taken first: links keep the order of the file.
void model_builder::push_children(int description_link, std::vector<int> &pending) const {
  const std::vector<int> &joints = children_[static_cast<std::size_t>(description_link)];
  pending.insert(pending.end(), joints.rbegin(), joints.rend());
}

void model_builder::add_link(const joint_description &j, int index) {
  const int parent = m_.link_index_[static_cast<std::size_t>(j.parent)];
  const link<double> &p = m_.double_.links[static_cast<std::size_t>(parent)];
  SE3<double> placement; // of the joint's frame in the parent body's canonical frame
  A::product_dd(&p.pose, &j.placement, &placement);
  if (j.kind == joint_kind::fixed) {
    fixed_joints_.push_back(
        {j.name, j.kind, static_cast<int>(m_.double_.links.size()), parent, -1, -1, none, none, 0, index});
    add_welded_link(j.child, parent, placement, p.body);
  } else {
    const joint_kind_row kind = row_of(j.kind);
    joint_row row = {j.name,
                     j.kind,
                     -1,
                     parent,
                     m_.nq_,
                     m_.nv_,
                     kind.has_axis ? axis_of(j) : none,
                     kind.has_axis2 ? j.axis2 : none,
                     kind.has_pitch ? *j.pitch : 0,
                     index};
    if (const leader_of_joint &leader = leaders_[static_cast<std::size_t>(index)]; leader.joint >= 0) {
      row.q_index = row.v_index = -1;
      row.leader = leader.joint; // an index into the description's joints until couple() replaces it
      row.multiplier = leader.multiplier, row.offset = leader.offset;
    }
    add_moving_link(j.child, parent, std::move(row), placement, p.body);
  }
}

void model_builder::add_moving_link(int description_link, int parent, joint_row row, const SE3<double> &joint_placement,
                                    int parent_body) {
  const joint_kind_row kind = row_of(row.kind);
  // parent body's canonical frame ── placement ──> this body's ── pose ──> the link's own, which is the joint's: pose = canonical⁻¹
  SE3<double> canonical = kind.has_axis ? with_z(row.axis) : identity, placement, pose; // in the joint's frame
  A::product_dd(&joint_placement, &canonical, &placement);
  row.link = static_cast<int>(m_.double_.links.size());
  if (kind.has_axis2) {
    //     parent ── placement ──> inside, z the first axis ── canonical⁻¹ second ──> this body, z the second axis
    //
    // a massless body turns about the first axis; the second is placed on it
    const int inside = add_body(joint_kind::revolute, parent_body, -1, placement, 0);
    const SE3<double> second = with_z(row.axis2);
    A::product_dinvd(&canonical, &second, &placement);
    add_body(joint_kind::revolute, inside, row.link, placement, 0);
    m_.double_.bodies.back().ends_universal = true;
    canonical = second;
  } else {
    add_body(row.kind, parent_body, row.link, placement, row.pitch, row.leader >= 0);
  }
  if (kind.quaternion >= 0)
    m_.quaternions_.push_back({row.q_index + kind.quaternion, static_cast<int>(m_.joints_.size())});
  (row.leader >= 0 ? followers_ : m_.joints_).push_back(std::move(row));
  A::SE3_inverted(&canonical, &pose);
  add_welded_link(description_link, parent, pose, static_cast<int>(m_.double_.bodies.size()) - 1);
  m_.double_.links.back().carried_by_moving_joint = true;
}

/// Adds a body, and its joint's numbers to the expanded arrays and, unless it follows another joint, to q and v.  Returns its
/// index.
int model_builder::add_body(joint_kind kind, int parent, int link, const SE3<double> &placement, double pitch,
                            bool follows) {
  const joint_kind_row row = row_of(kind);
  m_.double_.bodies.push_back(new_body(kind, parent, link, placement));
  m_.double_.bodies.back().pitch = pitch;
  m_.double_.bodies.back().follows = follows;
  for (int i = 0; i < row.nq && !follows; ++i)
    m_.in_q_.push_back(m_.expanded_nq_ + i);
  for (int i = 0; i < row.nv && !follows; ++i)
    m_.in_v_.push_back(m_.expanded_nv_ + i);
  m_.nq_ = static_cast<int>(m_.in_q_.size()), m_.nv_ = static_cast<int>(m_.in_v_.size());
  m_.expanded_nq_ += row.nq, m_.expanded_nv_ += row.nv;
  m_.pose_numbers_ += row.pose_numbers;
  return static_cast<int>(m_.double_.bodies.size()) - 1;
}

/// A body on a joint whose numbers in q and v follow those of all joints so far.
body<double> model_builder::new_body(joint_kind kind, int parent, int link, const SE3<double> &placement) const {
  const joint_kind_row row = row_of(kind);
  body<double> b{};
  b.kind = kind == joint_kind::continuous ? joint_kind::revolute : kind;
  b.described = kind;
  b.parent = parent;
  b.q_index = m_.expanded_nq_, b.v_index = b.v_end = m_.expanded_nv_;
  b.nv = row.nv;
  b.angle_index = row.angle < 0 ? -1 : m_.expanded_nq_ + row.angle;
  b.chain_start = chain_start(kind, parent);
  const int added = static_cast<int>(m_.double_.bodies.size());
  if (parent >= 0) {
    const body<double> &p = m_.double_.bodies[static_cast<std::size_t>(parent)];
    // a line goes on where the parent is the body before, and not the ground: its coordinates then follow each other in v
    b.line_start = parent > 0 && parent == added - 1 ? p.line_start : added;
    b.ancestors = p.ancestors + p.nv;
  }
  b.pose_index = m_.pose_numbers_;
  b.link = link;
  b.is_base = parent == 0 && row.is_free;
  b.no_offset = true;
  b.placement = placement;
  b.offset = b.alpha = b.theta0 = no_rotation;
  return b;
}

/// body::chain_start for a new body on this parent.
/// Of revolute (R) and prismatic (P) joints, body 5 on body 2:
///
///     bodies        0 ─ 1R ─ 2R ─┬─ 3P ─ 4R        line_start     1  1  1  1  5        each body on the one before it
///                                └─ 5R             chain_start    1  1  3  4  5        and only rotations
int model_builder::chain_start(joint_kind kind, int parent) const {
  const auto &bodies = m_.double_.bodies;
  const int added = static_cast<int>(bodies.size());
  return only_turns(kind) && parent == added - 1 && only_turns(bodies.back().kind) ? bodies.back().chain_start : added;
}

void model_builder::add_welded_link(int description_link, int parent, const SE3<double> &pose, int body) {
  m_.link_index_[static_cast<std::size_t>(description_link)] = static_cast<int>(m_.double_.links.size());
  m_.double_.links.push_back({body, parent, false, false, {}, pose, {}});
  m_.links_.push_back(m_.description_.links[static_cast<std::size_t>(description_link)]);
}

/// The order: couple() while the list has no fixed joints yet; inertias once canonical frames are there, in which they are; angles, since theta0 is part
/// of the choice of frames; single precision once all of double precision is there.  Joints without mass and plans of loops are found by calls of the
/// model, which needs its views for them; the plan becomes part of the views.
void model_builder::finish() {
  m_.moving_joints_ = static_cast<int>(m_.joints_.size());
  couple();
  // the joint to the ground was created first and is listed last
  if (!m_.description_.floating_base) {
    m_.joints_.insert(m_.joints_.end(), fixed_joints_.begin() + 1, fixed_joints_.end());
    m_.joints_.push_back(fixed_joints_.front());
  } else {
    m_.joints_.insert(m_.joints_.end(), fixed_joints_.begin(), fixed_joints_.end());
  }
  m_.joint_above_.assign(m_.links_.size(), -1);
  for (std::size_t j = 0; j < m_.joints_.size(); ++j)
    m_.joint_above_[static_cast<std::size_t>(m_.joints_[j].link)] = static_cast<int>(j);
  const auto &[x, y, z] = m_.description_.gravity;
  m_.double_.gravity = {x, y, z};
  close_subtrees();
  choose_canonical_axes(m_.double_.bodies, m_.double_.links);
  sum_inertias();
  add_tree_rows();
  augment_inertias();
  check_finite();
  add_angles();
  add_limits();
  add_ranges();
  m_.double_.physics = joint_physics(m_.description_, expanded_rows(), m_.expanded_nv_);
  round_to_single();
  m_.set_views();
  find_massless_joint();
  add_force_elements();
  add_loops();
  m_.set_views();
}

/// The joints that move, with the places of their numbers in the expanded mechanism.
std::vector<joint_row> model_builder::expanded_rows() const {
  std::vector<joint_row> rows;
  for (joint_row row : m_.joints_) {
    const int nv = row_of(row.kind).nv;
    if (nv == 0 || row.description < 0)
      continue;
    const link<double> &l = m_.double_.links[static_cast<std::size_t>(row.link)];
    const body<double> &b = m_.double_.bodies[static_cast<std::size_t>(l.body)];
    row.q_index = b.q_index, row.v_index = b.v_index + b.nv - nv; // a universal joint ends with its second body
    rows.push_back(std::move(row));
  }
  return rows;
}

/// Lists the followers after the joints that have numbers of their own, and sets by which numbers each of them moves.
/// Until then a follower's leader is an index into the description's joints; afterwards, as all else, into the model's.
void model_builder::couple() {
  const auto numbers_of_joint = [&](const joint_row &row) -> const body<double> & {
    const int link = row.link;
    return m_.double_.bodies[static_cast<std::size_t>(m_.double_.links[static_cast<std::size_t>(link)].body)];
  };
  std::vector<int> of_description(m_.description_.joints.size(), -1);
  for (int j = 0; j < m_.moving_joints_; ++j)
    if (const int described = m_.joints_[static_cast<std::size_t>(j)].description; described >= 0)
      of_description[static_cast<std::size_t>(described)] = j;
  for (joint_row &row : followers_) {
    row.leader = of_description[static_cast<std::size_t>(row.leader)];
    const body<double> &b = numbers_of_joint(row),
                       &l = numbers_of_joint(m_.joints_[static_cast<std::size_t>(row.leader)]);
    m_.double_.followers.push_back({b.q_index, b.v_index, l.q_index, l.v_index, row.multiplier, row.offset});
  }
  m_.joints_.insert(m_.joints_.end(), followers_.begin(), followers_.end());
}

/// Sets where the numbers of each subtree end in v.  Bodies are in depth-first order.
void model_builder::close_subtrees() {
  std::vector<body<double>> &bodies = m_.double_.bodies;
  for (std::size_t i = bodies.size(); i-- > 0;) {
    body<double> &b = bodies[i];
    // depth first, the numbers of a body and of all that it carries are one range of v:
    //
    //     … │ its own │ its children's, and theirs │ the next branch …
    //       v_index                                v_end
    b.has_children = b.v_end > b.v_index;
    b.v_end = std::max(b.v_end, b.v_index + b.nv);
    if (b.parent >= 0) {
      body<double> &parent = bodies[static_cast<std::size_t>(b.parent)];
      parent.v_end = std::max(parent.v_end, b.v_end);
      // the first child is the body after its parent; any other one begins a branch
      if (b.parent + 1 != static_cast<int>(i))
        parent.last_branch = std::max(parent.last_branch, static_cast<int>(i));
    }
  }
}

/// Transforms the inertia of each link from its own frame to its body's.  The inertia of a body is the sum over its links.
void model_builder::sum_inertias() {
  auto &d = m_.double_;
  // ten numbers a body, those of a block of bodies side by side, for lanes (body_lanes.hpp)
  //     [ m of bodies 0 … W − 1 │ hx of these │ … │ Izx of these ] [ the same of bodies W … 2 W − 1 ] …       the last block is filled up with zeros
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

/// Sets where the rows of the tree-sparse mass matrix begin (tree_rows.hpp), and alpha_of_tensor of all bodies.
void model_builder::add_tree_rows() {
  for (body<double> &b : m_.double_.bodies) {
    b.alpha_of_tensor = of_tensor(b.alpha);
    m_.longest_path_ = std::max(m_.longest_path_, b.ancestors + b.nv);
    for (int c = 0; c < b.nv; ++c)
      // the row of a coordinate has an element for each on its path from the ground, itself the last.  Of a body with one coordinate that carries two
      // such bodies, which carry none: rows of 1, 2 and 2 elements, tree_row_ = (0, 1, 3, 5)
      m_.tree_row_.push_back(m_.tree_row_.back() + b.ancestors + c + 1);
  }
}

/// The augmented inertias of subtree_inertia.hpp.
void model_builder::augment_inertias() {
  auto &d = m_.double_;
  const auto bodies = d.bodies.size();
  d.augmented.resize(bodies);
  for (std::size_t i = 0; i < bodies; ++i)
    d.augmented[i] = bodies_at<double, double>{static_cast<int>(i)}.get<spatial_inertia>(d.inertia.data());
  for (std::size_t i = bodies; i-- > 1;) {
    const body<double> &b = d.bodies[i];
    spatial_inertia<double> &parent = d.augmented[static_cast<std::size_t>(b.parent)];
    // from the tips inwards, so that augmented[i].m has grown to all that joint i carries
    add_mass_beyond(b, d.augmented[i].m, parent); // that of the whole subtree
  }
}

/// Refuses a model whose numbers overflow: those of the description are finite, but not their products.
void model_builder::check_finite() const {
  const auto are_finite = [](const auto &value) {
    double numbers[sizeof value / sizeof(double)];
    std::memcpy(numbers, &value, sizeof value);
    return std::all_of(std::begin(numbers), std::end(numbers), [](double x) { return std::isfinite(x); });
  };
  const auto &d = m_.double_;
  // From the tips: the numbers of a body that carries a faulty one overflow, too, and the tip is the one to name.
  for (std::size_t i = d.bodies.size(); i-- > 0;) {
    const body<double> &b = d.bodies[i];
    const bool fine = are_finite(b.placement) && are_finite(b.theta0) && are_finite(b.alpha) && are_finite(b.offset) &&
                      are_finite(d.augmented[i]) &&
                      are_finite(bodies_at<double, double>{static_cast<int>(i)}.get<spatial_inertia>(d.inertia.data()));
    if (fine)
      continue;
    const int link =
        b.link < 0 ? d.bodies[i + 1].link : b.link; // inside a universal joint: the link is that of the next body
    text::refuse(
        m_.description_.file, 0,
        "link " + m_.links_[static_cast<std::size_t>(link)].name +
            ": its place, or the inertia of it and of what it carries, is not finite, since some numbers are too "
            "large for their products; correct masses, inertias and lengths");
  }
}

/// The constants theta0 of joint angles, as contiguous arrays that can be loaded into lanes.
void model_builder::add_angles() {
  auto &d = m_.double_;
  // and a register more, since one may be loaded at any index (pose_in_parent.hpp)
  const auto angles = static_cast<std::size_t>(padded(m_.expanded_nq_) + padded(1));
  d.theta0_sine.assign(angles, 0);
  d.theta0_cosine.assign(angles, 1);
  d.first_angle = m_.expanded_nq_;
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

/// Limits of the numbers of joints, in the expanded mechanism.
/// Where there is none, ±∞, so that a comparison needs no question before it.
void model_builder::add_limits() {
  const auto n = static_cast<std::size_t>(m_.expanded_nq_);
  m_.double_.lower.assign(n, -HUGE_VAL), m_.double_.upper.assign(n, HUGE_VAL);
  for (const joint_row &j : m_.joints_) {
    const int numbers = numbers_with_limits(row_of(j.kind));
    if (j.description < 0 || numbers == 0)
      continue;
    const joint_description &given = m_.description_.joints[static_cast<std::size_t>(j.description)];
    const int body = m_.double_.links[static_cast<std::size_t>(j.link)].body;
    const ksl::body<double> &b = m_.double_.bodies[static_cast<std::size_t>(body)];
    const auto first = static_cast<std::size_t>(b.ends_universal ? b.q_index - 1 : b.q_index);
    for (int c = 0; c < numbers; ++c) {
      const auto [lower, upper] = limits_of(given, c);
      m_.double_.lower[first + static_cast<std::size_t>(c)] = lower.value_or(-INFINITY);
      m_.double_.upper[first + static_cast<std::size_t>(c)] = upper.value_or(INFINITY);
    }
  }
}

/// Sets the range that random positions are drawn from, for each number in q: between the limits; where there are none, from −π to π
/// for angles and from −1 to 1 for others.
void model_builder::add_ranges() {
  std::vector<bool> is_angle(static_cast<std::size_t>(m_.expanded_nq_));
  for (const body<double> &b : m_.double_.bodies)
    if (b.angle_index >= 0)
      is_angle[static_cast<std::size_t>(b.angle_index)] = true;
  for (const int i : m_.in_q_) {
    const double most = is_angle[static_cast<std::size_t>(i)] ? std::acos(-1.0) : 1;
    m_.position_ranges_.push_back({-most, most});
  }
  for (const model::quaternion_in_q &quaternion : m_.quaternions_)
    for (int i = 0; i < 4; ++i)
      m_.position_ranges_[static_cast<std::size_t>(quaternion.q_index + i)] = {-1, 1};
  const double infinity = std::numeric_limits<double>::infinity();
  std::vector<model::position_range> limits(m_.position_ranges_.size(), {-infinity, infinity});
  for (const std::string &line : check_couplings(m_.description_))
    warn(line);
  for (const joint_row &row : m_.joints_) // followers come after their leaders
    for (int c = 0; row.description >= 0 && c < numbers_with_limits(row_of(row.kind)); ++c)
      narrow(limits, row, c);
  for (std::size_t i = 0; i < limits.size(); ++i) { // where one limit is missing, the usual width beyond the other
    model::position_range &range = m_.position_ranges_[i];
    const auto [lower, upper] = limits[i];
    const double width = range.upper - range.lower;
    if (lower > -infinity || upper < infinity)
      range = {lower > -infinity ? lower : upper - width, upper < infinity ? upper : lower + width};
  }
}

/// Narrows the limits of number c of a joint, or of its leader, unless nothing would be left between them.
void model_builder::narrow(std::vector<model::position_range> &limits, const joint_row &row, int c) {
  const double infinity = std::numeric_limits<double>::infinity();
  const bool follows = row.leader >= 0;
  const joint_row &moved = follows ? m_.joints_[static_cast<std::size_t>(row.leader)] : row;
  const coordinate_limits described = limits_of(m_.description_.joints[static_cast<std::size_t>(row.description)], c);
  double lower = described.lower.value_or(-infinity), upper = described.upper.value_or(infinity);
  if (follows && row.multiplier == 0)
    return;
  if (follows) {
    // position = multiplier × the leader's + offset, solved for the leader's
    lower = (lower - row.offset) / row.multiplier, upper = (upper - row.offset) / row.multiplier;
    if (row.multiplier < 0)
      std::swap(lower, upper);
  }
  model::position_range &range = limits[static_cast<std::size_t>(moved.q_index + c)];
  const model::position_range both = {std::max(lower, range.lower), std::min(upper, range.upper)};
  if (both.lower <= both.upper)
    range = both;
  else
    warn("joint " + row.name + ": it follows " + moved.name +
         ", but at no position are both within their limits; those of " + row.name + " are not used");
}

/// Rounded, not built again from rounded numbers, which could choose other canonical frames where axes are nearly parallel.
void model_builder::round_to_single() {
  const auto &d = m_.double_;
  auto &s = m_.single_;
  for (const body<double> &b : d.bodies)
    s.bodies.push_back(spread<float>(b));
  for (const link<double> &l : d.links)
    s.links.push_back(spread<float>(l));
  for (const follower<double> &f : d.followers)
    s.followers.push_back(
        {f.q, f.v, f.leader_q, f.leader_v, static_cast<float>(f.multiplier), static_cast<float>(f.offset)});
  s.gravity = spread<float>(d.gravity);
  s.inertia.assign(d.inertia.begin(), d.inertia.end());
  for (const spatial_inertia<double> &I : d.augmented)
    s.augmented.push_back(spread<float>(I));
  s.theta0_sine.assign(d.theta0_sine.begin(), d.theta0_sine.end());
  s.theta0_cosine.assign(d.theta0_cosine.begin(), d.theta0_cosine.end());
  s.lower.assign(d.lower.begin(), d.lower.end()), s.upper.assign(d.upper.begin(), d.upper.end());
  for (const coordinate_physics<double> &c : d.physics)
    s.physics.push_back(spread<float>(c));
  s.first_angle = d.first_angle, s.angles_end = d.angles_end;
}

} // namespace ksl
