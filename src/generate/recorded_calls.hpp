// Calls of what computes a batch, which are recorded state by state: what templates of the engine are given in place of kernels.
//
// Such a template lays out its memory twice, to measure and to have it, and then asks for rows of the tree in parts of many states: columns of a matrix, say.
// Results that it doesn't ask for are recorded into memory that is dropped, and with it their steps (graph::needed).
#pragma once

#include "engine/kernels/one_state.hpp"
#include "engine/states/extents.hpp"
#include "generate/empty_memory.hpp"
#include "generate/recorded_tree.hpp"

#include <algorithm>
#include <cstddef>

namespace ksl::generate {

class recorded_calls {
public:
  explicit recorded_calls(const recorded_mechanism &of) : of_(of) {}

  void measure(const algorithm_row &, const batch_view<recording> &part) {
    externals_ = std::max(externals_, part.external_n), reactions_ = std::max(reactions_, part.reactions_n);
  }
  void lay_out(arena &memory) { one_.lay_out(memory, externals_, reactions_); }

  bool call(const algorithm_row &row, const batch_view<recording> &part) const {
    for (std::size_t k = 0; k < part.n; ++k)
      record(row, one_.load(part, k));
    return true;
  }

private:
  /// s has the inputs and results that the caller has.
  void record(const algorithm_row &row, state_view<recording> s) const {
    const algorithm_row &by = computed(row);
    const recordings zero(static_cast<std::size_t>(of_.m.nv()), recording(0.0));
    for (const recording **x : {&s.v, &s.a, &s.tau})
      if (!*x)
        *x = zero.data();
    if (s.reactions_n > 0)
      s.joints = s.reactions[0].request;
    const extents extents = extents_of(of_.m, s);
    recordings unwanted[most_results];
    for (int r = 0; r < by.results; ++r)
      if (!s.result[r]) {
        unwanted[r].resize(static_cast<std::size_t>(numbers_of(by.result[r], extents)));
        s.result[r] = unwanted[r].data();
      }
    if (s.reactions_n > 0)
      s.result[by.results] = s.reactions[0].out;
    record_tree(of_, row, s);
  }

  recorded_mechanism of_;
  int externals_ = 0, reactions_ = 0;
  state_in_batch<recording> one_ = {};
};

/// Lays out arrays, with lay_out(arena), in memory that lives as long as what is returned.
template <class LayOut> empty_memory laid_out(const LayOut &lay_out) {
  arena measure;
  lay_out(measure);
  empty_memory memory(measure.used());
  arena pieces(memory.begin());
  lay_out(pieces);
  return memory;
}

} // namespace ksl::generate
