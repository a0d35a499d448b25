// KSL: the arguments of an algorithm: one state, or a batch of states as row-major arrays with a row for each state.
//
// All algorithms share these two structs.  api/algorithms/ says which members each of them
// reads and writes; the others are ignored.
#pragma once

#include "ksl/engine/steps/external_wrenches.hpp"
#include "ksl/engine/steps/frame_options.hpp"
#include "ksl/engine/steps/reaction_request.hpp"

#include <cstddef>

namespace ksl {

/// Links by index, in the order wanted; a link may be listed twice.
struct link_list {
  int n = 0;
  const int *index = nullptr; ///< (n)
};

constexpr int most_results = 4; ///< the largest number of results of an algorithm, reactions not counted

/// Reactions of one state: 6 numbers for each joint of the request.
template <class T> struct reaction_result {
  const reaction_request *request = nullptr;
  T *out = nullptr;
};

/// One state.
template <class T> struct state_view {
  const T *q = nullptr, *v = nullptr, *a = nullptr, *tau = nullptr, *q1 = nullptr, *fraction = nullptr;
  external_wrenches<T> external = {};
  link_list links = {};
  frame_options frame = {};
  const reaction_request *joints = nullptr;
  int reactions_n = 0;
  const reaction_result<T> *reactions = nullptr; ///< (reactions_n)
  T *result[most_results] = {};                  ///< in the order in which the algorithm lists them
};

/// Rows of numbers; stride is the distance between two rows, in numbers.
template <class S> struct rows_view {
  S *first = nullptr;
  std::ptrdiff_t stride = 0;
};

/// Wrenches that the environment exerts on one link.  A row is a wrench: linear first, at the link's origin, in the
/// link's axes or the world's.
template <class S> struct external_rows {
  int link = 0;
  rows_view<const S> wrench;
};

/// Reactions requested for every state: a row holds request.n × 6 numbers.
template <class S> struct reaction_rows {
  reaction_request request;
  rows_view<S> out;
};

/// n states.  Inputs without rows are taken as zero; results and reactions without rows are not stored.  An algorithm of one link takes
/// the first of `links`; one of a link seen from another takes the first two.  If there are fewer, nothing is computed.
template <class S> struct batch_view {
  std::size_t n = 0;
  rows_view<const S> q = {}, v = {}, a = {}, tau = {}, q1 = {}, fraction = {};
  int external_n = 0;
  const external_rows<S> *external = nullptr;       ///< (external_n)
  expressed_in external_axes = expressed_in::frame; ///< of all of them
  link_list links = {};
  frame_options frame = {};
  const reaction_request *joints = nullptr; ///< joints, and how their wrenches are expressed
  int reactions_n = 0;
  const reaction_rows<S> *reactions = nullptr; ///< (reactions_n)
  rows_view<S> result[most_results] = {};      ///< in the order in which the algorithm lists them
};

inline namespace KSL_ISA {

/// Row k.
template <class S> S *row(const rows_view<S> &rows, std::size_t k) {
  return rows.first + static_cast<std::ptrdiff_t>(k) * rows.stride;
}

/// The rows of an array from k on; absent rows stay absent.
template <class S> rows_view<S> rows_from(const rows_view<S> &rows, std::size_t k) {
  return rows.first ? rows_view<S>{row(rows, k), rows.stride} : rows_view<S>{};
}

} // namespace KSL_ISA
} // namespace ksl
