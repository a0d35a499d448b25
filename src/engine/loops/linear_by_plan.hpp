// Results that are linear in wrenches on links, or in links' inertial parameters, of one state by the model's plan: what wrenches_on_links.hpp computes
// with pivots of the state, from calls of kernels.
//
// A wrench on a link needs the efforts of drives that its power on the link's twists says, where one drive moves at a time.  Reactions need the mechanism at
// rest and without weight, under the six unit wrenches of each link.
//
// Efforts: for a wrench w on a link and the mechanism at rest without weight, power is zero along each motion v = G e_j, e_j of one drive:
//
//     τ_j = −w · V_link(G e_j),     one call of frame_velocities for all drives, a state each.
//
//     moving_     (freedoms, nv)           Gᵀ: the states of that call
//     by_wrench_  (rows, links, 6)         rows are coordinates in v, or six for each joint that is asked for
//     units_      (6, 6)                   the identity: six states, each with one unit wrench on a link
#pragma once

#include "engine/kernels/algorithm_rows.hpp"
#include "engine/loops/link_parameters.hpp"
#include "engine/states/extents.hpp"
#include "ksl/engine/lanes/workspace.hpp"
#include "ksl/model.hpp"

namespace ksl::loops {

/// Calls: computes or records all states of a batch, of the mechanism without weight, physics of joints and force elements; and G (v, freedoms) at q.
template <class S, class Calls> class linear_by_plan {
public:
  linear_by_plan(const algorithm_row &row, const model &m, const Calls &calls) : row_(row), m_(m), calls_(calls) {}

  void lay_out(arena &memory, room wanted) {
    const int all = static_cast<int>(m_.links().size()), nv = m_.nv();
    const std::ptrdiff_t links = std::max(wanted.links, all), rows = std::max(nv, 6 * wanted.joints);
    indices_ = memory.take<int>(all);
    const std::ptrdiff_t freedoms = m_.view().loops->freedoms;
    G_ = memory.take<S>(nv * freedoms), moving_ = memory.take<S>(freedoms * nv);
    twists_by_ = memory.take<S>(freedoms * 6 * links);
    still_ = memory.take<S>(nv), units_ = memory.take<S>(6 * 6), efforts_ = memory.take<S>(6 * std::ptrdiff_t(nv));
    wrenches_ = memory.take<S>(6 * rows);
    by_wrench_ = memory.take<S>(rows * links * 6), by_parameter_ = memory.take<S>(rows * links * parameters_of_link);
    poses_ = memory.take<S>(16 * links), twists_ = memory.take<S>(6 * links);
    accelerations_ = memory.take<S>(6 * links);
    reaction_request request;
    request.n = wanted.joints;
    const reaction_rows<S> reactions = {request, {}};
    batch_view<S> part;
    // the largest batch that is asked for: a state for each freedom, or six for the unit wrenches of a link
    part.n = static_cast<std::size_t>(std::max(std::ptrdiff_t(6), freedoms));
    part.external_n = 1, part.reactions_n = 1, part.reactions = &reactions, part.joints = &request;
    part.links.n = static_cast<int>(links);
    for (const algorithm_row *of : {&rows::closed_inverse_dynamics, &rows::closed_inverse_dynamics_with_reactions,
                                    &rows::frame_poses, &rows::frame_velocities, &rows::frame_accelerations})
      calls_.measure(*of, part);
    calls_.lay_out(memory);
  }

  /// Computes the result of a state, with the inputs that the row reads.  Returns a sum of efforts, which is NaN where the plan doesn't serve.
  S run(const state_view<S> &s, const vec3<S> &weight) {
    for (int i = 0; i < m_.nv(); ++i)
      still_[i] = S(0);
    for (int i = 0; i < 36; ++i)
      units_[i] = S(i % 7 == 0 ? 1 : 0);
    for (int i = 0; i < static_cast<int>(m_.links().size()); ++i)
      indices_[i] = i;
    on_ = of_joints() ? link_list{static_cast<int>(m_.links().size()), indices_} : s.links;
    rows_ = of_joints() ? 6 * s.joints->n : m_.nv();
    S sum(0);
    if (row_.reads(input::v)) // is it a motion of the mechanism
      sum = efforts_of(s);
    for (int k = 0; k < on_.n && of_joints(); ++k)
      sum = sum + set_units(s, k);
    if (!of_joints())
      sum = sum + set_efforts(s);
    const result_row &result = row_.result[0];
    by_parameters_ = result.shape[result.axes - 1] == extent::ten;
    if (by_parameters_ && on_.n > 0)
      set_parameters(s, weight);
    return sum;
  }

  /// The result of the last state: (nv, links, 10), (joints, 6, all links, 10), or (joints, 6, all links, 6).
  const S *found() const { return by_parameters_ ? by_parameter_ : by_wrench_; }

private:
  bool of_joints() const { return row_.request == request_kind::joints; }

  batch_view<S> at_rest(const state_view<S> &s, int states) const {
    batch_view<S> part;
    part.n = static_cast<std::size_t>(states), part.q = {s.q, 0}, part.v = part.a = {still_, 0};
    return part;
  }
  batch_view<S> in_motion(const state_view<S> &s) const {
    batch_view<S> part = at_rest(s, 1);
    if (s.v && row_.reads(input::v))
      part.v = {s.v, 0};
    if (s.a && row_.reads(input::a))
      part.a = {s.a, 0};
    return part;
  }

  S efforts_of(const state_view<S> &s) {
    batch_view<S> part = in_motion(s);
    part.result[0] = {efforts_, m_.nv()};
    calls_.call(rows::closed_inverse_dynamics, part);
    return total(1);
  }
  S total(int states) const {
    S sum = efforts_[0];
    for (int i = 1; i < states * m_.nv(); ++i)
      sum = sum + efforts_[i];
    return sum;
  }

  /// by_wrench_ of efforts.
  S set_efforts(const state_view<S> &s) {
    const loop_view<double> &loops = *m_.view().loops;
    const std::ptrdiff_t nv = m_.nv(), f = loops.freedoms, columns = 6 * std::ptrdiff_t(on_.n);
    const S fault = calls_.set_G(s.q, G_);
    for (std::ptrdiff_t i = 0; i < nv * columns; ++i)
      by_wrench_[i] = S(0);
    if (on_.n == 0)
      return fault;
    for (std::ptrdiff_t j = 0; j < f; ++j)
      for (std::ptrdiff_t i = 0; i < nv; ++i)
        moving_[j * nv + i] = G_[i * f + j];
    batch_view<S> part = at_rest(s, static_cast<int>(f));
    part.v = {moving_, nv}, part.links = on_, part.result[0] = {twists_by_, columns};
    calls_.call(rows::frame_velocities, part);
    for (std::ptrdiff_t j = 0; j < f; ++j)
      for (std::ptrdiff_t c = 0; c < columns; ++c)
        by_wrench_[calls_.own(loops.independent[j]) * columns + c] = -twists_by_[j * columns + c];
    return fault;
  }

  /// by_wrench_ of a link, of wrenches through joints.
  S set_units(const state_view<S> &s, int k) {
    batch_view<S> part = at_rest(s, 6);
    const external_rows<S> external = {on_.index[k], {units_, 6}};
    part.external_n = 1, part.external = &external, part.external_axes = expressed_in::frame;
    part.result[0] = {efforts_, m_.nv()};
    const reaction_rows<S> reactions = {*s.joints, {wrenches_, rows_}};
    part.reactions_n = 1, part.reactions = &reactions;
    calls_.call(rows::closed_inverse_dynamics_with_reactions, part);
    for (std::ptrdiff_t i = 0; i < rows_; ++i)
      for (std::ptrdiff_t c = 0; c < 6; ++c)
        // wrenches_ (6, rows): of each of the six states
        by_wrench_[(i * on_.n + k) * 6 + c] = wrenches_[c * rows_ + i];
    return total(6);
  }

  void set_parameters(const state_view<S> &s, const vec3<S> &weight) {
    batch_view<S> part = in_motion(s);
    part.links = on_;
    part.frame.kind = acceleration_kind::classical;
    const auto set = [&](const algorithm_row &of, std::ptrdiff_t numbers, S *out) {
      part.result[0] = {out, numbers * on_.n};
      calls_.call(of, part);
    };
    set(rows::frame_poses, 16, poses_), set(rows::frame_velocities, 6, twists_);
    set(rows::frame_accelerations, 6, accelerations_);
    for (int k = 0; k < on_.n; ++k) {
      const body_motion<S> motion = resisted_motion(poses_ + 16 * k, twists_ + 6 * k, accelerations_ + 6 * k, weight);
      set_by_parameters(motion, rows_, on_.n, k, by_wrench_, by_parameter_);
    }
  }

  const algorithm_row &row_;
  const model &m_;
  Calls calls_;
  link_list on_ = {}; ///< those of the columns
  std::ptrdiff_t rows_ = 0;
  bool by_parameters_ = false;
  int *indices_ = nullptr;
  S *G_ = nullptr, *moving_ = nullptr, *twists_by_ = nullptr; ///< twists_by_: (freedoms, links, 6)
  S *still_ = nullptr, *units_ = nullptr, *efforts_ = nullptr, *wrenches_ = nullptr;
  S *by_wrench_ = nullptr, *by_parameter_ = nullptr;
  S *poses_ = nullptr, *twists_ = nullptr, *accelerations_ = nullptr;
};

} // namespace ksl::loops
