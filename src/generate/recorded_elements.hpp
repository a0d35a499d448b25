// Springs, dampers and cylinders between two points, recorded as engine/elements computes them.
#pragma once

#include "generate/recorded_tree.hpp"

#include <vector>

namespace ksl::generate {

/// Records one state of a row, as record_tree, with the force elements that act.
void record_with_elements(const recorded_mechanism &, const algorithm_row &, const state_view<recording> &s);

/// The external wrenches at a state: those that are given, and behind them those of the force elements that act.  All are in the axes of their links.
class recorded_forces {
public:
  recorded_forces(const recorded_mechanism &, const recording *q, const recording *v,
                  const external_wrenches<recording> &given);
  external_wrenches<recording> all() const;

private:
  std::vector<int> links_;
  recordings wrenches_;
};

} // namespace ksl::generate
