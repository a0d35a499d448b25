// Springs, dampers and cylinders between points of two links, on top of the kernels.  At a state each pulls its two points together with a
// force along the line between them, which acts as an external wrench on each of the two links.  Algorithms that know external wrenches are
// called with these; energies and derivatives get what is missing.  A model without such elements pays one comparison.
//
// With l the distance of the points p₁ and p₂, l u = p₂ − p₁, and f the tension, the wrenches are f u at p₁ and −f u at p₂.  What a small
// motion adds to them is closed-form:
//
//     d(f u) = (df − f/l dl) u + f/l d(p₂ − p₁),   dl = u · d(p₂ − p₁),   df = ∂f/∂l dl + ∂f/∂l̇ dl̇.                     (1)
#pragma once

#include "engine/elements/tree_of_states.hpp"

#include <string>
#include <vector>

namespace ksl::elements {

/// Why an element has no force.
enum class fault : unsigned char { none, coincide, below, above };

/// What elements do at one state.
struct element_state {
  fault found;
  vec3<double> arm1, arm2;  ///< from the links' origins to the points, in world axes
  vec3<double> apart, rate; ///< p₂ − p₁ and its rate
  vec3<double> u;           ///< zero where the points coincide
  double length, speed;     ///< l and dl/dt
  double tension;           ///< NaN where there is none
  double density;           ///< tension / length
  double stiffness;         ///< ∂f/∂l
  double elastic;           ///< what of the tension has a potential
  double potential;
};

/// A share of positions: points that are nearer to each other coincide.
template <class S> constexpr double rounding_of = sizeof(S) == 8 ? 1e-14 : 1e-5;

/// The axes and the origin of the twists of ends: the world's axes, the links' origins.
constexpr frame_options in_world() {
  frame_options how;
  how.axes = expressed_in::world;
  return how;
}

/// Three numbers, `apart` from each other.
template <class S> vec3<double> three(const S *x, std::ptrdiff_t apart = 1) {
  return {double(x[0]), double(x[apart]), double(x[2 * apart])};
}

/// The forces of all elements in some states, and the external wrenches that they are.
template <class S> class forces {
public:
  /// n: the first of the elements of the model, all or as many as act.
  forces(const model &m, int n, double rounding = rounding_of<S>) : m_(m), n_(n), rounding_(rounding), tree_(m) {}

  int ends() const { return 2 * n_; }
  void lay_out(arena &memory, int externals, int states);

  /// Sets the elements of states [first, first + n) of a batch, at most as many as there is room for; false if one has no force.
  bool set(const batch_view<S> &batch, std::size_t first, int n);

  /// After it, the wrenches of these states, in external_axes of the batch: its own, and after them those of elements.
  const external_rows<S> *external() const { return external_; }

  const element_state &of(int state, int element) const { return found_[state * n_ + element]; }
  /// The link that end k is on: those of element i are 2 i and 2 i + 1.
  int link(int k) const { return links_[k]; }
  const int *links() const { return links_; }
  mat3x3<double> axes(int state, int end) const;
  vec3<double> angular(int state, int end) const;

private:
  const model &m_;
  int n_;
  double rounding_;
  tree_of_states<S> tree_;
  int *links_ = nullptr;
  S *poses_ = nullptr, *twists_ = nullptr, *wrenches_ = nullptr;
  element_state *found_ = nullptr;
  external_rows<S> *external_ = nullptr;
};

/// Why an element has no force at a state; empty if all have one.  v may be null.  Allocates.
template <class S> std::string reason(const model &m, const S *q, const S *v);

/// All elements of a model at one state, in memory of its own; whether they act or not.
class found_forces {
public:
  explicit found_forces(const model &m, double rounding = rounding_of<double>);
  /// v may be null.
  void set(const double *q, const double *v);
  const element_state &operator[](std::size_t i) const { return at_.of(0, static_cast<int>(i)); }

private:
  forces<double> at_;
  std::vector<std::byte> memory_;
};

} // namespace ksl::elements
