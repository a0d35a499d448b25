#include "engine/elements/forces.hpp"

#include "engine/model/vectors.hpp"
#include "ksl/force_elements.hpp"
#include "text/words.hpp"

#include <cmath>
#include <limits>
#include <memory>

namespace ksl::elements {
namespace {

using vectors::cross;
using vectors::dot;
using vectors::length;
using vectors::scaled;
using vectors::sum;
using vector = vec3<double>;

/// A spring of no free length, and nothing else: its force is stiffness (p₂ − p₁), with or without a direction.
bool is_linear(const force_element_numbers &x) {
  return x.free_length == 0 && x.preload == 0 && x.damping == 0 && !x.lower && !x.upper;
}

/// rounding: relative, of positions.
fault fault_of(const force_element_numbers &x, double length, double reach, double rounding) {
  if (length <= rounding * reach && !is_linear(x))
    return fault::coincide;
  const double share = std::fmax(1e-9, rounding);
  if (x.stop_stiffness == 0 && x.lower && length < *x.lower * (1 - share))
    return fault::below;
  return x.stop_stiffness == 0 && x.upper && length > *x.upper * (1 + share) ? fault::above : fault::none;
}

/// Sets what follows from apart, rate and the arms; reach: how far the points are from the world's origin.
void evaluate(const force_element_numbers &x, double reach, double rounding, element_state &e) {
  e.length = length(e.apart);
  e.found = fault_of(x, e.length, reach, rounding);
  const bool has_direction = !(e.length <= rounding * reach);
  e.u = has_direction ? scaled(1 / e.length, e.apart) : vector{0, 0, 0};
  e.speed = dot(e.u, e.rate);
  const double beyond = x.upper && e.length > *x.upper   ? e.length - *x.upper
                        : x.lower && e.length < *x.lower ? e.length - *x.lower
                                                         : 0;
  const double stretch = e.length - x.free_length;
  e.elastic = x.preload + x.stiffness * stretch + x.stop_stiffness * beyond;
  e.stiffness = x.stiffness + (beyond == 0 ? 0 : x.stop_stiffness);
  e.potential = x.preload * stretch + x.stiffness * stretch * stretch / 2 + x.stop_stiffness * beyond * beyond / 2;
  e.tension = e.elastic + x.damping * e.speed;
  e.density = has_direction ? e.tension / e.length : x.stiffness;
  if (e.found != fault::none)
    e.tension = e.density = e.elastic = e.potential = std::numeric_limits<double>::quiet_NaN();
}

} // namespace

template <class S> void forces<S>::lay_out(arena &memory, int externals, int states) {
  links_ = memory.take<int>(ends());
  poses_ = memory.take<S>(std::ptrdiff_t(states) * ends() * 16);
  twists_ = memory.take<S>(std::ptrdiff_t(states) * ends() * 6);
  wrenches_ = memory.take<S>(std::ptrdiff_t(states) * ends() * 6);
  found_ = memory.take<element_state>(std::ptrdiff_t(states) * n_);
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

template <class S> mat3x3<double> forces<S>::axes(int state, int end) const {
  const S *const x = poses_ + (std::ptrdiff_t(state) * ends() + end) * 16;
  return {double(x[0]), double(x[4]), double(x[8]), double(x[1]), double(x[5]),
          double(x[9]), double(x[2]), double(x[6]), double(x[10])};
}

template <class S> vec3<double> forces<S>::angular(int state, int end) const {
  return three(twists_ + (std::ptrdiff_t(state) * ends() + end) * 6 + 3);
}

template <class S> bool forces<S>::set(const batch_view<S> &batch, std::size_t first, int n) {
  using A = algebra<double>;
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
      element_state &e = found_[std::ptrdiff_t(i) * n_ + j];
      vector at[2], rate[2];
      for (int side = 0; side < 2; ++side) {
        const std::ptrdiff_t end = std::ptrdiff_t(i) * ends() + 2 * j + side;
        const mat3x3<double> R = axes(i, 2 * j + side);
        vector arm = side == 0 ? of.point1 : of.point2;
        A::product_drv(&R, &arm, &arm);
        (side == 0 ? e.arm1 : e.arm2) = arm;
        at[side] = sum(three(poses_ + end * 16 + 3, 4), arm);
        rate[side] = sum(three(twists_ + end * 6), cross(angular(i, 2 * j + side), arm));
      }
      e.apart = sum(at[1], scaled(-1, at[0])), e.rate = sum(rate[1], scaled(-1, rate[0]));
      evaluate(of.numbers, length(at[0]) + length(at[1]), rounding_, e);
      fine = fine && e.found == fault::none;
      for (int side = 0; side < 2; ++side) {
        const mat3x3<double> R = axes(i, 2 * j + side);
        vector f = scaled(side == 0 ? e.density : -e.density, e.apart), t = cross(side == 0 ? e.arm1 : e.arm2, f);
        if (batch.external_axes == expressed_in::frame)
          A::product_drinvv(&R, &f, &f), A::product_drinvv(&R, &t, &t);
        S *const out = wrenches_ + (std::ptrdiff_t(i) * ends() + 2 * j + side) * 6;
        const double numbers[] = {f.x, f.y, f.z, t.x, t.y, t.z};
        for (int c = 0; c < 6; ++c)
          out[c] = static_cast<S>(numbers[c]);
      }
    }
  return fine;
}

found_forces::found_forces(const model &m, double rounding)
    : at_(m, static_cast<int>(m.force_elements().size()), rounding) {
  arena measure;
  at_.lay_out(measure, 0, 1);
  memory_.resize(measure.used() + 64);
  void *begin = memory_.data();
  std::size_t space = memory_.size();
  arena pieces(std::align(64, measure.used(), begin, space));
  at_.lay_out(pieces, 0, 1);
}

void found_forces::set(const double *q, const double *v) {
  batch_view<double> batch;
  batch.n = 1, batch.q = {q, 0}, batch.v = {v, 0};
  at_.set(batch, 0, 1);
}

namespace {

std::string reason_of(const model &m, const found_forces &found) {
  for (std::size_t i = 0; i < m.force_elements().size(); ++i) {
    const force_element_row &of = m.force_elements()[i];
    const std::string who = "force element " + text::quoted(of.name) + ": ";
    const auto name = [&](int link) { return m.links()[static_cast<std::size_t>(link)].name; };
    const auto limit = [&](const char *which, double value) {
      return who + "its length is " + text::shown(found[i].length) + " m, " + which + " limit of " +
             text::shown(value) +
             " m; correct the position or the limit, or give it a stop_stiffness, for stops that give way";
    };
    switch (found[i].found) {
    case fault::none: break;
    case fault::below: return limit("below its lower", *of.numbers.lower);
    case fault::above: return limit("above its upper", *of.numbers.upper);
    case fault::coincide:
      return who + "its points on links " + name(of.link1) + " and " + name(of.link2) +
             " coincide, so that its force has no direction; move one of them, or avoid the position";
    }
  }
  return {};
}

} // namespace

template <class S> std::string reason(const model &m, const S *q, const S *v) {
  std::vector<double> positions(q, q + m.nq()), velocities(static_cast<std::size_t>(m.nv()), 0.0);
  if (v)
    velocities.assign(v, v + m.nv());
  found_forces found(m, rounding_of<S>);
  found.set(positions.data(), velocities.data());
  return reason_of(m, found);
}

template class forces<double>;
template class forces<float>;
template std::string reason(const model &, const double *, const double *);
template std::string reason(const model &, const float *, const float *);

} // namespace ksl::elements

namespace ksl {

void force_element_states(const model &m, const double *q, const double *v, double *length, double *rate,
                          double *tension) {
  elements::found_forces found(m);
  found.set(q, v);
  for (std::size_t i = 0; i < m.force_elements().size(); ++i)
    length[i] = found[i].length, rate[i] = found[i].speed, tension[i] = found[i].tension;
  const std::string why = elements::reason_of(m, found);
  if (!why.empty())
    throw result_error("force_element_states: " + why, 0, -1);
}

} // namespace ksl
