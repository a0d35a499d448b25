// Loop by loop: its links and frames; what its joint leaves free, and the wrenches T, which are what is left of ℝ⁶; the coordinates on both ways from
// the common link, with their signs, and on the way its length.  Then what needs all loops: the mechanism's length, which is that of the longest one,
// and with it the scales; drives; compliances.
#include "engine/loops/tables.hpp"

#include "description/structure/loops.hpp"
#include "engine/model/canonical_axes.hpp"
#include "engine/loops/vectors.hpp"
#include "ksl/engine/model/joints.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::loops {
namespace {

/// An orthonormal basis of the wrenches that do no work on the unit twists given, by Gram and Schmidt, from unit forces and moments
/// along the axes.  Twists along and about axes leave unit wrenches.  All are in canonical axes.
int wrenches_without_work(const std::vector<screw<double>> &twists, coscrew<double> *out) {
  // the twists, then the wrenches orthogonal to all before: H̄* is the complement of H in ℝ⁶ by the product f · v + m · ω, so that these are six in all
  double basis[12][6];
  int n = 0;
  const auto add = [&](const double *x) {
    double y[6], sum = 0;
    std::copy_n(x, 6, y);
    for (int pass = 0; pass < 2; ++pass)
      for (int k = 0; k < n; ++k) {
        double along = 0;
        for (int i = 0; i < 6; ++i)
          along += basis[k][i] * y[i];
        for (int i = 0; i < 6; ++i)
          y[i] -= along * basis[k][i];
      }
    for (const double c : y)
      sum += c * c;
    if (sum < 1e-6)
      return false;
    for (int i = 0; i < 6; ++i)
      basis[n][i] = y[i] / std::sqrt(sum);
    ++n;
    return true;
  };
  for (const screw<double> &s : twists) { // dual to wrenches: force times velocity, moment times angular velocity
    const double x[6] = {s.lin.x, s.lin.y, s.lin.z, s.ang.x, s.ang.y, s.ang.z};
    add(x);
  }
  int found = 0;
  for (int i = 0; i < 6; ++i) {
    double unit[6] = {};
    unit[i] = 1;
    if (add(unit)) {
      const double *const b = basis[n - 1];
      out[found++] = {{b[0], b[1], b[2]}, {b[3], b[4], b[5]}};
    }
  }
  return found;
}

/// Is a loop's equation about a rotation?  Those of helical joints, which mix both, are about a translation.
bool is_moment(const coscrew<double> &T) { return length(T.lin) < 1e-12; }

class maker {
public:
  explicit maker(const model &m) : m_(m) {}

  tables make() {
    t_.column_scale.assign(index(m_.nv()), 1), t_.column_turns.assign(index(m_.nv()), 0);
    first_column_.assign(m_.joints().size(), -1);
    for (const loop_row &row : m_.loops())
      add_loop(row);
    set_scales();
    set_drives();
    set_compliances();
    return std::move(t_);
  }

private:
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }

  /// The place of a link in tables::links.
  int slot(int link) {
    const auto found = std::find(t_.links.begin(), t_.links.end(), link);
    if (found != t_.links.end())
      return static_cast<int>(found - t_.links.begin());
    t_.links.push_back(link);
    return static_cast<int>(t_.links.size()) - 1;
  }

  /// The columns of a joint of the tree: the first, and how many they are.
  /// Columns of a joint are made when the first loop asks for them, so that joints that no loop goes through have none.
  int columns_of(int joint) {
    int &first = first_column_[index(joint)];
    if (first >= 0)
      return first;
    first = static_cast<int>(t_.columns.size());
    const joint_row &row = m_.joints()[index(joint)];
    // q̇_f = r q̇_l: a follower's columns are in its leader's place of v, r times as large
    const bool follows = row.leader >= 0;
    const int v = follows ? m_.joints()[index(row.leader)].v_index : row.v_index;
    const double factor = follows ? row.multiplier : 1;
    const int link = slot(row.link);
    if (row_of(row.kind).has_axis2) {
      t_.columns.push_back({v, factor, link, {{0, 0, 0}, row.axis}, 1, row.q_index + 1, row.axis2});
      t_.columns.push_back({v + 1, factor, link, {{0, 0, 0}, row.axis2}, 1, -1, {}});
      return first;
    }
    for (const screw<double> &twist : unit_twists(row.kind, row.axis, row.pitch)) {
      const int k = static_cast<int>(t_.columns.size()) - first;
      t_.columns.push_back({v + (follows ? 0 : k), factor, link, twist, length(twist.ang), -1, {}});
    }
    return first;
  }

