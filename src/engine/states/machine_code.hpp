// Code that was made for one mechanism at run time, and for what it was made (ksl.generation.compiled).
#pragma once

#include "engine/kernels/algorithm.hpp"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace ksl {

/// The rows of an input or a result, in the precision of the code.
struct code_rows {
  void *first;
  std::ptrdiff_t stride;
};

/// Computes the states 0, 1, … of a batch in the order of rows, until a block of lanes has a result that isn't ordinary
/// (engine/kernels/algorithm.hpp): it is left unwritten.  Returns how many states it computed, n if all.  inputs: those of the row, then
/// each wrench on a link, 6 numbers; results: those of the row, then reactions; one that isn't wanted is null.  memory: aligned to 64 bytes.
using batch_code = std::size_t (*)(std::size_t n, const code_rows *inputs, const code_rows *results, void *memory);

/// Code of one row, and the request that it answers.
struct requested_code {
  std::string asked; ///< the words by which it was asked for, for users
  const algorithm_row *row = nullptr;
  bool single = false; ///< of float
  batch_code run = nullptr;
  int lanes = 1;          ///< states that are computed together
  std::size_t bytes = 0;  ///< of memory that it needs
  std::vector<int> links; ///< of requests for links
  frame_options frame = {};
  std::vector<int> joints;         ///< child links, of requests for joints and for reactions
  reaction_request reactions = {}; ///< how these are expressed; its `link` isn't read
  std::vector<int> externals;      ///< links on which wrenches act, in the links' axes
};

/// Immutable, and shared by copies of a model.  The functions stay loaded as long as the process lives.
struct machine_code {
  std::vector<requested_code> rows;

  /// The code that answers a batch; null: there is none.
  template <class S> const requested_code *find(const algorithm_row &row, const batch_view<S> &batch) const;
};

inline bool same_places(const frame_options &a, const frame_options &b) {
  return a.axes == b.axes && a.at == b.at && a.angular_first == b.angular_first && a.kind == b.kind &&
         std::equal(a.offset, a.offset + 3, b.offset);
}
inline bool same_places(const reaction_request &a, const reaction_request &b) {
  return a.part == b.part && a.on == b.on && a.at == b.at && a.at_link == b.at_link && a.axes == b.axes &&
         a.axes_link == b.axes_link && a.angular_first == b.angular_first &&
         std::equal(a.offset, a.offset + 3, b.offset);
}

template <class S> bool answers(const requested_code &code, const algorithm_row &row, const batch_view<S> &batch) {
  // by name: each object file has rows of its own
  if (std::string_view(code.row->name) != row.name || code.single != (sizeof(S) == sizeof(float)))
    return false;
  const auto same_list = [](const std::vector<int> &own, const int *of, int n) {
    return static_cast<int>(own.size()) == n && std::equal(own.begin(), own.end(), of);
  };
  const auto same_joints = [&](const reaction_request &request) {
    return same_list(code.joints, request.link, request.n) && same_places(code.reactions, request);
  };
  if (static_cast<int>(code.externals.size()) != batch.external_n ||
      (batch.external_n > 0 && batch.external_axes != expressed_in::frame))
    return false;
  for (int e = 0; e < batch.external_n; ++e)
    if (batch.external[e].link != code.externals[static_cast<std::size_t>(e)])
      return false;
  if (row.request == request_kind::reactions)
    return batch.reactions_n == 1 && same_joints(batch.reactions[0].request);
  if (row.request == request_kind::joints)
    return batch.joints && same_joints(*batch.joints);
  return same_list(code.links, batch.links.index, batch.links.n) && same_places(code.frame, batch.frame);
}

template <class S>
const requested_code *machine_code::find(const algorithm_row &row, const batch_view<S> &batch) const {
  const auto found =
      std::find_if(rows.begin(), rows.end(), [&](const requested_code &code) { return answers(code, row, batch); });
  return found == rows.end() ? nullptr : &*found;
}

} // namespace ksl
