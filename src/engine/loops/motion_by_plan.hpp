// How all coordinates follow from the independent ones, v = G v_i, by the model's plan.
#pragma once

#include "ksl/engine/algorithms/loops/closed_dynamics.hpp"

namespace ksl::loops {

/// Memory for one position.
template <class T> class motion_by_plan {
public:
  void lay_out(arena &memory, const model_view<scalar_of<T>> &view) {
    memory_.lay_out(memory, view);
    still_ = memory.take<T>(view.nv);
  }

  /// G (nv, freedoms) at q, both of the expanded mechanism.  Returns NaN where the plan doesn't serve, else 0.
  T set(const model_view<scalar_of<T>> &view, const T *q, T *G) const {
    const loop_view<scalar_of<T>> &loops = *view.loops;
    loop_equations_workspace<T> w = memory_;
    for (int i = 0; i < view.nv; ++i)
      still_[i] = T(0);
    set_loop_equations<false>(view, w, q, still_);
    eliminate_by_plan<false>(view, w);
    solve_by_plan(view, w);
    for (int i = 0; i < view.nv; ++i)
      for (int j = 0; j < loops.freedoms; ++j)
        G[i * loops.freedoms + j] = element_of_G(loops, w, i, j);
    return w.fault;
  }

private:
  loop_equations_workspace<T> memory_{};
  T *still_ = nullptr;
};

} // namespace ksl::loops
