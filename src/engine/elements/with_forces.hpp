// Algorithms with force elements: those of the tree, with the forces of elements as external wrenches, and with what energies and derivatives get besides.
//
// With J_k the Jacobian of the link that end k is on, at its origin, and F_k the wrench of the element there, the efforts of elements are −Σ J_kᵀ F_k: they do
// part of the motors' work.  Hence
//
//     efforts          ∂τ −= Σ J_kᵀ ∂F_k;  the kernel, for which F_k are numbers, has −Σ ∂J_kᵀ F_k already
//     accelerations    ∂a += M⁻¹ Σ J_kᵀ ∂F_k
//     weighted sum     Σ w τ loses Σ (J_k w) · F_k, of which both factors vary
//     reactions        gain the kernel's derivative by external wrenches, times ∂F_k
//     energy           Σ potential, and Σ elastic ∂l/∂q
//
// The kernel holds the numbers of F_k in the axes of the batch's external wrenches, those of links or the world's.  ∂F_k is the change of these numbers.
//
//     jacobian_, bent_   (states, ends, 6, nv)   the twists of links at their origins in world axes, by v and by q
//     by_q_, by_v_       (ends, 6, nv)           ∂F of the state in hand
#pragma once

#include "engine/elements/forces_in_states.hpp"
#include "engine/kernels/one_state.hpp"
#include "engine/states/extents.hpp"

#include <algorithm>

