// A plan says which elements of K are pivots, in what order, and which others each step meets.  K has a place for each coordinate: those of
// pivots by their steps, then the independent ones.  Of four equations in five coordinates, one of which follows from the others:
//
//     place              0  1  2 | 3  4       columns   rows below            later steps
//     equation of step 0 P  x  . | x  .       1, 3      of step 2, the last   1
//     equation of step 1 .  P  x | .  x       2, 4      of step 2, the last   2
//     equation of step 2 x  f  P | f  f       3, 4      the last              none
//     redundant          x  f  f | f  x
//
// x are elements that loops set, f those that are zero until elimination fills them.  loop_plan::list has all of this in one array, in which
// loop_pivot, loop_pattern and loop_view say where something begins and ends:
//
//     [ columns, rows, later steps of step 0 | those of step 1 | … | (equation, place) of each f | patterns of redundant equations ]
//
// Joints are made in plan_joints.cpp, the order in pivot_order.cpp; in single precision the plan has its numbers rounded (rounded_plan.cpp).
#include "engine/loops/plan.hpp"

#include "engine/loops/assembly.hpp"
#include "engine/loops/elimination.hpp"
#include "engine/loops/geometry.hpp"
#include "engine/loops/near_motion.hpp"
#include "engine/loops/own_memory.hpp"
#include "engine/loops/pivot_order.hpp"
#include "engine/loops/plan_joints.hpp"
#include "engine/loops/tables.hpp"

#include <algorithm>

namespace ksl::loops {
namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

/// The last pivot of a position that isn't nearly singular, relative to the largest term.
constexpr double regular = 0.05;

/// The neutral position may be one of few where the rank is lower, as that of a flat parallelogram: so many others are looked at in any case.
constexpr int least_starts = 3;

auto lay_out_with(const model &m, geometry &g, elimination &k) {
  return [&](arena &pieces) { g.lay_out(pieces), k.lay_out(pieces, m.loop_tables().rows, m.nv()); };
}

void factor(const model &m, geometry &g, elimination &k, const std::vector<double> &q) {
  const tables &t = m.loop_tables();
  g.set_position(q.data());
  const double *const rows = t.row_scale.data(), *const columns = t.column_scale.data();
  if (t.idle.empty())
    k.factor(g.jacobian(), rows, columns, g.size(), g.zero(), t.is_kept.data(), static_cast<int>(t.kept.size()));
  else
    k.factor_by_stages(g.jacobian(), rows, columns, g.size(), g.zero(), t.stages.data());
}

class planner {
public:
  explicit planner(const model &m)
      : m_(m), t_(m.loop_tables()), view_(m.view()), coupling_(m.coupling_in<double>()),
        rows_(t_.rows + coupling_.followers), original_(rows_, view_.nv), filled_(rows_, view_.nv) {}

