// Sentences about states of mechanisms with loops that have no result.
#pragma once

#include "engine/loops/closed_state.hpp"

#include <string>

namespace ksl::loops {

/// What is wrong, where, and how to mend it; empty for none.
std::string text_of(const finding &fault, const model &m);

/// The joint of the tree whose coordinate in v this is; and the loop that an equation belongs to.
const joint_row &joint_of(const model &m, int v);
int loop_of(const tables &t, int row);

} // namespace ksl::loops
