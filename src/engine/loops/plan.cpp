#include "engine/loops/plan.hpp"

#include "engine/loops/assembly.hpp"
#include "engine/loops/closed_state.hpp"
#include "engine/loops/elimination.hpp"
#include "engine/loops/near_motion.hpp"
#include "engine/loops/vectors.hpp"
#include "ksl/engine/algorithms/loops/loop_equations.hpp"
#include "ksl/engine/model/joints.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace ksl::loops {
namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

/// A pivot that makes less work may be smaller than the largest element of its column by this factor, so that no multiplier is above its
/// inverse.
constexpr double large_enough = 0.25;

/// And no smaller than this share of the largest element of all.
constexpr double not_tiny = 0.01;

/// The last pivot of a position that isn't nearly singular, relative to the largest term.
constexpr double regular = 0.05;

/// The neutral position may be one of few where the rank is lower, as that of a flat parallelogram: so many others are looked at in any case.
constexpr int least_starts = 3;

class planner {
public:
  explicit planner(const model &m)
      : m_(m), t_(m.loop_tables()), view_(m.view()), coupling_(m.coupling_in<double>()),
        rows_(t_.rows + coupling_.followers) {}

  loop_plan<double> make() {
    const std::vector<double> q = closed_position();
    if (q.empty())
      return {};
    for (const loop &l : t_.loops)
      add_joint(l);
    add_compliances();
    set_scales();
    eliminate(q);
    plan_.view.length = t_.length, plan_.view.tolerance = accepted_within(t_, loop_tolerance::accepted);
    plan_.point();
    return std::move(plan_);
  }

private:
  auto lay_out_with(geometry &g, elimination &k) const {
    return [&](arena &pieces) { g.lay_out(pieces), k.lay_out(pieces, t_.rows, m_.nv()); };
  }
  void factor(geometry &g, elimination &k, const std::vector<double> &q) const {
    g.set_position(q.data());
    k.factor(g.jacobian(), t_.row_scale.data(), t_.column_scale.data(), g.size(), g.zero(), t_.is_driven.data(),
             static_cast<int>(t_.drives.size()));
  }

  /// Of closed positions near the neutral one and some others, one with the highest rank, at which drives that are as many as the freedoms
  /// determine the motion, if there is one: the first that isn't nearly singular, else that with the largest last pivot; empty if none is closed.
  std::vector<double> closed_position() const {
    std::vector<double> q = start_position(m_, 0), closed = q, best;
    const std::vector<unsigned char> hold(index(m_.nv()), 0);
    assembly a(m_);
    const own_memory memory([&](arena &pieces) { a.lay_out(pieces); });
    geometry g(m_, t_);
    elimination k;
    const own_memory of_pivots(lay_out_with(g, k));
    int rank = -1;
    bool is_driven = false;
    double last = 0, error = 0;
    for (int start = 0; start < 8 && (start < least_starts || last < regular || !is_driven); ++start) {
      if (a.close(q.data(), hold.data(), nearby, closed.data(), &error) == closing::closed) {
        factor(g, k, closed);
        const bool drives = k.freedoms() != static_cast<int>(t_.drives.size()) ||
                            std::equal(t_.drives.begin(), t_.drives.end(), k.independent());
        const bool as_good = k.rank == rank && drives == is_driven;
        if (k.rank > rank || (k.rank == rank && drives && !is_driven) ||
            (as_good && last < regular && k.last_pivot() > last))
          best = closed, rank = k.rank, last = k.last_pivot(), is_driven = drives;
      }
      q = start_position(m_, start + 1);
    }
    return best;
  }

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

  /// How an equation of a joint weighs one of these columns.
  static double element(const closing_joint<double> &joint, int i, const screw<double> &own) {
    using A = algebra<double>;
    const double x = A::dot_vv(&joint.direction[i], i < joint.forces ? &own.lin : &own.ang);
    return i == joint.mixed ? x + A::dot_vv(&joint.turn, &own.ang) : x;
  }

