// A kernel of the tree that carries the loops, or by the plan of their elimination, for any model: where joints follow others, it computes the
// expanded mechanism (engine/mimic/algorithms.hpp).
#pragma once

#include "engine/mimic/projection.hpp"

namespace ksl::loops {

template <class S> struct mechanism_kernel {
  const algorithm_row &row;
  const model &m;
  const model_view<S> &view; ///< of the model, or with other gravity or another plan

  /// Bytes that state() needs for requests of so many links and joints.
  std::size_t state_bytes(int links = 0, int joints = 0) const {
    if (m.followers() == 0)
      return kernels_of_row<S>(row).workspace_bytes(view);
    return coupled::projection<S>{row, m, view}.state_bytes(extents_of(m, links, joints));
  }
  /// Returns whether all numbers are ordinary, as kernels do.
  bool state(void *memory, const state_view<S> &s) const {
    if (m.followers() == 0)
      return kernels_of_row<S>(row).state(view, memory, s);
    return coupled::projection<S>{row, m, view}.state(memory, s);
  }

  /// Computes all states, if there is memory; returns how much is needed.
  std::size_t batch(const batch_view<S> &batch, void *memory) const {
    if (m.followers() == 0)
      return kernels_of_row<S>(row).batch(view, batch, 0, memory ? batch.n : 0, memory).bytes;
    return coupled::projection<S>{row, m, view}.batch(batch, 0, memory ? batch.n : 0, memory);
  }
};

} // namespace ksl::loops
