// Algorithms over batches: one state in each lane, block after block.  A block's workspace stays in the inner caches.
#pragma once

#include "ksl/engine/batch_view.hpp"
#include "batch/transpose.hpp"
#include "ksl/engine/energy.hpp"
#include "ksl/engine/forward_dynamics.hpp"
#include "ksl/engine/mass_matrix.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// One lane: a row is what it is.
template <class S> void load_rows(const S *row, std::ptrdiff_t, int columns, int, S *out) {
  for (int c = 0; c < columns; ++c)
    out[c] = row[c];
}
template <class S> void store_rows(const S *in, int columns, int, S *row, std::ptrdiff_t) {
  for (int c = 0; c < columns; ++c)
    row[c] = in[c];
}

template <int columns, class S> KSL_LANES void store_rows(const S *in, int, S *row, std::ptrdiff_t) {
  for (int c = 0; c < columns; ++c)
    row[c] = in[c];
}

/// Everything that one block of states needs: the algorithm's workspace, its arguments and its results.
template <class P, class Workspace> struct block_workspace {
  Workspace of_algorithm;
  P *q, *v, *a, *result, *external;

  /// result: the most numbers that come out for a state; external: numbers of external wrenches.
  block_workspace(arena &memory, const model_view<scalar_of<P>> &model, int results, int externals) {
    of_algorithm.lay_out(memory, model);
    q = memory.take<P>(model.nq);
    v = memory.take<P>(model.nv);
    a = memory.take<P>(model.nv);
    external = memory.take<P>(externals);
    result = memory.take<P>(results);
  }
};

/// Rows of a block into lanes; zeros where there are none.
template <class P> void load(const rows_view<const scalar_of<P>> &rows, std::size_t k, int columns, int valid, P *out) {
  if (rows.first) {
    load_rows(row(rows, k), rows.stride, columns, valid, out);
    return;
  }
  for (int i = 0; i < columns; ++i)
    out[i] = P(scalar_of<P>(0));
}

/// Calls compute(k, valid, workspace, external) for every block of states, `valid` of them from k on.  per_state: the most
/// numbers that come out for a state.  Returns the bytes of workspace needed; without memory it does no more.
template <class P, template <class> class Workspace, class Compute>
std::size_t for_each_block(const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &batch, void *memory,
                           int per_state, Compute compute) {
  constexpr int lanes = static_cast<int>(sizeof(P) / sizeof(scalar_of<P>));
  arena pieces(memory);
  block_workspace<P, Workspace<P>> w(pieces, model, per_state, 6 * batch.external_n);
  if (!memory)
    return pieces.used();
  const external_wrenches<P> external = {batch.external_n, batch.external_link, w.external};
  for (std::size_t k = 0; k < batch.n; k += lanes) {
    const int valid = batch.n - k < lanes ? static_cast<int>(batch.n - k) : lanes;
    load(batch.q, k, model.nq, valid, w.q);
    load(batch.external, k, 6 * batch.external_n, valid, w.external);
    compute(k, valid, w, external);
  }
  return pieces.used();
}

template <class P>
std::size_t inverse_dynamics_lanes(const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &batch, int n,
                                   const reaction_rows<scalar_of<P>> *wanted, void *memory) {
  int most = 0;
  for (int r = 0; r < n; ++r)
    most = most > 6 * wanted[r].request.n ? most : 6 * wanted[r].request.n;
  const int results = model.nv + most;
  return for_each_block<P, reactions_workspace>(model, batch, memory, results, [&](std::size_t k, int valid, const auto &w, const auto &external) {
    load(batch.v, k, model.nv, valid, w.v);
    load(batch.a, k, model.nv, valid, w.a);
    P *const found = w.result + model.nv;
    if (n > 0)
      inverse_dynamics_with_reactions(model, w.of_algorithm, w.q, w.v, w.a, external, w.result, wanted[0].request, found);
    else
      inverse_dynamics(model, w.of_algorithm.dynamics, w.q, w.v, w.a, external, w.result);
    if (batch.out.first)
      store_rows(w.result, model.nv, valid, row(batch.out, k), batch.out.stride);
    for (int r = 0; r < n; ++r) {
      if (r > 0)
        reactions(model, w.of_algorithm, external, wanted[r].request, found);
      store_rows(found, 6 * wanted[r].request.n, valid, row(wanted[r].out, k), wanted[r].out.stride);
    }
  });
}

