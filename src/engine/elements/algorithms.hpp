// Algorithms of models with force elements: kernels of the tree, with the forces of elements as external wrenches and with what derivatives and
// energies need besides.
#pragma once

#include "engine/kernels/algorithm_rows.hpp"
#include "engine/kernels/kernels.hpp"
#include "ksl/model.hpp"

namespace ksl::elements {

/// How force elements enter an algorithm.
enum class part : unsigned char {
  none,
  wrenches, ///< as external wrenches, and in no other way
  energy,
  energy_derivatives,
  effort_derivatives,
  effort_gradient,
  acceleration_derivatives,
  reaction_derivatives,
  refusal ///< they can't be computed with them
};
part part_in(const algorithm_row &row);

/// Is the algorithm computed here for this model?
inline bool act_in(const algorithm_row &row, const model &m) {
  return m.acting_force_elements() > 0 && part_in(row) != part::none;
}

/// Throws std::invalid_argument if the algorithm can't be computed for a model with force elements.
void require_possible(const algorithm_row &row, const model &m);

/// What a call asks for, for memory.
struct room { int externals = 0, links = 0, joints = 0, requests = 0; };
template <class View> room room_for(const View &view) {
  room wanted = {0, view.links.n, view.joints ? view.joints->n : 0, view.reactions_n};
  if constexpr (requires { view.external_n; })
    wanted.externals = view.external_n;
  else
    wanted.externals = view.external.n;
  return wanted;
}

/// Computes one state of the tree, with whatever loops it carries left open.  Returns false if an element has no force there, or if the kernel
/// does.
template <class S> std::size_t state_bytes(const algorithm_row &row, const model &m, room wanted);
template <class S> bool run_state(const algorithm_row &row, const model &m, void *memory, const state_view<S> &s);

/// As batch_kernel.
template <class S>
batch_outcome run_batch(const algorithm_row &row, const model &m, const batch_view<S> &batch, std::size_t first,
                        std::size_t end, void *memory);

} // namespace ksl::elements
