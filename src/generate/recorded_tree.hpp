// Algorithms of trees, with and without mimic joints, recorded.
#pragma once

#include "engine/kernels/algorithm_rows.hpp"
#include "generate/recording.hpp"
#include "ksl/model.hpp"

namespace ksl::generate {

/// A mechanism whose algorithms are recorded.
struct recorded_mechanism {
  const model &m;
  bool single;
  const model_view<recording> &view; ///< of the expanded mechanism, if joints follow others
};

/// Records one state of a row of the tree, force elements left out.  s has the memory of all inputs and results of the row whose kernels compute it.
void record_tree(const recorded_mechanism &, const algorithm_row &, const state_view<recording> &s);

} // namespace ksl::generate
