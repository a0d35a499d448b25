// Equations by kinds, in the joint's axes with z its axis.  `turns` is how kernels see that rotations fit, without the joint's position:
//
//     kind                     forces                    moments           turns
//     fixed                    x y z                     x y z             not_at_all
//     revolute, continuous     x y z                     x y               about
//     prismatic                x y                       x y z             not_at_all
//     helical                  x y, z with −pitch z      x y               about; `mixed` is the third
//     cylindrical              x y                       x y               about
//     planar                   z                         x y               about
//     spherical                x y z                     none              freely
//     universal                x y z                     u₁ × u₂           freely: its own equation says that the axes keep their angle
//     translation              none                      x y z             not_at_all
#include "engine/loops/plan_joints.hpp"

#include "engine/loops/tables.hpp"
#include "engine/loops/vectors.hpp"
#include "ksl/engine/algorithms/loops/loop_equations.hpp"
#include "ksl/engine/model/joints.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace ksl::loops {
namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

class joints_of_plan {
public:
  joints_of_plan(const model &m, loop_plan<double> &plan) : m_(m), t_(m.loop_tables()), view_(m.view()), plan_(plan) {}

  void add() {
    for (const loop &l : t_.loops)
      add_joint(l);
    add_compliances();
  }

private:
  static SE3<double> in_body(const link<double> &l, const SE3<double> &in_link) {
    SE3<double> D;
    algebra<double>::product_dd(&l.pose, &in_link, &D);
    return D;
  }

  /// Which axis of its frame a direction is, or −1.
  static int axis_along(const vec3<double> &d) {
    const double x[] = {d.x, d.y, d.z};
    for (int k = 0; k < 3; ++k)
      if (x[k] == 1 && x[(k + 1) % 3] == 0 && x[(k + 2) % 3] == 0)
        return k;
    return -1;
  }
  static bool is_unit_matrix(const mat3x3<double> &R) {
    return axis_along({R.m00, R.m10, R.m20}) == 0 && axis_along({R.m01, R.m11, R.m21}) == 1 &&
           axis_along({R.m02, R.m12, R.m22}) == 2;
  }

  void add_joint(const loop &l) {
    const int predecessor = t_.links[index(l.predecessor)], successor = t_.links[index(l.successor)];
    const link<double> &from = view_.link[predecessor], &to = view_.link[successor];
    closing_joint<double> joint{};
    joint.predecessor = from.body, joint.successor = to.body;
    joint.on_predecessor = in_body(from, l.on_predecessor), joint.on_successor = in_body(to, l.on_successor);
    joint.is_turned = !is_unit_matrix(joint.on_successor.R);
    joint.axis = {l.canonical.m02, l.canonical.m12, l.canonical.m22};
    joint.first_row = l.first_row;
    joint.mixed = -1;
    // T has forces before moments (tables.cpp).  A helical joint's wrench is a force along its axis with a moment about it, f (z, −pitch z): an equation
    // of forces with a `turn` beside its direction, which has no fast path along an axis.
    for (int i = 0; i < l.rows; ++i) {
      const bool moment = length(l.T[i].lin) < 1e-12;
      joint.direction[i] = moment ? l.T[i].ang : l.T[i].lin;
      (moment ? joint.moments : joint.forces) += 1;
      if (!moment && l.kind == joint_kind::helical && length(l.T[i].ang) > 1e-12)
        joint.mixed = i, joint.turn = l.T[i].ang;
      joint.along[i] = joint.mixed == i || (moment && row_of(l.kind).has_axis2) ? -1 : axis_along(joint.direction[i]);
    }
    const joint_kind_row kind = row_of(l.kind);
    joint.across = {l.canonical.m00, l.canonical.m10, l.canonical.m20}, joint.pitch = l.pitch;
    joint.has_two_axes = kind.has_axis2, joint.axis2 = l.axis2;
    joint.cosine = algebra<double>::dot_vv(&joint.axis, &l.axis2);
    joint.turns = joint.moments == 0 || kind.has_axis2 ? loop_turns::freely
                  : kind.has_axis && kind.angle >= 0   ? loop_turns::about
                                                       : loop_turns::not_at_all;
    // Bodies in common move both ends alike, and have no columns:
    //
    //     ground ─ … ─ common ─┬─ … ─ successor      columns_begin … columns_middle
    //                          └─ … ─ predecessor    columns_middle … columns_end
    std::vector<int> to_ground, from_ground; // bodies, outwards
    for (int b = to.body; b > 0; b = view_.body[b].parent)
      to_ground.insert(to_ground.begin(), b);
    for (int b = from.body; b > 0; b = view_.body[b].parent)
      from_ground.insert(from_ground.begin(), b);
    std::size_t common = 0;
    while (common < to_ground.size() && common < from_ground.size() && to_ground[common] == from_ground[common])
      ++common;
    joint.columns_begin = static_cast<int>(plan_.columns.size());
    add_columns(to_ground, common);
    joint.columns_middle = static_cast<int>(plan_.columns.size());
    add_columns(from_ground, common);
    joint.columns_end = static_cast<int>(plan_.columns.size());
    add_own(joint);
    add_crossed(predecessor, successor, joint);
    plan_.joints.push_back(joint);
  }