  void add_loop(const loop_row &row) {
    loop l{};
    l.kind = row.kind, l.on_predecessor = row.predecessor_pose, l.on_successor = row.successor_pose;
    l.axis = row.axis, l.axis2 = row.axis2, l.pitch = row.pitch;
    l.canonical = row_of(row.kind).has_axis ? frame_with_z(row.axis) : identity.R;
    l.predecessor = slot(row.predecessor), l.successor = slot(row.successor);
    l.first_row = t_.rows;
    set_freedoms(l);
    set_wrenches(l);
    t_.rows += l.rows;
    l.support_begin = static_cast<int>(t_.supports.size());
    std::vector<int> to = m_.support(row.successor), from = m_.support(row.predecessor);
    std::size_t common = 0; // joints that move both ends alike
    while (common < to.size() && common < from.size() && to[common] == from[common])
      ++common;
    // The way around: what lies between the two joints that leave the common link, then from joint to joint, then to the loop's joint on both sides.
    //
    //     common ─┬─ joint ─ offset ─ joint ─ … ─ successor_pose ─┐
    //             └─ joint ─ offset ─ … ─ predecessor_pose ───────┘
    double reach = length(row.predecessor_pose.t) + length(row.successor_pose.t);
    extents around;
    for (const auto &[path, sign] : {std::pair{&to, 1.}, {&from, -1.}})
      for (std::size_t k = 0; k < path->size(); ++k) {
        const double offset = offset_of((*path)[k]);
        around.to_ground = std::max(around.to_ground, offset);
        if (k < common)
          continue;
        add_support((*path)[k], sign);
        reach += k > common ? offset : 0;
        around.of_loop = std::max({around.of_loop, k == common ? offset : 0, radius_behind((*path)[k])});
      }
    if (to.size() > common && from.size() > common)
      reach += distance_at_root(to[common], from[common]);
    l.support_end = static_cast<int>(t_.supports.size());
    l.length = length_of(reach, around);
    longest_ = std::max(longest_, l.length);
    t_.loops.push_back(l);
  }

  void set_wrenches(loop &l) {
    if (row_of(l.kind).has_axis2) { // the last row is set with the position
      l.rows = 4;
      for (int i = 0; i < 3; ++i)
        l.T[i] = {{i == 0 ? 1. : 0., i == 1 ? 1. : 0., i == 2 ? 1. : 0.}, {0, 0, 0}};
      l.T[3] = {{0, 0, 0}, cross(l.axis, l.axis2)};
      return;
    }
    l.rows = wrenches_without_work(unit_twists(l.kind, {0, 0, 1}, l.pitch), l.T); // in canonical axes
    for (int i = 0; i < l.rows; ++i)
      l.T[i] = {turned(l.canonical, l.T[i].lin), turned(l.canonical, l.T[i].ang)};
  }

  /// What the joint leaves free, as T is what it resists: joint_position.cpp takes it off displacements.
  /// From the twists of the kind, in canonical axes.
  static void set_freedoms(loop &l) {
    for (const screw<double> &twist : unit_twists(l.kind, {0, 0, 1}, l.pitch)) {
      l.turns += length(twist.ang) > 0;
      for (int axis = 0; axis < 3 && length(twist.ang) == 0; ++axis)
        l.slides[axis] |= (&twist.lin.x)[axis] != 0;
    }
  }

  /// sign: 1 on the successor's way, −1 on the predecessor's, as coordinates move one relative to the other.
  void add_support(int joint, double sign) {
    const joint_row &row = m_.joints()[index(joint)];
    if (row.kind == joint_kind::fixed)
      return;
    const int first = columns_of(joint), n = row_of(row.kind).nv;
    const bool has_body_inside = row_of(row.kind).has_axis2;
    for (int k = 0; k < n; ++k) {
      // a universal joint is two bodies, of which the one between its axes is moved by the first alone
      groups_ += k == 0 || has_body_inside;
      t_.supports.push_back({first + k, sign, groups_});
    }
  }

  /// Lengths that a loop has beside the way from joint to joint: of its bodies' masses and of its first joints; of the ways to the ground.
  struct extents { double of_loop = 0, to_ground = 0; };

  /// The length of a loop: the way around it.  Where all joints meet at one point, as those of a spherical linkage, that way is rounding, or
  /// the digits of the file, which are no length; then what else the mechanism has.
  /// All lengths here are those of the description, not of a position: scales stay as they are while the mechanism moves.
  static double length_of(double reach, const extents &around) {
    using loop_tolerance::few_digits, loop_tolerance::rank;
    const double other = around.of_loop > rank * around.to_ground ? around.of_loop : around.to_ground;
    return std::max(reach > few_digits * other ? reach : other, 0.0);
  }

  /// The root mean square distance of a link's mass from the origin of the joint that carries it.
  double radius_behind(int joint) const {
    const int d = m_.joints()[index(joint)].description;
    if (d < 0)
      return 0;
    const robot_description &robot = m_.description();
    // Ixx + Iyy + Izz = 2 ∫ r² dm
    const spatial_inertia<double> &I = robot.links[index(robot.joints[index(d)].child)].inertia;
    return I.m > 0 ? std::sqrt(std::max(I.Ixx + I.Iyy + I.Izz, 0.0) / (2 * I.m)) : 0;
  }

