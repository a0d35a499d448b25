// KSL: many states in one call, a state in each lane of the registers and ranges of states on several threads.
//
// Results don't depend on the number of threads, on the place of a state in the batch, nor on the instruction set: they
// are the bits of the one-state calls.
#pragma once

#include "ksl/dynamics.hpp"
#include "ksl/engine/batch_view.hpp"

#include <vector>

namespace ksl {

/// Efforts (rows of nv into batch.out) for q, v, a, and the reactions that are wanted.  S: double or float.
/// threads: how many; 0 is all cores.  Throws std::bad_alloc; nothing else.
template <class S>
KSL_EXPORT void inverse_dynamics_batch(const model &m, const batch_view<S> &batch,
                            const std::vector<reaction_rows<S>> &reactions = {}, int threads = 0);

/// Accelerations (rows of nv into batch.out) for q, v, tau.
template <class S> KSL_EXPORT void forward_dynamics_batch(const model &m, const batch_view<S> &batch, int threads = 0);

/// Mass matrices (rows of nv × nv into batch.out) for q.
template <class S> KSL_EXPORT void mass_matrix_batch(const model &m, const batch_view<S> &batch, int threads = 0);

/// Poses of n links in the world (rows of n × 4 × 4 into batch.out, each row-major) for q.
template <class S>
KSL_EXPORT void frame_poses_batch(const model &m, const batch_view<S> &batch, int n, const int *links, int threads = 0);

/// Kinetic and potential energy (rows of one number each) for q and v.
template <class S>
KSL_EXPORT void energy_batch(const model &m, const batch_view<S> &batch, const rows_view<S> &kinetic,
                             const rows_view<S> &potential, int threads = 0);

/// Power of the external wrenches (rows of one number into batch.out) for q and v.
template <class S> KSL_EXPORT void external_power_batch(const model &m, const batch_view<S> &batch, int threads = 0);

} // namespace ksl
