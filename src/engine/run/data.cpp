// The memory of workspaces: one block, large enough for any algorithm.
#include "ksl/model.hpp"

#include "engine/kernels/algorithm_rows.hpp"
#include "engine/kernels/largest_workspace.hpp"
#include "engine/run/examine.hpp"
#include "engine/run/all_ways.hpp"

#include <algorithm>
#include <limits>

namespace ksl {

namespace {

/// May a row take memory of its thread instead?  The linear ones of mechanisms with loops need much; those that are refused need none.
bool has_other_memory(const algorithm_row &row, const model &m) {
  return way_of(row, m) == way::loops ? row.loops == loops_by::linear || row.loops == loops_by::refusal
                                      : m.followers() > 0 && row.mimic == mimic_by::refusal;
}

/// The most bytes that a way above the kernels needs for one state of a row, with a wrench on each link and a request that names each link
/// and joint once.
template <class S> std::size_t most_bytes(const model &m) {
  std::size_t most = 0;
  for (const algorithm_row *row : rows::all)
    if (way_of(*row, m) != way::kernels && row->loops != loops_by::plan && !has_other_memory(*row, m))
      most = std::max(most, calls_of<S>(*row, m).state_bytes(*row, m, room_of_data(m)));
  return most;
}

/// Those that kernels alone need: no kernel is called, so that a workspace can be made before an instruction set is chosen.
std::size_t most_bytes_of_kernels(const model &m) {
  std::size_t unread = 0;
  for (const algorithm_row *row : rows::all)
    unread = std::max(unread, kernel_calls::unread_bytes(*row, extents_of(m, room_of_data(m))));
  return largest_workspace(m.view()) + unread;
}

} // namespace

data::data(const model &m)
    : bytes_(std::max({most_bytes_of_kernels(m), most_bytes<double>(m), most_bytes<float>(m), examination_bytes(m)})),
      memory_(::operator new(bytes_, alignment)), zero_(static_cast<std::size_t>(m.nv())), zero_single_(zero_.size()) {
#ifndef NDEBUG
  std::fill_n(static_cast<double *>(memory_.get()), bytes_ / sizeof(double), std::numeric_limits<double>::quiet_NaN());
#endif
}

} // namespace ksl