  /// The elements of K that are numbers of the model, after the places of all columns.
  void add_elements() {
    for (closing_joint<double> &joint : plan_.joints) {
      joint.elements_begin = static_cast<int>(plan_.elements.size());
      for (int i = 0; i < joint.forces + joint.moments - joint.has_two_axes; ++i)
        for (int c = joint.own_begin; c < joint.columns_middle; ++c) {
          const int place = plan_.place[index(plan_.columns[index(c)].v)];
          if (const double x = element(joint, i, plan_.own[index(c)]); x != 0)
            plan_.elements.push_back(
                {joint.first_row + i, place < 0 ? -1 - place : static_cast<int>(plan_.pivots.size()) + place, x});
        }
      joint.elements_end = static_cast<int>(plan_.elements.size());
    }
    plan_.view.first_coupling = t_.rows;
    plan_.view.couplings_begin = static_cast<int>(plan_.elements.size());
    for (int i = 0; i < coupling_.followers; ++i) {
      const follower<double> &f = coupling_.follower[i];
      const int place = plan_.place[index(f.leader_v)];
      plan_.elements.push_back({t_.rows + i, -1 - plan_.place[index(f.v)], 1});
      plan_.elements.push_back(
          {t_.rows + i, place < 0 ? -1 - place : static_cast<int>(plan_.pivots.size()) + place, -f.multiplier});
    }
    plan_.view.couplings_end = static_cast<int>(plan_.elements.size());
  }