namespace ksl::elements {

inline bool is_zero(double x) { return x == 0; }

/// An algorithm with force elements, for some states at a time.
template <class S, class Tree = tree_of_states<S>> class with_forces {
public:
  with_forces(const algorithm_row &row, const model &m) : with_forces(row, m, rounding_of<S>, Tree(m)) {}
  with_forces(const algorithm_row &row, const model &m, double rounding, const Tree &tree)
      : row_(row), m_(m), by_(row.elements), nv_(m.nv()), forces_(m, m.acting_force_elements(), rounding, tree),
        tree_(tree) {}

  /// How many states at a time: whole blocks of lanes, fewer where each has matrices.
  int states() const { return kernels_of_row<S>(row_).lanes * (by_ == elements_by::wrenches ? 4 : 1); }

  void lay_out(arena &memory, const batch_view<S> &batch, int states) {
    const std::ptrdiff_t n = states, ends = forces_.ends();
    forces_.lay_out(memory, batch.external_n, states);
    reactions_ = memory.take<reaction_rows<S>>(batch.reactions_n);
    batch_view<S> part = batch;
    part.n = static_cast<std::size_t>(n);
    part.external_n = takes_external() ? batch.external_n + forces_.ends() : 0;
    tree_.measure(row_, part);
    if (varies()) {
      jacobian_ = memory.take<S>(n * ends * 6 * nv_), bent_ = memory.take<S>(n * ends * 6 * nv_);
      by_q_ = memory.take<R>(ends * 6 * nv_), by_v_ = memory.take<R>(ends * 6 * nv_);
      matrix_ = memory.take<R>(2 * std::ptrdiff_t(nv_) * nv_);
      tree_.measure(rows::frame_velocities_derivatives, ends_of(batch, 0, states));
    }
    if (by_ == elements_by::effort_gradient)
      bent_by_weights_ = memory.take<S>(n * ends * 6 * nv_), unread_ = memory.take<S>(n * ends * 6 * nv_),
      weights_ = memory.take<R>(n * nv_);
    if (by_ == elements_by::acceleration_derivatives)
      inverse_ = memory.take<S>(n * nv_ * nv_);
    if (by_ == elements_by::reaction_derivatives) {
      by_external_ = memory.take<S>(n * external_numbers(batch));
      tree_.measure(rows::reactions_external_derivatives, part_of(batch, 0, states));
    }
    tree_.lay_out(memory);
  }

  /// Computes states [first, first + n); false where results are to be examined.
  bool run(const batch_view<S> &batch, std::size_t first, int n) {
    const bool fine = forces_.set(batch, first, n);
    set_variations(batch, first, n);
    batch_view<S> part = part_of(batch, first, n);
    part.external_n = takes_external() ? batch.external_n + forces_.ends() : 0, part.external = forces_.external();
    for (int r = 0; r < most_results; ++r)
      part.result[r] = rows_from(batch.result[r], first);
    for (int r = 0; r < batch.reactions_n; ++r)
      reactions_[r] = {batch.reactions[r].request, rows_from(batch.reactions[r].out, first)};
    part.reactions_n = batch.reactions_n, part.reactions = reactions_;
    // M⁻¹, the third result, multiplies what elements add to the others, whether it is asked for or not
    if (by_ == elements_by::acceleration_derivatives && !part.result[2].first)
      part.result[2] = {inverse_, std::ptrdiff_t(nv_) * nv_};
    const bool ordinary = tree_.call(row_, part);
    for (int i = 0; i < n; ++i)
      add(part, i);
    return ordinary && fine;
  }

private:
  using R = typename computed_in<S>::type; ///< what is added to results is computed in it
  using vector = vec3<R>;

  bool takes_external() const { return row_.external != external_use::none; }
  bool varies() const { return by_ != elements_by::wrenches && by_ != elements_by::energy; }
  std::ptrdiff_t external_numbers(const batch_view<S> &batch) const {
    return numbers_of(rows::reactions_external_derivatives.result[0], extents_of(m_, batch));
  }
  std::ptrdiff_t numbers_of_ends() const { return std::ptrdiff_t(forces_.ends()) * 6 * nv_; }

  /// The inputs and the request of some states.
  batch_view<S> part_of(const batch_view<S> &batch, std::size_t first, int n) const {
    batch_view<S> part;
    part.n = static_cast<std::size_t>(n);
    for (const input x : {input::q, input::v, input::a, input::tau})
      input_of(part, x) = rows_from(input_of(batch, x), first);
    part.links = batch.links, part.frame = batch.frame, part.joints = batch.joints;
    part.external_axes = batch.external_axes;
    return part;
  }

  /// The inputs, and the links that elements are on: for the motions of these.
  batch_view<S> ends_of(const batch_view<S> &batch, std::size_t first, int n) const {
    batch_view<S> part = part_of(batch, first, n);
    part.links = {forces_.ends(), forces_.links()}, part.frame = in_world(), part.joints = nullptr;
    part.result[0] = {bent_, numbers_of_ends()}, part.result[1] = {jacobian_, numbers_of_ends()};
    return part;
  }

  /// What derivatives need of the positions: before results are written, which may lie where inputs are.
  void set_variations(const batch_view<S> &batch, std::size_t first, int n) {
    if (varies())
      tree_.call(rows::frame_velocities_derivatives, ends_of(batch, first, n));
    if (by_ == elements_by::effort_gradient) {
      batch_view<S> part = ends_of(batch, first, n);
      part.v = part.tau, part.result[0].first = bent_by_weights_, part.result[1].first = unread_;
      tree_.call(rows::frame_velocities_derivatives, part);
      for (int i = 0; i < n; ++i)
        for (int k = 0; k < nv_; ++k)
          weights_[i * nv_ + k] = part.tau.first ? R(row(part.tau, static_cast<std::size_t>(i))[k]) : R(0);
    }
    if (by_ == elements_by::reaction_derivatives) {
      batch_view<S> part = part_of(batch, first, n);
      part.result[0] = {by_external_, external_numbers(batch)};
      tree_.call(rows::reactions_external_derivatives, part);
    }
  }

  /// Three rows from `from` on, of column k: 0 for the linear half of a twist, 3 for the angular one.
  vector column(const S *of, int i, int end, int from, int k) const {
    return three<R>(of + (std::ptrdiff_t(i) * forces_.ends() + end) * 6 * nv_ + std::ptrdiff_t(from) * nv_ + k, nv_);
  }

  /// Sets by_q_ and by_v_ (ends, 6, nv): what a motion adds to the wrenches of element j at links' origins in world axes, besides what turns
  /// with the links if numbers in their axes are held.
  void vary(int i, int j, expressed_in held) {
    const element_state<R> &e = forces_.of(i, j);
    const double damping = m_.force_elements()[static_cast<std::size_t>(j)].numbers.damping;
    const R share = math<R>::select(e.length > R(0), R(1) / e.length, R(0));
    for (int k = 0; k < nv_; ++k) {
      vector apart = {R(0), R(0), R(0)}, rate = apart, turn[2];
      for (int side = 0; side < 2; ++side) {
        const int end = 2 * j + side;
        const vector &arm = side == 0 ? e.arm1 : e.arm2;
        turn[side] = column(jacobian_, i, end, 3, k);
        // by q_k the point moves by J_v + θ × r, θ = turn the angular half of J, and its velocity v + ω × r changes by dv + dω × r + ω × (θ × r)
        const vector moved = cross(turn[side], arm);
        const R sign(side == 0 ? -1 : 1);
        apart = sum(apart, scaled(sign, sum(column(jacobian_, i, end, 0, k), moved)));
        rate = sum(rate, scaled(sign, sum(sum(column(bent_, i, end, 0, k), cross(column(bent_, i, end, 3, k), arm)),
                                          cross(forces_.angular(i, end), moved))));
      }
      // The force of the element is density · apart, apart = l u the way between its points and density = f / l.  With dl = u · d(apart),
      //     d(force) = (df − density dl) u + density d(apart),   df = stiffness dl + damping d(u · rate).
      const R dl = dot(e.u, apart);
      const vector du = scaled(share, sum(apart, scaled(-dl, e.u)));
      const R df = e.stiffness * dl + (damping == 0 ? R(0) : R(damping) * (dot(du, e.rate) + dot(e.u, rate)));
      // and by v_k: it adds to dl/dt what q_k adds to l, and turns nothing
      const vector by_q = sum(scaled(df - e.density * dl, e.u), scaled(e.density, apart)),
                   by_v = scaled(R(damping) * dl, e.u);
      for (int side = 0; side < 2; ++side) {
        const vector &arm = side == 0 ? e.arm1 : e.arm2;
        const R sign(side == 0 ? 1 : -1);
        const vector force = scaled(sign * e.density, e.apart);
        vector f = scaled(sign, by_q), t = {R(0), R(0), R(0)};
        // In the link's axes a force that stays in the world turns back as the link turns, f × dθ.  In the world it is the arm that turns,
        // (dθ × r) × f.
        if (held == expressed_in::frame)
          f = sum(f, cross(force, turn[side]));
        else
          t = cross(cross(turn[side], arm), force);
        put(by_q_, 2 * j + side, k, f, sum(t, cross(arm, f)));
        f = scaled(sign, by_v);
        put(by_v_, 2 * j + side, k, f, cross(arm, f));
      }
    }
  }
  void put(R *matrix, int end, int k, const vector &f, const vector &t) const {
    const R numbers[] = {f.x, f.y, f.z, t.x, t.y, t.z};
    for (int c = 0; c < 6; ++c)
      matrix[(end * 6 + c) * std::ptrdiff_t(nv_) + k] = numbers[c];
  }

  void add(const batch_view<S> &part, int i) {
    if (by_ == elements_by::wrenches)
      return;
    const int n = forces_.ends() / 2;
    for (int j = 0; j < n && varies(); ++j)
      vary(i, j, takes_external() ? part.external_axes : expressed_in::world);
    S *out[most_results];
    for (int r = 0; r < most_results; ++r)
      out[r] = part.result[r].first ? row(part.result[r], static_cast<std::size_t>(i)) : nullptr;
    switch (by_) {
    case elements_by::energy:
      for (int j = 0; j < n && out[1]; ++j)
        *out[1] += static_cast<S>(forces_.of(i, j).potential);
      return;
    case elements_by::energy_derivatives: return add_forces(i, out[2]);
    case elements_by::effort_derivatives:
      for (int r = 0; r < 2; ++r)
        add_efforts(i, r == 0 ? by_q_ : by_v_, R(-1), out[r]);
      return;
    case elements_by::acceleration_derivatives:
      for (int r = 0; r < 2; ++r)
        add_accelerations(i, r == 0 ? by_q_ : by_v_, out[2], out[r]);
      return;
    case elements_by::effort_gradient: return add_gradient(i, out);
    case elements_by::reaction_derivatives:
      for (int r = 0; r < 2; ++r)
        add_reactions(i, r == 0 ? by_q_ : by_v_, part, out[r]);
      return;
    case elements_by::nothing:
    case elements_by::wrenches:
    case elements_by::refusal: return;
    }
  }

  /// The derivative of the potential: Σ elastic dl/dq.
  void add_forces(int i, S *out) const {
    for (int j = 0; j < forces_.ends() / 2 && out; ++j) {
      const element_state<R> &e = forces_.of(i, j);
      for (int k = 0; k < nv_; ++k) {
        R dl(0);
        for (int side = 0; side < 2; ++side) {
          const int end = 2 * j + side;
          const vector moved = cross(column(jacobian_, i, end, 3, k), side == 0 ? e.arm1 : e.arm2);
          dl += R(side == 0 ? -1 : 1) * dot(e.u, sum(column(jacobian_, i, end, 0, k), moved));
        }
        out[k] += static_cast<S>(e.elastic * dl);
      }
    }
  }

  /// matrix (nv, nv) = Σ Jᵀ wrenches of all ends.
  /// Row r of J of an end is zero where coordinate r doesn't move its link, as for most of them in a tree.
  void set_efforts(int i, const R *wrenches, R *matrix) const {
    std::fill_n(matrix, std::ptrdiff_t(nv_) * nv_, R(0));
    for (int row = 0; row < 6 * forces_.ends(); ++row) {
      const S *const J = jacobian_ + i * numbers_of_ends() + std::ptrdiff_t(row) * nv_;
      const R *const w = wrenches + std::ptrdiff_t(row) * nv_;
      for (int r = 0; r < nv_; ++r)
        if (const R x = R(J[r]); !is_zero(x))
          for (int k = 0; k < nv_; ++k)
            matrix[std::ptrdiff_t(r) * nv_ + k] += x * w[k];
    }
  }
  void add_efforts(int i, const R *wrenches, R sign, S *out) const {
    if (!out)
      return;
    set_efforts(i, wrenches, matrix_);
    for (std::ptrdiff_t k = 0; k < std::ptrdiff_t(nv_) * nv_; ++k)
      out[k] += static_cast<S>(sign * matrix_[k]);
  }
  /// M⁻¹ of the same.
  void add_accelerations(int i, const R *wrenches, const S *inverse, S *out) const {
    if (!out)
      return;
    set_efforts(i, wrenches, matrix_);
    for (std::ptrdiff_t r = 0; r < nv_; ++r)
      for (std::ptrdiff_t k = 0; k < nv_; ++k) {
        R x(0);
        for (std::ptrdiff_t l = 0; l < nv_; ++l)
          x += R(inverse[r * nv_ + l]) * matrix_[l * nv_ + k];
        out[r * nv_ + k] += static_cast<S>(x);
      }
  }

  /// With weights w the efforts of elements are −Σ (J w) · wrench: the derivative is that of J w, and that of the wrenches.
  /// Weights come as tau: bent_by_weights_ has been computed at v = w.
  void add_gradient(int i, S *const *out) const {
    for (int j = 0; j < forces_.ends() / 2; ++j) {
      const element_state<R> &e = forces_.of(i, j);
      for (int side = 0; side < 2; ++side) {
        const int end = 2 * j + side;
        const vector f = scaled(side == 0 ? e.density : -e.density, e.apart), t = cross(side == 0 ? e.arm1 : e.arm2, f);
        const R wrench[] = {f.x, f.y, f.z, t.x, t.y, t.z};
        for (int c = 0; c < 6; ++c) {
          const std::ptrdiff_t row = end * 6 + c;
          const S *const J = jacobian_ + i * numbers_of_ends() + row * nv_, *const bent = bent_by_weights_ +
                                                                                          i * numbers_of_ends() +
                                                                                          row * nv_;
          R along(0);
          for (int k = 0; k < nv_; ++k)
            along += R(J[k]) * weights_[i * nv_ + k];
          for (int k = 0; k < nv_; ++k) {
            if (out[0])
              out[0][k] -= static_cast<S>(R(bent[k]) * wrench[c] + along * by_q_[row * nv_ + k]);
            if (out[1])
              out[1][k] -= static_cast<S>(along * by_v_[row * nv_ + k]);
          }
        }
      }
    }
  }

  void add_reactions(int i, const R *wrenches, const batch_view<S> &part, S *out) const {
    if (!out)
      return;
    using A = algebra<R>;
    const std::ptrdiff_t rows = 6 * std::ptrdiff_t(part.joints->n), links = m_.view().links;
    const S *const by = by_external_ + i * external_numbers(part);
    for (int end = 0; end < forces_.ends(); ++end) {
      const mat3x3<R> in_world = forces_.axes(i, end);
      for (int k = 0; k < nv_; ++k) {
        const R *const w = wrenches + end * 6 * std::ptrdiff_t(nv_) + k;
        vector f = three<R>(w, nv_), t = three<R>(w + 3 * std::ptrdiff_t(nv_), nv_);
        A::product_drinvv(&in_world, &f, &f), A::product_drinvv(&in_world, &t, &t);
        const R x[] = {f.x, f.y, f.z, t.x, t.y, t.z};
        for (std::ptrdiff_t r = 0; r < rows; ++r) {
          // by_external_ (joints, 6, links, 6), in the axes of links
          const S *const from = by + (r * links + forces_.link(end)) * 6;
          R change(0);
          for (int c = 0; c < 6; ++c)
            change += R(from[c]) * x[c];
          out[r * nv_ + k] += static_cast<S>(change);
        }
      }
    }
  }

  const algorithm_row &row_;
  const model &m_;
  const elements_by by_;
  const int nv_;
  forces<S, Tree> forces_;
  Tree tree_;
  reaction_rows<S> *reactions_ = nullptr;
  S *jacobian_ = nullptr, *bent_ = nullptr; ///< (states, ends, 6, nv) of the links' twists by v and by q
  S *bent_by_weights_ = nullptr, *unread_ = nullptr, *inverse_ = nullptr, *by_external_ = nullptr;
  R *by_q_ = nullptr, *by_v_ = nullptr, *matrix_ = nullptr, *weights_ = nullptr;
};

} // namespace ksl::elements
