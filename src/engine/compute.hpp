// Computes one state in a workspace that the caller provides.
#pragma once

#include "engine/kernels.hpp"
#include "ksl/model.hpp"

namespace ksl {

/// Runs an algorithm.  The inputs that it reads and the results that it writes must not be null.
template <class S> void compute(const algorithm_row &row, const model &m, data &d, const state_view<S> &s) {
  in_precision<S>(*(kernels().*row.kernels)).state(m.view_in<S>(), d.memory(), s);
}

} // namespace ksl