  /// Scales of the expanded coordinates and of all equations.  A follower's equation is scaled as its coordinate, so that its pivot is 1.
  void set_scales() {
    plan_.row_scale = t_.row_scale;
    plan_.column_scale.assign(index(view_.nv), 1);
    for (int j = 0; j < coupling_.nv; ++j)
      plan_.column_scale[index(coupling_.in_v[j])] = t_.column_scale[index(j)];
    for (int i = 1; i < view_.bodies; ++i)
      for (int f = 0; f < coupling_.followers; ++f)
        if (const body<double> &b = view_.body[i]; b.nv == 1 && b.v_index == coupling_.follower[f].v)
          plan_.column_scale[index(b.v_index)] = b.kind == joint_kind::prismatic ? 1 : 1 / t_.length;
    for (int f = 0; f < coupling_.followers; ++f)
      plan_.row_scale.push_back(1 / plan_.column_scale[index(coupling_.follower[f].v)]);
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

  /// Those of joints that no loop crosses store the same energy whatever patterns are added.
  void add_compliances() {
    plan_.compliance_of.assign(plan_.crossed.size() + t_.loops.size(), -1);
    for (const auto &[joint, matrix] : t_.compliances) {
      const int joints = static_cast<int>(m_.joints().size());
      int place = static_cast<int>(plan_.crossed.size()) + joint - joints;
      std::array<double, 36> C = matrix;
      if (joint < joints) {
        const int link = m_.joints()[index(joint)].link;
        const auto known = std::find(plan_.crossed.begin(), plan_.crossed.end(), link);
        if (known == plan_.crossed.end())
          continue;
        place = static_cast<int>(known - plan_.crossed.begin());
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

  /// Which joints each pattern has wrenches at, and which patterns have to be taken off it: loops that share no joints have none in common.
  void add_patterns() {
    const std::size_t crossed = plan_.crossed.size(), joints = crossed + t_.loops.size();
    std::vector<std::vector<bool>> has;
    const auto end = [&] { return static_cast<int>(plan_.list.size()); };
    const auto overlap = [](const std::vector<bool> &x, const std::vector<bool> &y) {
      for (std::size_t k = 0; k < x.size(); ++k)
        if (x[k] && y[k])
          return true;
      return false;
    };
    for (const int row : plan_.redundant) {
      const std::vector<bool> loops = loops_in_pattern(row);
      std::vector<bool> at(joints, false);
      loop_pattern p{};
      p.loops_begin = end();
      for (std::size_t l = 0; l < loops.size(); ++l)
        if (loops[l]) {
          plan_.list.push_back(static_cast<int>(l));
          at[crossed + l] = true;
          for (int k = plan_.joints[l].through_begin; k < plan_.joints[l].through_end; ++k)
            at[index(plan_.through[index(k)])] = true;
        }
      p.loops_end = p.earlier_begin = end();
      for (std::size_t k = 0; k < has.size(); ++k)
        if (overlap(at, has[k])) {
          plan_.list.push_back(static_cast<int>(k));
          for (std::size_t j = 0; j < joints; ++j)
            at[j] = at[j] || has[k][j];
        }
      p.earlier_end = p.places_begin = end();
      for (std::size_t j = 0; j < joints; ++j)
        if (at[j])
          plan_.list.push_back(static_cast<int>(j));
      p.places_end = end();
      plan_.patterns.push_back(p);
      has.push_back(std::move(at));
    }
  }

  /// The loops whose equations have multipliers, where that of a redundant equation is 1 (back_through_lower of the kernels).
  std::vector<bool> loops_in_pattern(int redundant) const {
    std::vector<bool> rows(index(rows_), false), loops(t_.loops.size(), false);
    rows[index(redundant)] = true;
    for (std::size_t k = plan_.pivots.size(); k-- > 0;)
      for (int i = plan_.pivots[k].rows_begin; i < plan_.pivots[k].rows_end; ++i)
        if (rows[index(plan_.list[index(i)])])
          rows[index(plan_.pivots[k].row)] = true;
    for (std::size_t l = 0; l < loops.size(); ++l)
      for (int i = 0; i < t_.loops[l].rows; ++i)
        loops[l] = loops[l] || rows[index(t_.loops[l].first_row + i)];
    return loops;
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

  void eliminate(const std::vector<double> &q) {
    geometry g(m_, t_);
    elimination k;
    const own_memory memory(lay_out_with(g, k));
    factor(g, k, q);
    plan_.independent = expanded(k.independent(), k.freedoms());
    plan_.redundant.assign(k.row + k.rank, k.row + t_.rows);
    const std::vector<int> drives = expanded(t_.drives.data(), static_cast<int>(t_.drives.size()));
    plan_.view.drives_are_independent = t_.drives_are_known && plan_.independent == drives;
    if (drives.size() > plan_.independent.size())
      plan_.drive = drives, plan_.drive_scale = t_.drive_scale;
    set_pivots(k, g.jacobian());
    add_patterns();
  }

  /// Where users' coordinates are among the expanded ones.
  std::vector<int> expanded(const int *coordinates, int n) const {
    std::vector<int> out(index(n));
    std::transform(coordinates, coordinates + n, out.begin(), [&](int v) { return coupling_.in_v[v]; });
    return out;
  }

  /// Which elements of K can differ from zero.
  void set_filled() {
    filled_.assign(index(rows_ * view_.nv), 0);
    for (int i = 0; i < coupling_.followers; ++i)
      filled(t_.rows + i, coupling_.follower[i].v) = filled(t_.rows + i, coupling_.follower[i].leader_v) = 1;
    for (const closing_joint<double> &joint : plan_.joints)
      for (int i = 0; i < joint.forces + joint.moments; ++i)
        for (int c = joint.columns_begin; c < joint.columns_end; ++c)
          filled(joint.first_row + i, plan_.columns[index(c)].v) = is_set(joint, i, c);
  }
  /// Whether a loop sets an element; those that are numbers of the model, and zero, it doesn't.
  bool is_set(const closing_joint<double> &joint, int i, int c) const {
    const bool is_own = c >= joint.own_begin && c < joint.columns_middle;
    return !is_own || (joint.has_two_axes && i == joint.forces) || element(joint, i, plan_.own[index(c)]) != 0;
  }
  bool has_pivot(int row) const {
    return std::find(plan_.redundant.begin(), plan_.redundant.end(), row) == plan_.redundant.end();
  }
  unsigned char &filled(int row, int column) { return filled_[index(row * view_.nv + column)]; }

  /// The order of pivots.  Followers come first, by their own equations.  Then elimination with complete pivoting says which equations and which
  /// coordinates; among these, the element whose elimination makes least work (Markowitz, Management Science 3, 1957, p. 255) of those that are
  /// not much smaller than the largest one of their column, unless that ends with pivots that are much smaller.
  void set_pivots(const elimination &k, const double *K) {
    const int nv = view_.nv;
    const double by_size = set_order(k, K, true);
    if (!(set_order(k, K, false) >= large_enough * by_size))
      set_order(k, K, true);
    const int rank = static_cast<int>(order_.size());
    std::vector<int> columns; // pivots, then independent coordinates, ascending
    plan_.place.assign(index(nv), 0);
    for (const auto &[row, column] : order_) {
      plan_.place[index(column)] = -1 - static_cast<int>(columns.size());
      columns.push_back(column);
    }
    for (int j = 0; j < k.freedoms(); ++j)
      plan_.place[index(plan_.independent[index(j)])] = j;
    columns.insert(columns.end(), plan_.independent.begin(), plan_.independent.end());
    set_filled();
    for (int step = 0; step < rank; ++step)
      set_lists(step, plan_.redundant, columns);
    set_fill(columns);
    add_elements();
  }

  /// The elements that are read and that no loop sets: those that elimination has filled, and of equations without a pivot all of independent
  /// coordinates.
  void set_fill(const std::vector<int> &columns) {
    const std::vector<unsigned char> all = filled_;
    const int rank = static_cast<int>(order_.size());
    set_filled();
    plan_.view.fill_begin = static_cast<int>(plan_.list.size());
    for (int i = 0; i < t_.rows; ++i)
      for (int j = 0; j < view_.nv; ++j)
        if (const int v = columns[index(j)];
            !filled(i, v) && ((j >= rank && !has_pivot(i)) || all[index(i * view_.nv + v)]))
          plan_.list.insert(plan_.list.end(), {i, j});
    plan_.view.fill_end = static_cast<int>(plan_.list.size());
  }

  /// Sets order_ with the largest pivots, or with those that make least work.  Returns the smallest one.  K (rows, nv) has what followers do
  /// at their leaders already: of followers only the places are eliminated.
  double set_order(const elimination &k, const double *K, bool by_size) {
    const int nv = view_.nv, own = m_.nv();
    set_filled();
    std::vector<double> A(index(rows_ * nv));
    for (int i = 0; i < t_.rows; ++i)
      for (int j = 0; j < own; ++j)
        A[index(i * nv + coupling_.in_v[j])] = K[i * own + j] * t_.row_scale[index(i)] * t_.column_scale[index(j)];
    std::vector<int> rows(k.row, k.row + t_.rows),
        columns = expanded(k.column, own); // what is left; pivots come from the first
    double smallest = std::numeric_limits<double>::infinity();
    order_.clear();
    for (int i = 0; i < coupling_.followers; ++i) {
      const std::pair<int, int> pivot = {t_.rows + i, coupling_.follower[i].v};
      A[index(pivot.first * nv + pivot.second)] = 1;
      order_.push_back(pivot);
      eliminate_one(A, pivot, rows, columns);
    }
    for (int step = 0; step < k.rank; ++step) {
      const std::pair<int, int> pivot = best_pivot(A, rows, columns, k.rank - step, by_size);
      smallest = std::min(smallest, std::fabs(A[index(pivot.first * nv + pivot.second)]));
      order_.push_back(pivot);
      rows.erase(std::find(rows.begin(), rows.end(), pivot.first));
      columns.erase(std::find(columns.begin(), columns.end(), pivot.second));
      eliminate_one(A, pivot, rows, columns);
    }
    return smallest;
  }

  /// Among the first `left` rows and columns.
  std::pair<int, int> best_pivot(const std::vector<double> &A, const std::vector<int> &rows,
                                 const std::vector<int> &columns, int left, bool by_size) {
    const int nv = view_.nv;
    std::vector<int> in_row(index(t_.rows), 0), in_column(index(nv), 0);
    std::vector<double> of_column(index(left), 0);
    for (const int i : rows)
      for (const int j : columns)
        in_row[index(i)] += filled(i, j), in_column[index(j)] += filled(i, j);
    const auto size = [&](int i, int j) { return std::fabs(A[index(rows[index(i)] * nv + columns[index(j)])]); };
    for (int i = 0; i < left; ++i)
      for (int j = 0; j < left; ++j)
        of_column[index(j)] = std::max(of_column[index(j)], size(i, j));
    const double largest = *std::max_element(of_column.begin(), of_column.end());
    std::pair<int, int> best = {0, 0};
    int least = 0;
    double of_best = -1;
    for (int i = 0; i < left; ++i)
      for (int j = 0; j < left; ++j) {
        if (!(size(i, j) >= (by_size ? largest : std::max(large_enough * of_column[index(j)], not_tiny * largest))))
          continue;
        const int work = (in_row[index(rows[index(i)])] - 1) * (in_column[index(columns[index(j)])] - 1);
        if (of_best < 0 || work < least || (work == least && size(i, j) > of_best))
          best = {rows[index(i)], columns[index(j)]}, least = work, of_best = size(i, j);
      }
    return best;
  }

  void eliminate_one(std::vector<double> &A, std::pair<int, int> pivot, const std::vector<int> &rows,
                     const std::vector<int> &columns) {
    const int nv = view_.nv;
    const auto [p, c] = pivot;
    for (const int i : rows) {
      if (!filled(i, c))
        continue;
      const double factor = A[index(i * nv + c)] / A[index(p * nv + c)];
      for (const int j : columns)
        if (filled(p, j))
          A[index(i * nv + j)] -= factor * A[index(p * nv + j)], filled(i, j) = 1;
    }
  }

  /// What one step has to do.  rest: equations without a pivot; columns: all, in order.
  void set_lists(int step, const std::vector<int> &rest, const std::vector<int> &columns) {
    const int nv = view_.nv, rank = static_cast<int>(order_.size());
    const auto end = [&] { return static_cast<int>(plan_.list.size()); };
    loop_pivot p{};
    p.row = order_[index(step)].first, p.column = order_[index(step)].second;
    p.columns_begin = end();
    for (int j = step + 1; j < nv; ++j)
      if (filled(p.row, columns[index(j)]))
        plan_.list.push_back(j);
    p.columns_end = p.rows_begin = end();
    for (int later = step + 1; later < rank; ++later)
      if (filled(order_[index(later)].first, p.column))
        plan_.list.push_back(order_[index(later)].first);
    for (const int i : rest)
      if (filled(i, p.column))
        plan_.list.push_back(i);
    p.rows_end = p.later_begin = end();
    for (int i = p.rows_begin; i < p.rows_end; ++i)
      for (int j = p.columns_begin; j < p.columns_end; ++j)
        filled(plan_.list[index(i)], columns[index(plan_.list[index(j)])]) = 1;
    for (int later = step + 1; later < rank; ++later)
      if (filled(p.row, columns[index(later)]))
        plan_.list.push_back(later);
    p.later_end = end();
    plan_.pivots.push_back(p);
  }

  const model &m_;
  const tables &t_;
  const model_view<double> view_; ///< the expanded mechanism, whose coordinates the plan has
  const coupling_view<double> coupling_;
  const int rows_; ///< those of loops, then of followers
  loop_plan<double> plan_;
  std::vector<unsigned char> filled_;      ///< (rows_, view_.nv)
  std::vector<std::pair<int, int>> order_; ///< equation and coordinate of each pivot
};

} // namespace

loop_plan<double> make_plan(const model &m) { return planner(m).make(); }

loop_plan<float> rounded(const loop_plan<double> &plan) {
  loop_plan<float> out;
  const auto vector = [](const vec3<double> &x) {
    return vec3<float>{static_cast<float>(x.x), static_cast<float>(x.y), static_cast<float>(x.z)};
  };
  const auto pose = [&](const SE3<double> &D) {
    const auto f = [](double x) { return static_cast<float>(x); };
    const mat3x3<double> &R = D.R;
    return SE3<float>{{f(R.m00), f(R.m10), f(R.m20), f(R.m01), f(R.m11), f(R.m21), f(R.m02), f(R.m12), f(R.m22)},
                      vector(D.t)};
  };
  for (const closing_joint<double> &joint : plan.joints) {
    closing_joint<float> x{joint.predecessor,
                           joint.successor,
                           pose(joint.on_predecessor),
                           pose(joint.on_successor),
                           joint.is_turned,
                           joint.turns,
                           vector(joint.axis),
                           joint.forces,
                           joint.moments,
                           {},
                           {},
                           joint.first_row,
                           joint.columns_begin,
                           joint.columns_middle,
                           joint.columns_end,
                           joint.own_begin,
                           joint.elements_begin,
                           joint.elements_end,
                           joint.through_begin,
                           joint.through_middle,
                           joint.through_end,
                           joint.mixed,
                           vector(joint.turn),
                           vector(joint.across),
                           static_cast<float>(joint.pitch),
                           joint.has_two_axes,
                           vector(joint.axis2),
                           static_cast<float>(joint.cosine)};
    for (int i = 0; i < 6; ++i)
      x.direction[i] = vector(joint.direction[i]), x.along[i] = joint.along[i];
    out.joints.push_back(x);
  }
  for (const joint_compliance_view<double> &of : plan.compliances) {
    joint_compliance_view<float> x{of.joint, {}};
    for (int i = 0; i < 36; ++i)
      x.matrix[i / 6][i % 6] = static_cast<float>(of.matrix[i / 6][i % 6]);
    out.compliances.push_back(x);
  }
  for (const screw<double> &x : plan.own)
    out.own.push_back({vector(x.lin), vector(x.ang)});
  for (const loop_element<double> &x : plan.elements)
    out.elements.push_back({x.row, x.place, static_cast<float>(x.value)});
  out.columns = plan.columns, out.pivots = plan.pivots, out.list = plan.list;
  out.independent = plan.independent, out.place = plan.place, out.redundant = plan.redundant;
  out.pitch.assign(plan.pitch.begin(), plan.pitch.end());
  out.row_scale.assign(plan.row_scale.begin(), plan.row_scale.end());
  out.column_scale.assign(plan.column_scale.begin(), plan.column_scale.end());
  out.drive = plan.drive;
  out.drive_scale.assign(plan.drive_scale.begin(), plan.drive_scale.end());
  out.crossed = plan.crossed, out.through = plan.through, out.compliance_of = plan.compliance_of;
  out.patterns = plan.patterns;
  out.view.crosses_welds = plan.view.crosses_welds;
  out.view.first_coupling = plan.view.first_coupling;
  out.view.couplings_begin = plan.view.couplings_begin, out.view.couplings_end = plan.view.couplings_end;
  out.view.fill_begin = plan.view.fill_begin, out.view.fill_end = plan.view.fill_end;
  out.view.drives_are_independent = plan.view.drives_are_independent;
  out.view.length = static_cast<float>(plan.view.length);
  out.view.tolerance = static_cast<float>(std::max(loop_tolerance::accepted_single, plan.view.tolerance));
  out.point();
  return out;
}

} // namespace ksl::loops
