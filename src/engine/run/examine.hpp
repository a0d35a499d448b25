// Kernels report at almost no cost that results may not be finite (engine/kernels/algorithm.hpp).  The functions here then look at each result,
// and throw an error that says why.
#pragma once

#include "engine/kernels/algorithm_rows.hpp"
#include "engine/states/not_finite.hpp"
#include "ksl/model.hpp"
#include "ksl/result_error.hpp"

namespace ksl {

/// Were the arguments of a call checked to be finite?  In C++ they are not: NaN in gives NaN out.
enum class arguments_are : bool { unchecked, finite };

/// Bytes of memory that examine_state() needs for any algorithm; a workspace (ksl::data) has them.
std::size_t examination_bytes(const model &m);

/// Throws result_error if a result of the state isn't finite although its arguments are, or if it is large since a joint moves no mass.
/// The centre of mass of a mechanism without any mass is NaN, as documented, and no error.  Overwrites `memory`, aligned to 64 bytes,
/// if the algorithm needs mass.  Allocates for an error only.
template <class S>
void examine_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s, arguments_are given);

/// Bytes of the thread's memory for workspaces that examine_states() needs.  A call that may examine results reserves them when it
/// begins, so that no later call has to allocate.
template <class S> std::size_t examination_bytes(const algorithm_row &row, const model &m, const batch_view<S> &batch);

/// examine_state for the states [first, end) of a batch.  The error is that of the first state that has one.  Also throws
/// std::bad_alloc.
template <class S>
void examine_states(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first,
                    std::size_t end, arguments_are given);

} // namespace ksl
