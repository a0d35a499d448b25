// States that the model's plan of elimination fits (ksl/engine/model/loop_view.hpp), by kernels, in lanes.
#pragma once

#include "engine/elements/forces.hpp"
#include "engine/kernels/one_state.hpp"
#include "engine/loops/tables.hpp"
#include "ksl/engine/lanes/workspace.hpp"
#include "ksl/model.hpp"

namespace ksl::loops {

/// The private row whose kernels compute rows with this column `loops`, if the plan suits.
const algorithm_row &row_by_plan(loops_by);

/// Do kernels compute such rows for the model by its plan?  elements_act: do springs, dampers or cylinders between points.
template <class S> bool plan_suits(loops_by, const model_view<S> &, bool elements_act);

/// Do kernels compute rows by the plan that are linear in wrenches on links (linear_by_plan.hpp)?
bool linear_suits(const algorithm_row &, const model_view<double> &);

template <class S> class closed_by_plan {
public:
  static constexpr int most = 64; ///< states at a time

  /// loops: the model's plan where another tolerance is wanted; it lives as long as this.
  closed_by_plan(const algorithm_row &row, const model &m, const loop_view<S> *loops = nullptr)
      : row_(row), m_(m), view_(m.view_in<S>()), forces_(m, m.acting_force_elements()) {
    if (loops)
      view_.loops = loops;
    if (row.loops == loops_by::jump) // accelerations at rest without weight
      view_.gravity = {0, 0, 0};
    if (row.loops == loops_by::steady && view_.loops) {
      steady_ = *view_.loops;
      steady_.steady = true;
      view_.loops = &steady_;
    }
  }
  closed_by_plan(const closed_by_plan &) = delete;
  closed_by_plan &operator=(const closed_by_plan &) = delete;

  /// Are there kernels for this call?
  bool suits() const;

  void lay_out(arena &memory, const batch_view<S> &batch, int states);

  /// Computes states [first, first + n) of the batch, at most `most`.  done[i] says whether state i has its results; the others are as
  /// they were, but for reactions, which are to be written over.
  void run(const batch_view<S> &batch, std::size_t first, int n, bool *done);

private:
  batch_view<S> part_of(const batch_view<S> &batch, std::size_t first, int n) const;
  void call(const algorithm_row &row, const batch_view<S> &part);
  void set_parts(const batch_view<S> &batch, batch_view<S> part, std::size_t first, const bool *done);

  const algorithm_row &row_;
  const model &m_;
  model_view<S> view_;
  loop_view<S> steady_{}; ///< where view_ has it
  elements::forces<S> forces_;
  S *numbers_ = nullptr, *parts_ = nullptr;
  S *still_ = nullptr; ///< (nv) zeros
  external_rows<S> *external_ = nullptr;
  reaction_rows<S> *reactions_ = nullptr; ///< of each request
  state_in_batch<S> state_ = {};
  void *workspace_ = nullptr;
};

/// Computes one state as run() does, from its own arrays and with nothing laid out but what its kernel needs: efforts, accelerations and reactions
/// of mechanisms without force elements.  Returns false, and leaves the result as it is, for others, and for states that the plan doesn't fit.
template <class S> bool run_alone(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s);

} // namespace ksl::loops
