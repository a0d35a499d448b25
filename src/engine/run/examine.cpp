#include "engine/run/examine.hpp"

#include "engine/elements/forces.hpp"
#include "engine/kernels/one_state.hpp"
#include "engine/loops/algorithms.hpp"
#include "engine/model/massless_joint.hpp"
#include "engine/states/ordinary_results.hpp"
#include "engine/states/thread_memory.hpp"
#include "engine/states/ways.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace ksl {
namespace {

/// A number that isn't finite before one that is large; results in their order, then reactions.
template <class S> found_number look_at_results(const algorithm_row &row, const model &m, const state_view<S> &s) {
  found_number found;
  for (int r = 0; r < row.results; ++r) {
    // row i of (nv, nv) from its diagonal on: nv − i numbers from i (nv + 1)
    if (row.mimic == mimic_by::upper_triangle) { // below the diagonal nothing was written
      for (int i = 0; i < m.nv(); ++i)
        look(row.result[r].name, s.result[r], i * (m.nv() + std::ptrdiff_t(1)), m.nv() - i, found);
    } else {
      look(row.result[r].name, s.result[r], 0, numbers_of(row.result[r], extents_of(m, s)), found);
    }
  }
  for (int r = 0; r < s.reactions_n; ++r)
    look("reactions", s.reactions[r].out, 0, 6 * std::ptrdiff_t(s.reactions[r].request->n), found);
  return found;
}

template <class S> bool finite(const S *x, std::ptrdiff_t n) {
  for (std::ptrdiff_t i = 0; x && i < n; ++i)
    if (!std::isfinite(x[i]))
      return false;
  return true;
}

/// Was a result written over this argument?  Then the argument can't be examined any more.
template <class S> bool is_overwritten(const algorithm_row &row, const state_view<S> &s, const S *argument) {
  return std::any_of(s.result, s.result + row.results, [&](const S *result) { return result == argument; });
}

/// Are the arguments of the state finite?  One that a result was written over is taken as finite.
template <class S> bool finite_arguments(const algorithm_row &row, const model &m, const state_view<S> &s) {
  bool well = finite(s.external.wrench, 6 * std::ptrdiff_t(s.external.n));
  for (int i = 0; i < row.inputs; ++i) {
    const S *const x = input_of(s, row.input_list[i]);
    well = well && (is_overwritten(row, s, x) || finite(x, length_of(row.input_list[i], m.nq(), m.nv())));
  }
  return well;
}

bool has_moving_mass(const model &m) {
  for (std::size_t i = 0; i < m.links().size(); ++i)
    if (m.view().link[i].body > 0 && m.links()[i].inertia.m > 0)
      return true;
  return false;
}

/// The joint that moves no mass at the position of a state, or −1.  If a result was written over the position, only a joint that moves
/// no mass at any position is found.
template <class S> int joint_without_mass(const algorithm_row &row, const model &m, const massless_joint_workspace &w,
                                          const state_view<S> &s) {
  if (m.massless_joint() >= 0 || is_overwritten(row, s, s.q))
    return m.massless_joint();
  return massless_joint_at(m, w, s.q);
}

/// The questions, in this order, since the first that has an answer is the cause of the others: does a force element have no force there?  Is the state none
/// of the closed mechanism?  Is nothing found?  Were arguments not finite, so that results needn't be?  Has the model no mass, where that is documented?
/// Does a joint move no mass?  Large results that no such joint explains are right.  What is left overflowed.
template <class S> void examine(const algorithm_row &row, const model &m, const massless_joint_workspace &w,
                                const state_view<S> &s, std::size_t state, bool of_batch, arguments_are given) {
  const found_number found = look_at_results(row, m, s);
  if (found.name && !found.finite && m.acting_force_elements() > 0 && finite_arguments(row, m, s) &&
      !is_overwritten(row, s, s.q))
    if (const std::string reason = elements::reason(m, s.q, is_overwritten(row, s, s.v) ? nullptr : s.v);
        !reason.empty())
      throw result_error(beginning_of_error(row.name, state, of_batch) + reason, state, -1);
  if (found.name && way_of(row, m) == way::loops && finite_arguments(row, m, s) && !std::isfinite(found.value))
    if (const std::string reason = loops::reason(row, m, s); !reason.empty())
      throw result_error(beginning_of_error(row.name, state, of_batch) + reason, state, -1);
  if (!found.name || (found.finite && !row.needs_mass))
    return;
  if (given == arguments_are::unchecked && !finite_arguments(row, m, s))
    return;
  if (row.nan_without_mass && !has_moving_mass(m))
    return;
  if (const int joint = row.needs_mass ? joint_without_mass(row, m, w, s) : -1; joint >= 0)
    throw result_error(beginning_of_error(row.name, state, of_batch) + m.massless_joint_text(joint), state, joint);
  if (found.finite)
    return;
  throw not_finite<S>(row.name, found, state, of_batch);
}

/// Memory for examining one state of a batch: its wrenches and reactions, and the search for a joint without mass.  Inputs are not copied,
/// so that is_overwritten recognises them by their addresses.
template <class S> struct examined_state {
  massless_joint_workspace search;
  state_in_batch<S> state;

  void lay_out(arena &memory, const algorithm_row &row, const model &m, const batch_view<S> &batch) {
    if (row.needs_mass)
      search.lay_out(memory, m);
    state.lay_out(memory, batch.external_n, batch.reactions_n);
  }
};

} // namespace

std::size_t examination_bytes(const model &m) { return workspace_bytes<massless_joint_workspace>(m); }

template <class S> std::size_t examination_bytes(const algorithm_row &row, const model &m, const batch_view<S> &batch) {
  arena measure;
  examined_state<S>().lay_out(measure, row, m, batch);
  return measure.used();
}

template <class S> void examine_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s,
                                      arguments_are given) {
  arena pieces(memory);
  examine(row, m, pieces.take_workspace<massless_joint_workspace>(m), s, 0, false, given);
}

template <class S>
void examine_states(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first,
                    std::size_t end, arguments_are given) {
  const batch_view<S> named = as_row_names(row, batch);
  arena pieces(thread_memory(kept_for::workspace, examination_bytes(row, m, named)));
  examined_state<S> one{};
  one.lay_out(pieces, row, m, named);
  for (std::size_t k = first; k < end; ++k)
    examine(row, m, one.search, one.state.load(named, k), k, batch.n > 1, given);
}

#define KSL_INSTANTIATE(S)                                                                                             \
  template std::size_t examination_bytes(const algorithm_row &, const model &, const batch_view<S> &);                 \
  template void examine_state(const algorithm_row &, const model &, void *, const state_view<S> &, arguments_are);     \
  template void examine_states(const algorithm_row &, const model &, const batch_view<S> &, std::size_t, std::size_t,  \
                               arguments_are);
KSL_INSTANTIATE(double)
KSL_INSTANTIATE(float)
#undef KSL_INSTANTIATE

} // namespace ksl
