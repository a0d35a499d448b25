// The forces of elements in some states, from calls of the tree that carries them: of the kernels, or in src/generate/ recorded.
#pragma once

#include "engine/elements/law.hpp"
#include "engine/elements/tree_of_states.hpp"
#include "ksl/engine/lanes/scalar.hpp"
#include "ksl/engine/lanes/spread.hpp"

namespace ksl::elements {

/// A share of positions: points that are nearer to each other coincide.
template <class S> constexpr double rounding_of = sizeof(S) == 8 ? 1e-14 : 1e-5;

/// The axes and the origin of the twists of ends: the world's axes, the links' origins.
constexpr frame_options in_world() {
  frame_options how;
  how.axes = expressed_in::world;
  return how;
}

/// Three numbers, `apart` from each other.
template <class R, class S> vec3<R> three(const S *x, std::ptrdiff_t apart = 1) {
  return {R(x[0]), R(x[apart]), R(x[2 * apart])};
}

/// Arrays have the states one after the other, each with all ends: end 2 j is point 1 of element j, end 2 j + 1 its point 2.
///
///     poses_ (states, ends, 4, 4)    twists_ (states, ends, 6)    wrenches_ (states, ends, 6)    found_ (states, elements)
///     external_   [ wrenches of the batch | one on the link of each end: row i is wrenches_ + 6 (ends i + k) ]
///
/// The forces of all elements in some states, and the external wrenches that they are.
template <class S, class Tree = tree_of_states<S>> class forces {
public:
  using R = typename computed_in<S>::type;

  /// n: the first of the elements of the model, all or as many as act.
  forces(const model &m, int n, double rounding = rounding_of<S>) : forces(m, n, rounding, Tree(m)) {}
  forces(const model &m, int n, double rounding, const Tree &tree) : m_(m), n_(n), rounding_(rounding), tree_(tree) {}

  int ends() const { return 2 * n_; }
  void lay_out(arena &memory, int externals, int states);

  /// Sets the elements of states [first, first + n) of a batch, at most as many as there is room for; false if one has no force.
  bool set(const batch_view<S> &batch, std::size_t first, int n);

  /// After it, the wrenches of these states, in external_axes of the batch: its own, and after them those of elements.
  const external_rows<S> *external() const { return external_; }

  const element_state<R> &of(int state, int element) const { return found_[state * n_ + element]; }
  /// The link that end k is on: those of element i are 2 i and 2 i + 1.
  int link(int k) const { return links_[k]; }
  const int *links() const { return links_; }
  mat3x3<R> axes(int state, int end) const;
  vec3<R> angular(int state, int end) const;

private:
  const model &m_;
  int n_;
  double rounding_;
  Tree tree_;
  int *links_ = nullptr;
  S *poses_ = nullptr, *twists_ = nullptr, *wrenches_ = nullptr;
  element_state<R> *found_ = nullptr;
  external_rows<S> *external_ = nullptr;
};

template <class S, class Tree> void forces<S, Tree>::lay_out(arena &memory, int externals, int states) {
  links_ = memory.take<int>(ends());
  poses_ = memory.take<S>(std::ptrdiff_t(states) * ends() * 16);
  twists_ = memory.take<S>(std::ptrdiff_t(states) * ends() * 6);
  wrenches_ = memory.take<S>(std::ptrdiff_t(states) * ends() * 6);
  found_ = memory.take<element_state<R>>(std::ptrdiff_t(states) * n_);
  external_ = memory.take<external_rows<S>>(externals + ends());
  batch_view<S> part;
  part.n = static_cast<std::size_t>(states), part.links = {ends(), links_}, part.frame = in_world();
  tree_.measure(rows::frame_poses, part);
  tree_.measure(rows::frame_velocities, part);
  tree_.lay_out(memory);
  for (int i = 0; i < n_ && links_; ++i) {
    const force_element_row &of = m_.force_elements()[static_cast<std::size_t>(i)];
    links_[2 * i] = of.link1, links_[2 * i + 1] = of.link2;
  }
}

template <class S, class Tree> auto forces<S, Tree>::axes(int state, int end) const -> mat3x3<R> {
  const S *const x = poses_ + (std::ptrdiff_t(state) * ends() + end) * 16;
  return {R(x[0]), R(x[4]), R(x[8]), R(x[1]), R(x[5]), R(x[9]), R(x[2]), R(x[6]), R(x[10])};
}

template <class S, class Tree> auto forces<S, Tree>::angular(int state, int end) const -> vec3<R> {
  return three<R>(twists_ + (std::ptrdiff_t(state) * ends() + end) * 6 + 3);
}

// In world axes, for both ends of each element: p = o + R r and ṗ = v + ω × R r, o, R, v and ω of the link; the law from p₂ − p₁ and its rate; and
// the wrench at the link's origin, (±f u, R r × ±f u), turned back by Rᵀ where the batch has wrenches in the axes of links.
template <class S, class Tree> bool forces<S, Tree>::set(const batch_view<S> &batch, std::size_t first, int n) {
  using A = algebra<R>;
  batch_view<S> part;
  part.n = static_cast<std::size_t>(n), part.links = {ends(), links_}, part.frame = in_world();
  part.q = rows_from(batch.q, first), part.v = rows_from(batch.v, first);
  part.result[0] = {poses_, 16 * std::ptrdiff_t(ends())};
  tree_.call(rows::frame_poses, part);
  part.result[0] = {twists_, 6 * std::ptrdiff_t(ends())};
  tree_.call(rows::frame_velocities, part);
  for (int e = 0; e < batch.external_n; ++e)
    external_[e] = {batch.external[e].link, rows_from(batch.external[e].wrench, first)};
  for (int k = 0; k < ends(); ++k)
    external_[batch.external_n + k] = {links_[k], {wrenches_ + 6 * k, 6 * std::ptrdiff_t(ends())}};
  bool fine = true;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n_; ++j) {
      const force_element_row &of = m_.force_elements()[static_cast<std::size_t>(j)];
      element_state<R> &e = found_[std::ptrdiff_t(i) * n_ + j];
      vec3<R> at[2], rate[2], lost[2];
      for (int side = 0; side < 2; ++side) {
        const std::ptrdiff_t end = std::ptrdiff_t(i) * ends() + 2 * j + side;
        const mat3x3<R> in_world = axes(i, 2 * j + side);
        vec3<R> arm = spread<R>(side == 0 ? of.point1 : of.point2);
        A::product_drv(&in_world, &arm, &arm);
        (side == 0 ? e.arm1 : e.arm2) = arm;
        const vec3<R> origin = three<R>(poses_ + end * 16 + 3, 4);
        at[side] = sum(origin, arm);
        if (is_single<R>())
          lost[side] = lost_in(origin, arm);
        rate[side] = sum(three<R>(twists_ + end * 6), cross(angular(i, 2 * j + side), arm));
      }
      const vec3<R> back = scaled(R(-1), at[0]);
      if (is_single<R>())
        // p₂ − p₁ is three sums, two points and their difference, each of which rounds
        e.lost = sum(lost_in(at[1], back), sum(lost[1], scaled(R(-1), lost[0])));
      e.apart = sum(at[1], back), e.rate = sum(rate[1], scaled(R(-1), rate[0]));
      evaluate<R>(of.numbers, vectors::length(at[0]) + vectors::length(at[1]), rounding_, e);
      if constexpr (is_number<S>)
        fine = fine && e.found() == fault::none;
      for (int side = 0; side < 2; ++side) {
        const mat3x3<R> in_world = axes(i, 2 * j + side);
        vec3<R> f = scaled(side == 0 ? e.density : -e.density, e.apart), t = cross(side == 0 ? e.arm1 : e.arm2, f);
        if (batch.external_axes == expressed_in::frame)
          A::product_drinvv(&in_world, &f, &f), A::product_drinvv(&in_world, &t, &t);
        S *const out = wrenches_ + (std::ptrdiff_t(i) * ends() + 2 * j + side) * 6;
        const R numbers[] = {f.x, f.y, f.z, t.x, t.y, t.z};
        for (int c = 0; c < 6; ++c)
          out[c] = static_cast<S>(numbers[c]);
      }
    }
  return fine;
}

} // namespace ksl::elements
