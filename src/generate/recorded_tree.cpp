#include "generate/recorded_tree.hpp"

#include "engine/states/extents.hpp"
#include "generate/recorded_mimic.hpp"
#include "generate/recorded_rows.hpp"

namespace ksl::generate {

void record_tree(const recorded_mechanism &of, const algorithm_row &row, const state_view<recording> &s) {
  if (of.m.followers() > 0)
    record_with_followers(computed(row), of.m, of.single, of.view, s);
  else
    recorder_of(computed(row).name)(of.view, s);
}

} // namespace ksl::generate