template <class P>
std::size_t forward_dynamics_lanes(const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &batch,
                                   void *memory) {
  return for_each_block<P, forward_dynamics_workspace>(model, batch, memory, model.nv, [&](std::size_t k, int valid, const auto &w, const auto &external) {
    load(batch.v, k, model.nv, valid, w.v);
    load(batch.tau, k, model.nv, valid, w.a);
    forward_dynamics(model, w.of_algorithm, w.q, w.v, w.a, external, w.result);
    store_rows(w.result, model.nv, valid, row(batch.out, k), batch.out.stride);
  });
}

/// A symmetric n × n matrix of packs, of which the upper triangle is given.
template <class T, int W>
void store_symmetric(const pack<T, W> *upper, int n, int valid, T *rows, std::ptrdiff_t stride) {
  const pack<T, W> *element = upper;
  int row = 0, column = 0;
  const auto next = [&]() -> const pack<T, W> & { // down the column to the diagonal, then along the row
    const pack<T, W> &x = *element;
    element += column < row ? n : 1;
    if (++column == n)
      column = 0, element = upper + ++row;
    return x;
  };
  store_next<T, W>(next, n * n, valid, rows, stride);
}

template <class P>
std::size_t mass_matrix_lanes(const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &batch, void *memory) {
  const int nv = model.nv, size = nv * nv;
  bool cleared = false; // the zeros of one triangle are those of every other
  return for_each_block<P, mass_matrix_workspace>(model, batch, memory, size, [&](std::size_t k, int valid, const auto &w, const auto &) {
    if constexpr (is_number<P>) {
      mass_matrix(model, w.of_algorithm, w.q, w.result);
      store_rows(w.result, size, valid, row(batch.out, k), batch.out.stride);
    } else {
      for (int i = 0; i < size && !cleared; ++i)
        w.result[i] = P(0);
      cleared = true;
      elements_of_mass_matrix(model, w.of_algorithm, w.q, w.result);
      store_symmetric(w.result, nv, valid, row(batch.out, k), batch.out.stride);
    }
  });
}

template <class P>
std::size_t frame_poses_lanes(const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &batch, int n,
                              const int *links, void *memory) {
  return for_each_block<P, forward_kinematics_workspace>(model, batch, memory, 0, [&](std::size_t k, int valid, const auto &w, const auto &) {
    forward_kinematics(model, w.of_algorithm, w.q);
    scalar_of<P> *out = row(batch.out, k);
    for (int i = 0; i < n; ++i, out += 16) {
      P matrix[16]; // stays in registers until it is stored, one row a state
      write_matrix(link_pose(model, w.of_algorithm.in_world, links[i]), matrix);
      store_rows<16>(matrix, valid, out, batch.out.stride);
    }
  });
}

template <class P>
std::size_t energy_lanes(const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &batch,
                         const rows_view<scalar_of<P>> &kinetic, const rows_view<scalar_of<P>> &potential, void *memory) {
  return for_each_block<P, energy_workspace>(model, batch, memory, 2, [&](std::size_t k, int valid, const auto &w, const auto &) {
    load(batch.v, k, model.nv, valid, w.v);
    energy(model, w.of_algorithm, w.q, w.v, w.result, w.result + 1);
    store_rows(w.result, 1, valid, row(kinetic, k), kinetic.stride);
    store_rows(w.result + 1, 1, valid, row(potential, k), potential.stride);
  });
}

template <class P>
std::size_t external_power_lanes(const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &batch, void *memory) {
  return for_each_block<P, external_power_workspace>(model, batch, memory, 1, [&](std::size_t k, int valid, const auto &w, const auto &external) {
    load(batch.v, k, model.nv, valid, w.v);
    external_power(model, w.of_algorithm, w.q, w.v, external, w.result);
    store_rows(w.result, 1, valid, row(batch.out, k), batch.out.stride);
  });
}

} // namespace KSL_ISA
} // namespace ksl
