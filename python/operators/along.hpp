// Mechanisms with loops: closed positions and motions, and derivatives along the mechanism, of one state at a time.
//
// Independent coordinates vary, and the others follow.  A Jacobian has a column for every coordinate, those of the others being zero, so that
// products with it are those of a tree.  All is computed in double precision.
#pragma once

#include "operation.hpp"

#include "batch/compute_batch.hpp"
#include "engine/loops/algorithms.hpp"
#include "engine/loops/derivatives.hpp"
#include "engine/loops/findings.hpp"
#include "ksl/dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace operators {

/// Where the derivatives of a state go.
template <class S> struct state_jacobians {
  S *by[ksl::most_inputs] = {}; ///< of each input (moving numbers × nv), zeros
  S *projection = nullptr;      ///< (nv × nv), zeros: the efforts of drives from those of the tree; null: not wanted
  S *a = nullptr;               ///< (nv) accelerations at which the efforts are differentiated; null: not wanted
  /// (moving numbers) components that rigid bodies don't determine; null: the result has none
  unsigned char *open = nullptr;
};

template <class S> class along {
public:
  /// m: the model of the operator, or the same with other inertias.
  along(const operation &of, const ksl::model &m, int externals)
      : of_(of), m_(m), w_(m, ksl::loops::accepted_of<S>), numbers_(static_cast<std::size_t>(m.nq() + 3 * m.nv())) {
    ksl::arena measure;
    w_.lay_out(measure, externals);
    std::size_t space = measure.used() + 64;
    memory_.resize(space);
    void *begin = memory_.data();
    ksl::arena pieces(std::align(64, measure.used(), begin, space));
    w_.lay_out(pieces, externals);
    q_ = numbers_.data(), v_ = q_ + m.nq(), a_ = v_ + nv(), y_ = a_ + nv();
  }

  /// The closed position, or the motion that keeps the loops closed.  NaN where there is no such position, or arguments are NaN.  x: the
  /// inputs of the state; to: the result.
  void complete(const S *const *x, std::size_t state, S *to) {
    const index width = of_.result_numbers();
    std::fill_n(to, width, std::numeric_limits<S>::quiet_NaN());
    if (!load(x))
      return;
    std::vector<double> found(static_cast<std::size_t>(width));
    if (!data_)
      data_ = std::make_unique<ksl::data>(m_);
    const unsigned char *const given = of_.given().given.data();
    if (of_.given().completes == completed::position) {
      double error = 0;
      if (ksl::close(m_, *data_, q_, given, ksl::nearby, found.data(), &error) != ksl::closing::closed)
        return;
    } else {
      const ksl::completion how = of_.given().completes == completed::velocity
                                      ? ksl::consistent_velocity(m_, *data_, q_, v_, given, found.data())
                                      : ksl::consistent_acceleration(m_, *data_, q_, v_, a_, given, found.data());
      if (how == ksl::completion::nearest)
        of_.refuse(state,
                   "the given joints leave freedoms; give those of the drives, or as many as determine the motion");
      if (how == ksl::completion::contradictory)
        of_.refuse(
            state,
            "no motion of the closed mechanism has these coordinates; give fewer joints, those of the drives say");
    }
    store(found.data(), width, to);
  }

  /// Derivatives at a state.  x: its inputs; y: its result, which completions need; e: external wrenches.
  void derive(const S *const *x, const S *y, const ksl::external_wrenches<S> &e, std::size_t state,
              const state_jacobians<S> &to) {
    if (!load(x) || !load_result(y) || !load_wrenches(e))
      return fill(to, std::numeric_limits<S>::quiet_NaN());
    if (const ksl::loops::finding fault =
            of_.given().completes == completed::nothing ? dynamics(state, to) : completion(state, to))
      of_.refuse(state, ksl::loops::text_of(fault, m_));
  }

private:
  using index = std::ptrdiff_t;
  int nv() const { return m_.nv(); }
  int freedoms() { return w_.state().solved().freedoms(); }
  int free(int j) { return w_.state().solved().independent()[j]; }

  /// Are they finite?
  static bool copy(const S *from, index n, double *to) {
    bool finite = true;
    for (index i = 0; i < n; ++i) {
      to[i] = from ? static_cast<double>(from[i]) : 0;
      finite = finite && std::isfinite(to[i]);
    }
    return finite;
  }
  static void store(const double *from, index n, S *to) {
    for (index i = 0; i < n; ++i)
      to[i] = static_cast<S>(from[i]);
  }
  bool load(const S *const *x) {
    const int n = of_.inputs();
    return copy(x[0], m_.nq(), q_) && copy(n > 1 ? x[1] : nullptr, nv(), v_) && copy(n > 2 ? x[2] : nullptr, nv(), a_);
  }
  /// A closed position takes the place of the one given, a completed motion that of the one given.
  bool load_result(const S *y) {
    switch (of_.given().completes) {
    case completed::nothing: return true;
    case completed::position: return copy(y, m_.nq(), q_);
    case completed::velocity: return copy(y, nv(), v_);
    case completed::acceleration: return copy(y, nv(), a_);
    }
    __builtin_unreachable();
  }
  bool load_wrenches(const ksl::external_wrenches<S> &e) {
    wrenches_.resize(static_cast<std::size_t>(6 * e.n));
    external_ = {e.n, e.link, wrenches_.data(), e.axes};
    return copy(e.wrench, 6 * e.n, wrenches_.data());
  }
  void fill(const state_jacobians<S> &to, S x) const {
    for (S *J : to.by)
      if (J)
        std::fill_n(J, of_.moving_numbers() * nv(), x);
    if (to.projection)
      std::fill_n(to.projection, index(nv()) * nv(), x);
    if (to.a)
      std::fill_n(to.a, nv(), x);
  }

  /// The columns (rows, freedoms) of the independent coordinates of a Jacobian.
  void scatter(const double *columns, index rows, S *J) {
    const int f = freedoms();
    for (index i = 0; i < rows; ++i)
      for (int j = 0; j < f; ++j)
        J[i * nv() + free(j)] = static_cast<S>(columns[i * f + j]);
  }

  /// How positions, velocities or accelerations vary while the given coordinates are the independent ones.
  ksl::loops::finding completion(std::size_t state, const state_jacobians<S> &to) {
    const std::vector<unsigned char> &given = of_.given().given;
    const int n = static_cast<int>(std::count(given.begin(), given.end(), 1)), what = of_.inputs() - 1;
    if (const ksl::loops::finding fault = w_.state().set_position(q_, {given.data(), n}))
      return fault;
    if (n != freedoms() || !std::all_of(given.begin(), given.end(),
                                        [&, i = 0](unsigned char each) mutable { return each == is_free(i++); }))
      of_.refuse(state, "the joints named have " + std::to_string(n) + (n == 1 ? " coordinate" : " coordinates") +
                            ", from which the others must follow, and the mechanism has " + std::to_string(freedoms()) +
                            (freedoms() == 1 ? " freedom" : " freedoms") +
                            " at this position; derivatives need joints that determine the motion");
    if (what == 2)
      if (const ksl::loops::finding fault = w_.state().steady_acceleration(q_, v_, y_)) // its velocities are looked at
        return fault;
    const int f = freedoms();
    std::vector<double> &all = room(motions_, 9 * index(f) * nv());
    w_.motions(v_, a_, all.data());
    for (int by = 0; by <= what; ++by)
      for (int j = 0; j < f; ++j) {
        const double *const moved = all.data() + ((by * f + j) * 3 + what) * index(nv());
        for (int i = 0; i < nv(); ++i)
          to.by[by][i * nv() + free(j)] = static_cast<S>(moved[i]);
      }
    return {};
  }
  bool is_free(int i) {
    const int *const first = w_.state().solved().independent();
    return std::find(first, first + freedoms(), i) != first + freedoms();
  }

  static std::vector<double> &room(std::vector<double> &memory, index n) {
    if (static_cast<index>(memory.size()) < n)
      memory.resize(static_cast<std::size_t>(n));
    return memory;
  }

  ksl::loops::finding dynamics(std::size_t state, const state_jacobians<S> &to) {
    using ksl::loops_by;
    const loops_by how = of_.given().value->loops;
    if (const ksl::loops::finding fault = w_.state().set_position(q_))
      return fault;
    if (how == loops_by::reactions)
      return reactions(state, to);
    if (how == loops_by::accelerations)
      return accelerations(to);
    if (how == loops_by::steady)
      if (const ksl::loops::finding fault = w_.state().steady_acceleration(q_, v_, a_))
        return fault;
    const index block = index(nv()) * freedoms();
    double *const by = room(motions_, 3 * block).data();
    if (const ksl::loops::finding fault = w_.inverse_dynamics(q_, v_, a_, external_, by, by + block, by + 2 * block))
      return fault;
    for (int x = 0; x < of_.inputs(); ++x)
      scatter(by + x * block, nv(), to.by[x]);
    if (to.a)
      store(a_, nv(), to.a);
    for (int j = 0; to.projection && j < freedoms(); ++j)
      for (int i = 0; i < nv(); ++i)
        to.projection[free(j) * nv() + i] = static_cast<S>(w_.state().G(i, j));
    return {};
  }

  ksl::loops::finding accelerations(const state_jacobians<S> &to) {
    const index block = index(nv()) * nv();
    double *const by = room(motions_, 3 * block).data();
    if (const ksl::loops::finding fault = w_.forward_dynamics(q_, v_, a_, external_, by, by + block, by + 2 * block))
      return fault;
    scatter(by, nv(), to.by[0]), scatter(by + block, nv(), to.by[1]);
    store(by + 2 * block, block, to.by[2]);
    return {};
  }

  /// Of the tree's joints from derivatives of the tree, on whose links the loops' wrenches act; df = ∂f/∂q dq + ∂f/∂v dv + ∂f/∂a da + ∂f/∂w dw.
  ksl::loops::finding reactions(std::size_t state, const state_jacobians<S> &to) {
    const ksl::reaction_request &wanted = of_.given().joints;
    mark_open(state, wanted, to.open);
    const int f = freedoms(), loops = static_cast<int>(m_.loops().size()), links = static_cast<int>(m_.links().size());
    double *const motions = room(motions_, 9 * index(f) * nv()).data(),
                  *const on_links = room(on_links_, 36 * index(f) * loops).data(),
                  *const at_joints = room(at_joints_, 18 * index(f) * loops).data();
    if (const ksl::loops::finding fault = w_.reaction_variations(q_, v_, a_, external_, motions, on_links, at_joints))
      return fault;
    set_tree(wanted);
    for (int by = 0; by < 3; ++by)
      for (int j = 0; j < f; ++j) {
        const index at = by * f + j;
        for (int k = 0, tree = 0; k < wanted.n; ++k) {
          S *const J = to.by[by] + index(6) * k * nv() + free(j);
          for (int i = 0; i < 6; ++i) {
            const double value = wanted.link[k] < links
                                     ? of_tree(6 * index(tree) + i, motions + at * 3 * nv(), on_links + at * 12 * loops)
                                     : of_loop(wanted, at_joints + 6 * (at * loops + wanted.link[k] - links), i);
            J[index(i) * nv()] = to.open[6 * k + i] ? S(0) : static_cast<S>(value);
          }
          tree += wanted.link[k] < links;
        }
      }
    return {};
  }

  static bool is_at_joint(const ksl::reaction_request &r) {
    const bool moved = r.offset[0] != 0 || r.offset[1] != 0 || r.offset[2] != 0;
    return r.at == ksl::wrench_frame::joint && r.axes == ksl::wrench_frame::joint && !moved;
  }

  /// Number i of six of a loop's joint, as the request wants them.
  static double of_loop(const ksl::reaction_request &wanted, const double *at_joint, int i) {
    if (wanted.part != ksl::wrench_part::total && wanted.part != ksl::wrench_part::constraint)
      return 0;
    const double value = at_joint[wanted.angular_first ? (i + 3) % 6 : i];
    return wanted.on == ksl::wrench_side::child ? value : -value;
  }

  /// Number i of the reactions of the tree's joints.
  double of_tree(index i, const double *motion, const double *on_links) const {
    double sum = 0;
    const index block = 6 * index(tree_joints_) * nv(), links = static_cast<index>(m_.links().size());
    for (int what = 0; what < 3; ++what)
      for (int c = 0; c < nv(); ++c)
        sum += tree_[static_cast<std::size_t>(what * block + i * nv() + c)] * motion[what * nv() + c];
    for (int end = 0; end < loads_.n; ++end)
      for (int c = 0; c < 6; ++c)
        sum += by_wrench_[static_cast<std::size_t>((i * links + loads_.link[end]) * 6 + c)] * on_links[6 * end + c];
    return sum;
  }

  /// Derivatives of the reactions of the tree's joints, with the wrenches of the loops on its links.
  void set_tree(const ksl::reaction_request &wanted) {
    const int links = static_cast<int>(m_.links().size());
    loads_ = w_.state().all_wrenches({});
    std::vector<int> joints;
    std::copy_if(wanted.link, wanted.link + wanted.n, std::back_inserter(joints), [links](int l) { return l < links; });
    tree_joints_ = static_cast<int>(joints.size());
    if (joints.empty())
      return;
    ksl::reaction_request request = wanted;
    request.n = tree_joints_, request.link = joints.data();
    std::vector<ksl::external_rows<double>> rows;
    for (int end = 0; end < loads_.n; ++end)
      rows.push_back({loads_.link[end], {loads_.wrench + 6 * end, 6}});
    const index block = 6 * index(tree_joints_) * nv(), ends = 36 * index(tree_joints_) * links;
    double *const out = room(tree_, 3 * block).data();
    ksl::batch_view<double> b;
    b.n = 1, b.joints = &request;
    b.q = {q_, m_.nq()}, b.v = {v_, nv()}, b.a = {a_, nv()};
    b.external_n = loads_.n, b.external = rows.data();
    for (int r = 0; r < 3; ++r)
      b.result[r] = {out + r * block, block};
    ksl::compute_states(ksl::rows::reactions_derivatives, of_.tree(), b, 0, 1);
    b.external_n = 0;
    b.result[0] = {room(by_wrench_, ends).data(), ends}, b.result[1] = b.result[2] = {};
    ksl::compute_states(ksl::rows::reactions_external_derivatives, of_.tree(), b, 0, 1);
  }

  /// Marks the components in which a pattern of wrenches that may be added has a share; all of a joint, where they are not at the joint in its axes.
  void mark_open(std::size_t state, const ksl::reaction_request &wanted, unsigned char *open) {
    constexpr double share = 1e-9; // as Model.reactions_unique
    ksl::loops::closed_state &c = w_.state();
    const int n = c.set_patterns(q_), links = static_cast<int>(m_.links().size());
    for (int k = 0; k < wanted.n; ++k)
      if (wanted.link[k] >= links && !is_at_joint(wanted))
        throw std::invalid_argument(
            "reactions: joint " + m_.loops()[static_cast<std::size_t>(wanted.link[k] - links)].name +
            " closes a loop; its derivatives are those at the joint, in its axes; ask for it with at=\"joint\" "
            "and axes=\"joint\"");
    if (c.of().rows - c.solved().rank > n)
      of_.refuse(
          state,
          "stiffnesses split reactions of this mechanism, and no derivative of that is available; take the mechanism without them");
    for (int k = 0; k < wanted.n; ++k) {
      const int joint = wanted.link[k] < links ? m_.joint_above(wanted.link[k]) : c.joints() + wanted.link[k] - links;
      unsigned char *const marks = open + 6 * k;
      for (int i = 0; i < 6; ++i) {
        marks[i] = 0;
        for (int p = 0; p < n; ++p)
          marks[i] |= std::fabs(c.pattern(p)[6 * joint + (wanted.angular_first ? (i + 3) % 6 : i)]) > share;
      }
      if (!is_at_joint(wanted) && std::count(marks, marks + 6, 1))
        std::fill_n(marks, 6, 1);
    }
  }

  const operation &of_;
  const ksl::model &m_;
  ksl::loops::closed_derivatives w_;
  std::vector<std::byte> memory_;
  std::vector<double> numbers_, wrenches_, motions_, on_links_, at_joints_, tree_, by_wrench_;
  double *q_, *v_, *a_, *y_;
  ksl::external_wrenches<double> external_, loads_;
  int tree_joints_ = 0;
  std::unique_ptr<ksl::data> data_;
};

} // namespace operators
