// Whether results are ordinary: finite, and not large where an algorithm needs mass.
#pragma once

#include "engine/states/extents.hpp"

namespace ksl {

/// If an algorithm that needs mass has larger results than this, a joint that moves no mass is looked for.  By rounding, such a joint may
/// seem to move 1e−16 of the mechanism's mass.
constexpr double large_result = 1e10;

/// Are all results of the states [first, end) ordinary?  For results that were changed after a kernel wrote them.
template <class S>
bool ordinary_results(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first,
                      std::size_t end);
template <class S> bool ordinary_results(const algorithm_row &row, const model &m, const state_view<S> &s);

} // namespace ksl
