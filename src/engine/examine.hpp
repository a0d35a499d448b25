// What is done with results that may not be finite, which kernels report at almost no cost (engine/algorithm.hpp): they are looked at
// one by one, and an error says why.
#pragma once

#include "engine/algorithm_rows.hpp"
#include "ksl/model.hpp"
#include "ksl/result_error.hpp"

namespace ksl {

/// Were the arguments of a call checked to be finite?  In C++ they are not: NaN in gives NaN out.
enum class arguments_are : bool { unchecked, finite };

/// Throws result_error if a result of the state isn't finite though its arguments are, or if it is large since a joint moves no mass.
/// A mechanism without any mass has no centre of mass: that one is NaN, as documented.
template <class S>
void examine_state(const algorithm_row &row, const model &m, const state_view<S> &s, arguments_are given);

/// The same for the states [first, end) of a batch; the error is that of the first such state.
template <class S>
void examine_states(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first, std::size_t end,
                    arguments_are given);

/// Are all results of the states [first, end) finite, and those of algorithms that need mass not large?  For results that no kernel
/// wrote as they are.
template <class S>
bool ordinary_results(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first, std::size_t end);
template <class S> bool ordinary_results(const algorithm_row &row, const model &m, const state_view<S> &s);

} // namespace ksl