  /// The columns of the successor's own coordinates about the joint's frame on it, in its axes.
  void add_own(closing_joint<double> &joint) {
    using A = algebra<double>;
    // columns are from the common body outwards, so the successor's own are the last of its side
    joint.own_begin = joint.columns_middle;
    while (joint.own_begin > joint.columns_begin && plan_.columns[index(joint.own_begin - 1)].body == joint.successor)
      --joint.own_begin;
    plan_.own.resize(plan_.columns.size());
    for (int c = joint.own_begin; c < joint.columns_middle; ++c) {
      screw<double> &own = plan_.own[index(c)];
      const mat3x3<double> body = {1, 0, 0, 0, 1, 0, 0, 0, 1};
      own = column_about(body, plan_.columns[index(c)].coordinate, plan_.pitch[index(c)], joint.on_successor.t);
      A::product_drinvv(&joint.on_successor.R, &own.lin, &own.lin);
      A::product_drinvv(&joint.on_successor.R, &own.ang, &own.ang);
    }
  }

  /// The joints on the ways from both ends to the link where these meet, which joints they are by their child links.
  void add_crossed(int predecessor, int successor, closing_joint<double> &joint) {
    const std::vector<int> to = path_to(successor), from = path_to(predecessor);
    std::size_t common = 0;
    while (common < to.size() && common < from.size() && to[common] == from[common])
      ++common;
    const auto end = [&] { return static_cast<int>(plan_.through.size()); };
    const auto add = [&](const std::vector<int> &path) {
      for (std::size_t i = common; i < path.size(); ++i) {
        const auto known = std::find(plan_.crossed.begin(), plan_.crossed.end(), path[i]);
        plan_.through.push_back(static_cast<int>(known - plan_.crossed.begin()));
        if (known == plan_.crossed.end())
          plan_.crossed.push_back(path[i]);
        plan_.view.crosses_welds |= !view_.link[path[i]].carried_by_moving_joint;
      }
    };
    joint.through_begin = end();
    add(to);
    joint.through_middle = end();
    add(from);
    joint.through_end = end();
  }

  /// The links from the root, which is left out, to a link.
  std::vector<int> path_to(int link) const {
    std::vector<int> path;
    for (; link > 0; link = view_.link[link].parent)
      path.insert(path.begin(), link);
    return path;
  }

  /// Compliances of joints on loops: those that no loop crosses store the same energy whatever patterns are added.  Where nothing resists in some direction, they
  /// are NaN: patterns with a wrench there are left to closed_state, which computes the states that have no finite results by the plan.
  void add_compliances() {
    plan_.compliance_of.assign(plan_.crossed.size() + t_.loops.size(), -1);
    for (const auto &[joint, matrix] : t_.compliances) {
      const int joints = static_cast<int>(m_.joints().size());
      int place = static_cast<int>(plan_.crossed.size()) + joint - joints;
      std::array<double, 36> C = matrix;
      if (std::any_of(t_.loose.begin(), t_.loose.end(), [at = joint](const auto &of) { return of.first == at; }))
        C.fill(std::numeric_limits<double>::quiet_NaN());
      if (joint < joints) {
        const int link = m_.joints()[index(joint)].link;
        const auto known = std::find(plan_.crossed.begin(), plan_.crossed.end(), link);
        if (known == plan_.crossed.end())
          continue;
        place = static_cast<int>(known - plan_.crossed.begin());
        // given in the axes of the child link; the plan's wrenches are in those of the body, about the same origin
        const SE3<double> turn = {view_.link[link].pose.R, {0, 0, 0}};
        algebra<double>::matrix6_complianceTransformed(C.data(), &turn, C.data());
      }
      joint_compliance_view<double> of{place, {}};
      for (int i = 0; i < 36; ++i)
        of.matrix[i / 6][i % 6] = C[index(i)];
      plan_.compliance_of[index(place)] = static_cast<int>(plan_.compliances.size());
      plan_.compliances.push_back(of);
    }
  }

  void add_columns(const std::vector<int> &path, std::size_t common) {
    for (std::size_t i = common; i < path.size(); ++i) {
      const body<double> &b = view_.body[path[i]];
      with_joint(b.kind, [&]<class J>(J) {
        if constexpr (requires { J::coordinate[0]; })
          for (int k = 0; k < b.nv; ++k) {
            plan_.columns.push_back({path[i], J::coordinate[k], b.v_index + k});
            plan_.pitch.push_back(b.pitch);
          }
        return 0;
      });
    }
  }

  const model &m_;
  const tables &t_;
  const model_view<double> view_; ///< the expanded mechanism, whose coordinates the plan has
  loop_plan<double> &plan_;
};

} // namespace

void add_joints(const model &m, loop_plan<double> &plan) { joints_of_plan(m, plan).add(); }

double own_element(const closing_joint<double> &joint, int i, const screw<double> &own) {
  using A = algebra<double>;
  const double x = A::dot_vv(&joint.direction[i], i < joint.forces ? &own.lin : &own.ang);
  return i == joint.mixed ? x + A::dot_vv(&joint.turn, &own.ang) : x;
}

} // namespace ksl::loops
