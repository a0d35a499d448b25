// Ways to compute and store results that are faster, for some algorithms, than whole_results of engine/kernels/kernel.hpp.  A row of
// api/algorithms/ names the form of its results.
#pragma once

#include "engine/kernels/compiled_once/compiled_once.hpp"

namespace ksl {
inline namespace KSL_ISA {
namespace forms {

/// Returns chosen packs in lanes, one after the other.
template <class P> struct chosen_columns : summed_columns<P> {
  const P *from;
  const int *chosen; ///< which of them
  chosen_columns(const P *packs, const int *numbers, sums<P> &stored)
      : summed_columns<P>{&stored}, from(packs), chosen(numbers) {}
  KSL_LANES const P &operator()() { return from[*chosen++]; }
};

/// A symmetric matrix (nv, nv).  In lanes Algorithm::elements computes what the shape of the tree lets differ from zero (tree_rows.hpp).
///
///     element = [ 0 | row 0 of the tree | row 1 | … ]     number (nv, nv): for each place of the matrix the element that it has, 0 where it is zero
///
/// Of a body that carries two, which carry none, one coordinate each (tree_rows.hpp):
///
///     element   0 | M₀₀ | M₁₀ M₁₁ | M₂₀ M₂₂          number   1 2 4
///               0   1     2   3     4   5                     2 3 0
///                                                             4 0 5
///
/// The list is made at the first block, and serves all.
template <class Algorithm> struct symmetric_matrix : whole_results<Algorithm> {
  template <class P> struct lanes {
    P *element;  ///< zero, and then those of the tree
    int *number; ///< of each place of the matrix in `element`
    bool listed = false;

    void lay_out(arena &memory, const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &) {
      element = memory.take<P>(1 + model.tree_elements);
      number = memory.take<int>(model.nv * model.nv);
    }
    void list_places(const model_view<scalar_of<P>> &model) {
      element[0] = P(scalar_of<P>(0));
      const index n = model.nv;
      for (index k = 0; k < n * n; ++k)
        number[k] = 0;
      for (int i = 1; i < model.bodies; ++i)
        for (int c = 0; c < model.body[i].nv; ++c) {
          const index row = model.body[i].v_index + c;
          const int first = 1 + model.tree_row[row];
          number[row * n + row] = first + model.body[i].ancestors + c;
          for_each_ancestor(model, i, c, [&](index column, index place) KSL_INLINED {
            number[row * n + column] = number[column * n + row] = first + static_cast<int>(place);
          });
        }
      listed = true;
    }
    /// Computes the elements, if the matrix is wanted.
    bool elements(const model_view<scalar_of<P>> &model, const workspace_of<Algorithm, P> &w, state_view<P> &s,
                  const block<P> &b) {
      if (!b.batch.result[0].first)
        return false;
      if (!listed)
        list_places(model);
      s.result[0] = element + 1;
      Algorithm::elements(model, w, s);
      return true;
    }
    void compute(const model_view<scalar_of<P>> &model, const workspace_of<Algorithm, P> &w, state_view<P> &s,
                 const block<P> &b) {
      const rows_view<scalar_of<P>> &out = b.batch.result[0];
      if (!elements(model, w, s, b))
        return;
      chosen_columns<P> next(element, number, b.stored);
      store_next_of<scalar_of<P>, transposition::width_of<P>>(b.batch.n, next, index(model.nv) * model.nv, b.valid,
                                                              row(out, b.k), out.stride);
      next.finish();
    }
  };
};

/// Stores the upper triangles of matrices n × n from the row on that has `columns` of them; `next` returns its packs.  Rows are stored in
/// chunks of K columns.  The last chunk of a row may begin before the one before it ends: the same numbers are then stored twice, which
/// takes less than columns one by one.
///
///     n = 5, K = 4      x x x x x     columns 0 … 3 and 1 … 4
///                         x x x x     0 … 3
///                           x x x     K = 2: 0 and 1, 1 and 2
///                             x x     0 and 1
///                               x     K = 1
template <int K, class T, int W>
KSL_LANES void store_triangles(chosen_columns<pack<T, W>> &next, index n, index columns, int last_row, T *rows,
                               std::ptrdiff_t stride) {
  const int *chosen = next.chosen;
  for (; columns >= K; --columns, chosen += n + 1, rows += n + 1)
    for (index k = 0; k < columns; k += K) {
      const index first = k < columns - K ? k : columns - K;
      next.chosen = chosen + first;
      transposition::store_columns<K, T, W>(next, rows + first, stride, last_row);
    }
  next.chosen = chosen;
  if constexpr (K > 1) // rows shorter than K
    store_triangles<K / 2>(next, n, columns, last_row, rows, stride);
}

/// The upper triangle of a matrix (nv, nv).
template <class Algorithm> struct upper_triangle : symmetric_matrix<Algorithm> {
  template <class P> struct lanes : symmetric_matrix<Algorithm>::template lanes<P> {
    void compute(const model_view<scalar_of<P>> &model, const workspace_of<Algorithm, P> &w, state_view<P> &s,
                 const block<P> &b) {
      if (!this->elements(model, w, s, b))
        return;
      constexpr int W = transposition::width_of<P>, K = transposition::widest_stored<P>;
      const rows_view<scalar_of<P>> &out = b.batch.result[0];
      chosen_columns<P> next(this->element, this->number, b.stored);
      if (b.valid == W)
        store_triangles<K>(next, model.nv, model.nv, W - 1, row(out, b.k), out.stride);
      else
        store_triangles<1>(next, model.nv, model.nv, b.valid - 1, row(out, b.k), out.stride);
      next.finish();
    }
  };
};

/// Results with zeros that follow from the shape of the tree.  They are the same in every block of lanes, and written once.
/// Algorithm::elements computes the others.
template <class Algorithm> struct sparse_results : whole_results<Algorithm> {
  template <class P> struct lanes {
    P *result[most_results];
    bool cleared = false;

    static std::ptrdiff_t numbers(int r, const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &batch) {
      return numbers_of(Algorithm::row.result[r], extents_of(model, batch));
    }
    void lay_out(arena &memory, const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &batch) {
      for (int r = 0; r < Algorithm::row.results; ++r)
        result[r] = memory.take<P>(numbers(r, model, batch));
    }
    void compute(const model_view<scalar_of<P>> &model, const workspace_of<Algorithm, P> &w, state_view<P> &s,
                 const block<P> &b) {
      for (int r = 0; r < Algorithm::row.results; ++r) {
        s.result[r] = result[r];
        for (std::ptrdiff_t i = 0; i < numbers(r, model, b.batch) && !cleared; ++i)
          result[r][i] = P(scalar_of<P>(0));
      }
      cleared = true;
      Algorithm::elements(model, w, s);
      for (int r = 0; r < Algorithm::row.results; ++r)
        b.store(result[r], numbers(r, model, b.batch), b.batch.result[r]);
    }
  };
};

/// Accelerations.  Algorithm::reduce computes all but the last pass.  That is computed for two blocks at a time: each of its operations
/// waits for the one before.
///
///     block 0   reduce into `other`                               any_waiting
///     block 1   reduce into w, last pass of 0 and of 1, store     none waits
///     block 2   reduce into `other`                               any_waiting; if it is the last one, finish() does its last pass
template <class Algorithm> struct accelerations : whole_results<Algorithm> {
  template <class P> struct lanes {
    using S = scalar_of<P>;
    workspace_of<Algorithm, P> other; ///< of the first of two blocks
    P *result[2];
    std::size_t waiting; ///< the first state of a block whose last pass is to come
    bool any_waiting = false;

    void lay_out(arena &memory, const model_view<S> &model, const batch_view<S> &) {
      other.lay_out(memory, model);
      result[0] = memory.take<P>(model.nv), result[1] = memory.take<P>(model.nv);
    }
    void compute(const model_view<S> &model, const workspace_of<Algorithm, P> &w, state_view<P> &s, const block<P> &b) {
      s.result[0] = result[any_waiting ? 1 : 0];
      Algorithm::reduce(model, any_waiting ? w : other, s);
      if (any_waiting) {
        accelerate_joints_of_two(model, other, result[0], w, result[1]);
        const block<P> first = {b.batch, waiting, transposition::width_of<P>, b.stored};
        first.store(result[0], model.nv, b.batch.result[0]);
        b.store(result[1], model.nv, b.batch.result[0]);
      }
      waiting = b.k, any_waiting = !any_waiting;
    }
    /// After all blocks: computes the last pass of one that waits for it.  `end` is behind its last state.
    void finish(const model_view<S> &model, const batch_view<S> &batch, std::size_t end, sums<P> &stored) const {
      if (!any_waiting)
        return;
      accelerate_joints(model, other, result[0]);
      const block<P> last = {batch, waiting, static_cast<int>(end - waiting), stored};
      last.store(result[0], model.nv, batch.result[0]);
    }
  };
};

/// Poses (links, 4, 4).  Each matrix is kept in registers until it is stored.
template <class Algorithm> struct poses_of_links : whole_results<Algorithm> {
  template <class P> struct lanes {
    void lay_out(arena &, const model_view<scalar_of<P>> &, const batch_view<scalar_of<P>> &) {}
    void compute(const model_view<scalar_of<P>> &model, const workspace_of<Algorithm, P> &w, state_view<P> &s,
                 const block<P> &b) {
      const rows_view<scalar_of<P>> &rows = b.batch.result[0];
      if (!rows.first)
        return; // not wanted
      scalar_of<P> *out = row(rows, b.k);
      forward_kinematics(model, w, s.q);
      for (int i = 0; i < s.links.n; ++i, out += 16) {
        P matrix[16];
        write_matrix(link_pose(model, w.in_world, s.links.index[i]), matrix);
        const P translation[3] = {matrix[3], matrix[7], matrix[11]}; // sines and cosines of finite angles are finite
        b.stored.add(translation, 3);
        store_rows<16>(matrix, b.valid, out, rows.stride);
      }
    }
  };
};

constexpr reaction_request no_reactions{};

/// Efforts, and the reactions of each request.  Those of the first request are written during the backward pass of inverse
/// dynamics.  If q is null, the reactions are those of the state that inverse dynamics computed last in the same workspace.
template <class Algorithm> struct efforts_and_reactions {
  template <class T>
  static void state(const model_view<scalar_of<T>> &model, const workspace_of<Algorithm, T> &w,
                    const state_view<T> &s) {
    const bool any = s.reactions_n > 0;
    if (s.q)
      inverse_dynamics_with_reactions(model, w, s.q, s.v, s.a, s.external, s.result[0],
                                      any ? *s.reactions->request : no_reactions, any ? s.reactions->out : nullptr);
    for (int r = s.q ? 1 : 0; r < s.reactions_n; ++r)
      reactions(model, w, s.external, *s.reactions[r].request, s.reactions[r].out);
  }
  template <class T> static void add_results(const model_view<scalar_of<T>> &model, const state_view<T> &s,
                                             sums<T> &written) {
    written.add(s.result[0], model.nv);
    for (int r = 0; r < s.reactions_n; ++r)
      written.add(s.reactions[r].out, 6 * s.reactions[r].request->n);
  }

  template <class P> struct lanes {
    P *tau, *found;

    void lay_out(arena &memory, const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &batch) {
      int most = 0;
      for (int r = 0; r < batch.reactions_n; ++r)
        most = most > batch.reactions[r].request.n ? most : batch.reactions[r].request.n;
      tau = memory.take<P>(model.nv);
      found = memory.take<P>(6 * most);
    }
    void compute(const model_view<scalar_of<P>> &model, const workspace_of<Algorithm, P> &w, state_view<P> &s,
                 const block<P> &b) {
      const reaction_rows<scalar_of<P>> *wanted = b.batch.reactions;
      inverse_dynamics_with_reactions(model, w, s.q, s.v, s.a, s.external, tau,
                                      b.batch.reactions_n ? wanted->request : no_reactions, found);
      b.store(tau, model.nv, b.batch.result[0]);
      for (int r = 0; r < b.batch.reactions_n; ++r) {
        if (r > 0)
          reactions(model, w, s.external, wanted[r].request, found);
        b.store(found, 6 * wanted[r].request.n, wanted[r].out);
      }
    }
  };
};

} // namespace forms
} // namespace KSL_ISA
} // namespace ksl
