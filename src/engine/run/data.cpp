// The memory of workspaces: one block, large enough for any algorithm.
#include "ksl/model.hpp"

#include "engine/kernels/algorithm_rows.hpp"
#include "engine/mimic/algorithms.hpp"
#include "engine/run/examine.hpp"
#include "engine/kernels/largest_workspace.hpp"

#include <algorithm>
#include <limits>

namespace ksl {

namespace {

/// The extents of results for a request that names each link and each joint once.
extents extents_of_all(const model &m) {
  const model_view<double> view = m.view();
  return {m.nq(), m.nv(), view.links, static_cast<int>(m.joints().size()), view.tree_elements, view.links};
}

/// The most bytes that any row needs for results that its kernels write and it doesn't have (engine/run/compute.hpp).
std::size_t unread_bytes(const model &m) {
  std::size_t most = 0;
  for (const algorithm_row *row : rows::all)
    most = std::max(most, unread_bytes(*row, extents_of_all(m)));
  return most;
}

/// The most bytes that engine/mimic/algorithms.cpp needs for one state of any algorithm, for a request that names each link and joint once.
std::size_t coupled_bytes(const model &m) {
  if (m.followers() == 0)
    return 0;
  std::size_t most = 0;
  const extents all = extents_of_all(m);
  for (const algorithm_row *row : rows::all)
    if (row->coupled != coupled_by::refusal)
      most = std::max({most, coupled::state_bytes<double>(*row, m, all), coupled::state_bytes<float>(*row, m, all)});
  return most;
}

/// The most bytes that mechanisms with loops need for a call with a wrench on each link and a request that names each joint once.
std::size_t closed_bytes(const model &m) {
  if (m.loops().empty())
    return 0;
  const loops::room all = loops::room_of_data(m);
  return std::max(loops::state_bytes<double>(rows::inverse_dynamics_with_reactions, m, all),
                  loops::state_bytes<float>(rows::inverse_dynamics_with_reactions, m, all));
}

/// The most bytes that force elements need for one state of any algorithm, for a wrench on each link and a request that names each link and
/// joint once.
std::size_t force_element_bytes(const model &m) {
  std::size_t most = 0;
  const int links = static_cast<int>(m.links().size()), joints = static_cast<int>(m.joints().size());
  for (const algorithm_row *row : rows::all)
    if (elements::act_in(*row, m))
      most = std::max({most, elements::state_bytes<double>(*row, m, {links, links, joints, 1}),
                       elements::state_bytes<float>(*row, m, {links, links, joints, 1})});
  return most;
}

} // namespace

data::data(const model &m)
    : bytes_(std::max({largest_workspace(m.view()), coupled_bytes(m), closed_bytes(m), force_element_bytes(m),
                       examination_bytes(m)}) +
             unread_bytes(m)),
      memory_(::operator new(bytes_, alignment)), zero_(static_cast<std::size_t>(m.nv())), zero_single_(zero_.size()) {
#ifndef NDEBUG
  std::fill_n(static_cast<double *>(memory_.get()), bytes_ / sizeof(double), std::numeric_limits<double>::quiet_NaN());
#endif
}

} // namespace ksl