  /// The order of steps: elimination compares scaled elements; patterns and elements are written by the places of pivots.
  std::shared_ptr<const loop_plan<double>> make(const std::vector<double> &q) {
    add_joints(m_, plan_);
    set_scales();
    eliminate(q);
    add_patterns();
    plan_.view.length = t_.length, plan_.view.tolerance = accepted_within(t_, loop_tolerance::accepted);
    plan_.point();
    return made_;
  }

private:
  /// Scales of the expanded coordinates and of all equations.  A follower's equation is scaled as its coordinate, so that its pivot is 1.
  void set_scales() {
    plan_.row_scale = t_.row_scale;
    // v = C w with lengths w: 1 rad is one of L.  Rows of moments, times L, are lengths, too, and R K C relates lengths to lengths.
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

  void eliminate(const std::vector<double> &q) {
    geometry g(m_, t_);
    elimination k;
    const own_memory memory(lay_out_with(m_, g, k));
    factor(m_, g, k, q);
    plan_.independent = expanded(k.independent(), k.freedoms());
    // K has the users' coordinates, in which followers are part of their leaders: the rank and the freedoms are those of the mechanism
    plan_.redundant.assign(k.row + k.rank, k.row + t_.rows);
    const std::vector<int> kept = expanded(t_.kept.data(), static_cast<int>(t_.kept.size()));
    const bool drives_alone = t_.idle.empty(), as_many = kept.size() == plan_.independent.size();
    // With f freedoms: drives alone, f of them and independent, have τ_d = Gᵀ (M a + b) as it stands.  More than f, or idle bodies beside them: τ_d
    // of least norm, for which the view lists all that is kept with its 1/√weight, idle bodies with a negative one.  Otherwise nothing is listed, and
    // efforts are left to closed_state; accelerations need no drives.
    plan_.view.drives_are_independent = t_.drives_are_known && drives_alone && plan_.independent == kept;
    if (kept.size() > plan_.independent.size() || (!drives_alone && as_many))
      plan_.drive = kept, plan_.drive_scale = t_.kept_scale;

    set_original();
    order_ = order_of_pivots(at_position(k, g.jacobian()));
    set_places();
    filled_ = original_;
    for (int step = 0; step < rank(); ++step)
      set_lists(step);
    set_fill();
    add_elements();
  }

  /// Where users' coordinates are among the expanded ones.
  std::vector<int> expanded(const int *coordinates, int n) const {
    std::vector<int> out(index(n));
    std::transform(coordinates, coordinates + n, out.begin(), [&](int v) { return coupling_.in_v[v]; });
    return out;
  }

  int rank() const { return static_cast<int>(order_.size()); }

  /// Which elements of K loops and followers set.  Those that are numbers of the model, and zero, they don't.
  void set_original() {
    // v_f − r v_l = 0
    for (int i = 0; i < coupling_.followers; ++i)
      original_(t_.rows + i, coupling_.follower[i].v) = original_(t_.rows + i, coupling_.follower[i].leader_v) = 1;
    for (const closing_joint<double> &joint : plan_.joints)
      for (int i = 0; i < joint.forces + joint.moments; ++i)
        for (int c = joint.columns_begin; c < joint.columns_end; ++c)
          original_(joint.first_row + i, plan_.columns[index(c)].v) = is_set(joint, i, c);
  }
  bool is_set(const closing_joint<double> &joint, int i, int c) const {
    // The successor's own columns are constant in the joint's frame, so that their elements are numbers of the model: zero for good, or not.
    // Others turn with the position, as all columns do about the normal of a universal joint.
    const bool is_own = c >= joint.own_begin && c < joint.columns_middle;
    return !is_own || (joint.has_two_axes && i == joint.forces) || own_element(joint, i, plan_.own[index(c)]) != 0;
  }

  /// Followers come first, by their own equations: K (rows, nv) has what they do at their leaders already, and only their places are
  /// eliminated.  Elimination with complete pivoting says which equations and which coordinates come then.
  equations_at_position at_position(const elimination &k, const double *K) const {
    const int nv = view_.nv, own = m_.nv();
    equations_at_position e{original_, std::vector<double>(index(rows_ * nv)), {}, {}, expanded(k.column, own), k.rank};
    e.rows.assign(k.row, k.row + t_.rows);
    for (int i = 0; i < t_.rows; ++i)
      for (int j = 0; j < own; ++j)
        e.A[index(i * nv + coupling_.in_v[j])] = K[i * own + j] * t_.row_scale[index(i)] * t_.column_scale[index(j)];
    for (int i = 0; i < coupling_.followers; ++i)
      e.given.push_back({t_.rows + i, coupling_.follower[i].v});
    return e;
  }

  /// Columns of K in the plan: those of pivots by their steps, then the independent ones, ascending.
  void set_places() {
    plan_.place.assign(index(view_.nv), 0);
    for (const pivot &p : order_) {
      plan_.place[index(p.column)] = -1 - static_cast<int>(columns_.size());
      columns_.push_back(p.column);
    }
    for (const int v : plan_.independent) {
      plan_.place[index(v)] = static_cast<int>(columns_.size()) - rank();
      columns_.push_back(v);
    }
  }

  /// What one step has to do, and what it fills.
  ///
  ///     before step k       P  a  .  b          after it      P  a  .  b        P the pivot, in row p
  ///     a row below         x  .  c  .                        l  f  c  f        l = x / P where the zero would be; f −l a and −l b, filled
  ///
  /// columns are the places that row p has to the right of P, those of later pivots first, since pivots have the lower places: the first
  /// later_end − later_begin of columns are the steps that `later` lists, by which U is solved from the last row up.
  void set_lists(int step) {
    const auto end = [&] { return static_cast<int>(plan_.list.size()); };
    loop_pivot p{};
    p.row = order_[index(step)].row, p.column = order_[index(step)].column;
    p.columns_begin = end();
    for (int j = step + 1; j < view_.nv; ++j)
      if (filled_(p.row, columns_[index(j)]))
        plan_.list.push_back(j);
    p.columns_end = p.rows_begin = end();
    for (int later = step + 1; later < rank(); ++later)
      if (filled_(order_[index(later)].row, p.column))
        plan_.list.push_back(order_[index(later)].row);
    for (const int i : plan_.redundant)
      if (filled_(i, p.column))
        plan_.list.push_back(i);
    p.rows_end = p.later_begin = end();
    // row_i −= l_i row_p: each row below gets what the pivot's row has, whether it had it before or not
    for (int i = p.rows_begin; i < p.rows_end; ++i)
      for (int j = p.columns_begin; j < p.columns_end; ++j)
        filled_(plan_.list[index(i)], columns_[index(plan_.list[index(j)])]) = 1;
    for (int later = step + 1; later < rank(); ++later)
      if (filled_(p.row, columns_[index(later)]))
        plan_.list.push_back(later);
    p.later_end = end();
    plan_.pivots.push_back(p);
  }

  /// The elements that are read and that no loop sets: those that elimination has filled, and of equations without a pivot all of independent
  /// coordinates.
  /// In the order of K's rows, whatever the order of steps: kernels set these to zero, and loops then set theirs.
  void set_fill() {
    plan_.view.fill_begin = static_cast<int>(plan_.list.size());
    for (int i = 0; i < t_.rows; ++i)
      for (int j = 0; j < view_.nv; ++j)
        if (const int v = columns_[index(j)]; !original_(i, v) && ((j >= rank() && !has_pivot(i)) || filled_(i, v)))
          plan_.list.insert(plan_.list.end(), {i, j});
    plan_.view.fill_end = static_cast<int>(plan_.list.size());
  }
  bool has_pivot(int row) const {
    return std::find(plan_.redundant.begin(), plan_.redundant.end(), row) == plan_.redundant.end();
  }

  /// The elements of K that are numbers of the model, after the places of all columns.
  void add_elements() {
    for (closing_joint<double> &joint : plan_.joints) {
      joint.elements_begin = static_cast<int>(plan_.elements.size());
      for (int i = 0; i < joint.forces + joint.moments - joint.has_two_axes; ++i)
        for (int c = joint.own_begin; c < joint.columns_middle; ++c) {
          if (const double x = own_element(joint, i, plan_.own[index(c)]); x != 0)
            plan_.elements.push_back({joint.first_row + i, place_of(plan_.columns[index(c)].v), x});
        }
      joint.elements_end = static_cast<int>(plan_.elements.size());
    }
    plan_.view.first_coupling = t_.rows;
    plan_.view.couplings_begin = static_cast<int>(plan_.elements.size());
    for (int i = 0; i < coupling_.followers; ++i) {
      const follower<double> &f = coupling_.follower[i];
      plan_.elements.push_back({t_.rows + i, place_of(f.v), 1});
      plan_.elements.push_back({t_.rows + i, place_of(f.leader_v), -f.multiplier});
    }
    plan_.view.couplings_end = static_cast<int>(plan_.elements.size());
  }
  /// Where a row of K has a coordinate: at its step, or after all pivots if it is independent.
  int place_of(int v) const {
    const int place = plan_.place[index(v)];
    return place < 0 ? -1 - place : static_cast<int>(plan_.pivots.size()) + place;
  }

  /// Which joints each pattern has wrenches at, and which patterns have to be taken off it: loops that share no joints have none in common.
  void add_patterns() {
    const std::size_t crossed = plan_.crossed.size(), joints = crossed + t_.loops.size();
    // of each pattern before, as has_wrench of the one in hand: is there a wrench of it at each joint
    std::vector<std::vector<bool>> earlier;
    const auto end = [&] { return static_cast<int>(plan_.list.size()); };
    const auto overlap = [](const std::vector<bool> &x, const std::vector<bool> &y) {
      for (std::size_t k = 0; k < x.size(); ++k)
        if (x[k] && y[k])
          return true;
      return false;
    };
    for (const int row : plan_.redundant) {
      const std::vector<bool> loops = loops_in_pattern(row);
      std::vector<bool> has_wrench(joints, false);
      loop_pattern p{};
      p.loops_begin = end();
      for (std::size_t l = 0; l < loops.size(); ++l)
        if (loops[l]) {
          plan_.list.push_back(static_cast<int>(l));
          has_wrench[crossed + l] = true;
          for (int k = plan_.joints[l].through_begin; k < plan_.joints[l].through_end; ++k)
            has_wrench[index(plan_.through[index(k)])] = true;
        }
      p.loops_end = p.earlier_begin = end();
      // Gram and Schmidt: the pattern loses its share of pattern k, and then has wrenches wherever pattern k has some
      for (std::size_t k = 0; k < earlier.size(); ++k)
        if (overlap(has_wrench, earlier[k])) {
          plan_.list.push_back(static_cast<int>(k));
          for (std::size_t j = 0; j < joints; ++j)
            has_wrench[j] = has_wrench[j] || earlier[k][j];
        }
      p.earlier_end = p.places_begin = end();
      for (std::size_t j = 0; j < joints; ++j)
        if (has_wrench[j])
          plan_.list.push_back(static_cast<int>(j));
      p.places_end = end();
      plan_.patterns.push_back(p);
      earlier.push_back(std::move(has_wrench));
    }
  }

  /// The loops whose equations have multipliers, where that of a redundant equation is 1 (back_through_lower of the kernels).
  std::vector<bool> loops_in_pattern(int redundant) const {
    std::vector<bool> has_multiplier(index(rows_), false), loops(t_.loops.size(), false);
    // Kᵀ λ = 0 with λ = 1 at the redundant row: from the last step to the first, the pivot's row has a multiplier where one below it has
    has_multiplier[index(redundant)] = true;
    for (std::size_t k = plan_.pivots.size(); k-- > 0;)
      for (int i = plan_.pivots[k].rows_begin; i < plan_.pivots[k].rows_end; ++i)
        if (has_multiplier[index(plan_.list[index(i)])])
          has_multiplier[index(plan_.pivots[k].row)] = true;
    for (std::size_t l = 0; l < loops.size(); ++l)
      for (int i = 0; i < t_.loops[l].rows; ++i)
        loops[l] = loops[l] || has_multiplier[index(t_.loops[l].first_row + i)];
    return loops;
  }

  const model &m_;
  const tables &t_;
  const model_view<double> view_; ///< the expanded mechanism, whose coordinates the plan has
  const coupling_view<double> coupling_;
  const int rows_; ///< those of loops, then of followers
  const std::shared_ptr<loop_plan<double>> made_ = std::make_shared<loop_plan<double>>();
  loop_plan<double> &plan_ = *made_;
  element_pattern original_, filled_; ///< (rows_, view_.nv): before elimination, and with what it fills
  std::vector<pivot> order_;
  std::vector<int> columns_; ///< (view_.nv) of K, in the plan's order
};

} // namespace

std::vector<double> regular_position(const model &m) {
  const tables &t = m.loop_tables();
  std::vector<double> q = start_position(m, 0), closed = q, best;
  const std::vector<unsigned char> hold(index(m.nv()), 0);
  assembly a(m);
  const own_memory memory([&](arena &pieces) { a.lay_out(pieces); });
  geometry g(m, t);
  elimination k;
  const own_memory of_pivots(lay_out_with(m, g, k));
  int rank = -1;
  bool is_kept = false;
  // rank, is_kept, last: what the best position so far has.  A position of lower rank is singular, as one of a parallelogram that is folded flat:
  // a plan made there would count equations as redundant that are not so elsewhere.
  double last = 0, error = 0;
  for (int start = 0; start < 8 && (start < least_starts || last < regular || !is_kept); ++start) {
    if (a.close(q.data(), hold.data(), nearby, closed.data(), &error) == closing::closed) {
      factor(m, g, k, closed);
      const bool kept =
          k.freedoms() != static_cast<int>(t.kept.size()) || std::equal(t.kept.begin(), t.kept.end(), k.independent());
      // in this order: a higher rank, kept coordinates that determine the motion, a last pivot that is farther from zero
      const bool as_good = k.rank == rank && kept == is_kept;
      if (k.rank > rank || (k.rank == rank && kept && !is_kept) || (as_good && last < regular && k.last_pivot() > last))
        best = closed, rank = k.rank, last = k.last_pivot(), is_kept = kept;
    }
    q = start_position(m, start + 1);
  }
  return best;
}

std::shared_ptr<const loop_plan<double>> make_plan(const model &m, const std::vector<double> &q) {
  return q.empty() ? nullptr : planner(m).make(q);
}

} // namespace ksl::loops
