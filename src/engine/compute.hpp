// One state, in the workspace of a caller.
#pragma once

#include "engine/kernels.hpp"
#include "ksl/model.hpp"

namespace ksl {

/// Runs an algorithm; inputs that it reads and results that it writes must be there.
template <class S> void compute(const algorithm_row &row, const model &m, data &d, const state_view<S> &s) {
  in_precision<S>(*(kernels().*row.kernels)).state(m.view_in<S>(), d.memory(), s);
}

} // namespace ksl
