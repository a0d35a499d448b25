// An algorithm at run time: its row of api/algorithms.py, and its kernels.
#pragma once

#include "ksl/engine/batch_view.hpp"

namespace ksl {

/// Computes one state.  The kernel lays out its workspace in `memory`, which is aligned to 64 bytes.  The inputs that the
/// algorithm reads and the results that it writes must not be null.
template <class S> using state_kernel = void (*)(const model_view<S> &, void *memory, const state_view<S> &);

/// Computes the states [first, end) of a batch, one in each lane.  Returns the bytes of memory that it needs, aligned to 64;
/// with null for the memory it computes nothing.
template <class S>
using batch_kernel = std::size_t (*)(const model_view<S> &, const batch_view<S> &, std::size_t first, std::size_t end,
                                     void *memory);

template <class S> struct kernels_in {
  int lanes; ///< number of states computed at a time
  std::size_t (*workspace_bytes)(const model_view<S> &); ///< of one state
  state_kernel<S> state;
  batch_kernel<S> batch;
};

/// The kernels of one algorithm for one instruction set.  This is the only symbol that its object file exports.
struct algorithm_kernels {
  kernels_in<double> in_double;
  kernels_in<float> in_float;
};

struct kernel_table;

/// An extent of a result: a fixed number, or the number of velocities or of links.
enum class extent : unsigned char { four, six, nv, links };

struct result_row {
  const char *name;
  int axes;         ///< 0: a number
  extent shape[3];  ///< (axes)
};

/// Whether an algorithm takes external wrenches.
enum class external_use : unsigned char { none, optional, required };

/// What a call specifies besides numbers: one link, several, one with frame_options, or reactions.
enum class request_kind : unsigned char { none, link, links, frame, reactions };

/// One row: which inputs an algorithm reads, besides q, and which results it writes.
struct algorithm_row {
  const char *name;
  bool v, a, tau;
  external_use external;
  request_kind request;
  int results; ///< besides reactions
  result_row result[most_results];
  const algorithm_kernels *kernel_table::*kernels = nullptr;
  /// The row whose kernels compute this one, with zeros for the inputs that this row lacks; null if it has its own.
  const algorithm_row *variant_of = nullptr;
};

inline namespace KSL_ISA { // since kernels call these functions

constexpr int length_of(extent e, int nv, int links) {
  switch (e) {
  case extent::four: return 4;
  case extent::six: return 6;
  case extent::nv: return nv;
  case extent::links: return links;
  }
  return 0;
}

/// How many numbers a result of one state has.
constexpr int numbers_of(const result_row &result, int nv, int links) {
  int n = 1;
  for (int i = 0; i < result.axes; ++i)
    n *= length_of(result.shape[i], nv, links);
  return n;
}

} // namespace KSL_ISA

} // namespace ksl
