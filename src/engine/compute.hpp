// Computes one state in a workspace that the caller provides.
#pragma once

#include "engine/coupled.hpp"

#include <cstdint>
#include <memory>

namespace ksl {

/// Runs an algorithm.  The inputs that it reads and the results that it writes must not be null.
template <class S> void compute(const algorithm_row &row, const model &m, data &d, const state_view<S> &s) {
  if (m.followers() == 0)
    return kernels_of_row<S>(row).state(m.view_in<S>(), d.memory(), s);
  coupled::require_projection(row, m);
  // the workspace has room for requests for each link and joint once; what a request for more leaves in memory is not read again
  const std::size_t bytes = coupled::state_bytes<S>(row, m, extents_of(m, s));
  if (bytes <= d.bytes())
    return coupled::run_state<S>(row, m, d.memory(), s);
  const std::unique_ptr<std::byte[]> memory(new std::byte[bytes + 64]);
  coupled::run_state<S>(row, m, memory.get() + (64 - reinterpret_cast<std::uintptr_t>(memory.get()) % 64), s);
}

} // namespace ksl
