// A kernel for any model, with a view of it that is given: where joints follow others, it computes the expanded mechanism.
#pragma once

#include "engine/mimic/projection.hpp"

namespace ksl::mimic {

template <class S> struct mechanism_kernel {
  const algorithm_row &row;
  const model &m;
  const model_view<S> &view; ///< of the model, or with other gravity or another plan

  /// Bytes that state() needs for requests of so many links and joints.
  std::size_t state_bytes(int links = 0, int joints = 0) const {
    if (m.followers() == 0)
      return kernels_of_row<S>(row).workspace_bytes(view);
    return projection<S>{row, m, view}.state_bytes(extents_of(m, links, joints));
  }
  /// Returns whether all numbers are ordinary, as kernels do.
  bool state(void *memory, const state_view<S> &s) const {
    if (m.followers() == 0)
      return kernels_of_row<S>(row).state(view, memory, s);
    return projection<S>{row, m, view}.state(memory, s);
  }

  std::size_t batch_bytes(const batch_view<S> &batch) const {
    if (m.followers() == 0)
      return ksl::batch_bytes(kernels_of_row<S>(row), view, batch);
    return projection<S>{row, m, view}.batch_bytes(batch);
  }
  /// Computes all states.
  void batch(const batch_view<S> &batch, void *memory) const {
    if (m.followers() == 0)
      kernels_of_row<S>(row).batch(view, batch, 0, batch.n, memory);
    else
      projection<S>{row, m, view}.batch(batch, 0, batch.n, memory);
  }
};

} // namespace ksl::mimic