  /// How far a joint is from the origin of its parent link.
  double offset_of(int joint) const {
    const int d = m_.joints()[index(joint)].description;
    return d < 0 ? 0 : length(m_.description().joints[index(d)].placement.t);
  }
  double distance_at_root(int a, int b) const {
    const int da = m_.joints()[index(a)].description, db = m_.joints()[index(b)].description;
    if (da < 0 || db < 0)
      return 0;
    const vec3<double> &x = m_.description().joints[index(da)].placement.t,
                       &y = m_.description().joints[index(db)].placement.t;
    return length(vectors::difference(x, y));
  }

  /// A row of moments gives rad, times the length lengths; a coordinate that turns by 1 / length rad moves by one length at that distance.  So R K C
  /// has lengths over lengths, of the order of 1 for each joint that is about a length of the mechanism away.
  void set_scales() {
    t_.length = longest_ > 0 ? longest_ : 1; // all is at one point: no length there is, and none is needed
    for (loop &l : t_.loops)
      l.length = l.length > 0 ? l.length : t_.length;
    for (const loop &l : t_.loops)
      for (int i = 0; i < l.rows; ++i)
        t_.row_turns.push_back(is_moment(l.T[i])), t_.row_scale.push_back(is_moment(l.T[i]) ? t_.length : 1);
    for (int j = 0; j < m_.moving_joints(); ++j) {
      const joint_row &row = m_.joints()[index(j)];
      const joint_kind_row kind = row_of(row.kind);
      for (int k = 0; k < kind.nv; ++k)
        if (kind.velocities[k].unit == std::string_view("rad"))
          t_.column_turns[index(row.v_index + k)] = 1, t_.column_scale[index(row.v_index + k)] = 1 / t_.length;
    }
  }

  void set_compliances() {
    for (const joint_compliance &of : m_.description().compliances) {
      if (of.joint.empty())
        continue; // no loop goes through the ground's joint
      // joints of the tree by their numbers; behind them those that close loops
      int joint = m_.find_joint(of.joint);
      for (std::size_t l = 0; joint < 0 && l < m_.loops().size(); ++l)
        if (m_.loops()[l].name == of.joint)
          joint = static_cast<int>(m_.joints().size() + l);
      t_.compliances.push_back({joint, of.matrix});
      if (std::any_of(of.loose.begin(), of.loose.end(), [](double x) { return x != 0; }))
        t_.loose.push_back({joint, of.loose});
    }
  }

  void set_drives() {
    t_.is_driven.assign(index(m_.nv()), 0);
    t_.drives_are_known = m_.description().drives.has_value();
    const std::vector<std::string> drives = m_.description().drives.value_or(std::vector<std::string>());
    const std::vector<double> &weights = m_.description().drive_weights;
    std::vector<double> scale(index(m_.nv()), 1.0);
    for (std::size_t d = 0; d < drives.size(); ++d) {
      const joint_row &row = m_.joints()[index(m_.find_joint(drives[d]))];
      for (int k = 0; k < row_of(row.kind).nv; ++k) {
        t_.is_driven[index(row.v_index + k)] = 1;
        scale[index(row.v_index + k)] = weights.empty() ? 1 : 1 / std::sqrt(weights[d]);
      }
    }
    for (int v = 0; v < m_.nv(); ++v)
      if (t_.is_driven[index(v)])
        t_.drives.push_back(v), t_.drive_scale.push_back(scale[index(v)]);
    t_.kept = t_.drives, t_.kept_scale = t_.drive_scale, t_.is_kept = t_.is_driven;
  }

  const model &m_;
  tables t_;
  std::vector<int> first_column_; // of each joint of the model
  double longest_ = 0;
  int groups_ = 0;
};

} // namespace

std::vector<screw<double>> unit_twists(joint_kind kind, const vec3<double> &axis, double pitch) {
  const mat3x3<double> R = row_of(kind).has_axis ? frame_with_z(axis) : identity.R;
  const vec3<double> along[] = {{R.m00, R.m10, R.m20}, {R.m01, R.m11, R.m21}, {R.m02, R.m12, R.m22}};
  std::vector<screw<double>> twists;
  with_joint(kind, [&]<class J>(J) {
    if constexpr (requires { J::coordinate[0]; })
      for (const int c : J::coordinate) {
        const vec3<double> &u = c == helical_coordinate ? along[2] : along[c % 3], none = {0, 0, 0};
        if (c == helical_coordinate)
          twists.push_back({{pitch * u.x, pitch * u.y, pitch * u.z}, u});
        else if (c < 3)
          twists.push_back({u, none});
        else
          twists.push_back({none, u});
      }
    return 0;
  });
  return twists;
}

tables make_tables(const model &m) { return maker(m).make(); }

} // namespace ksl::loops
