// Ways to compute and store results that are faster, for some algorithms, than whole_results of engine/kernel.hpp.  A row of
// api/algorithms/ names the form of its results.
#pragma once

#include "engine/compiled_once/compiled_once.hpp"

namespace ksl {
inline namespace KSL_ISA {
namespace forms {

/// Returns the elements of a symmetric n × n matrix in lanes, row after row, from its upper triangle.  Left of the diagonal it goes down
/// a column of the triangle, and then along its row.
template <class P> struct symmetric_columns : summed_columns<P> {
  const P *upper, *element;
  int n, row = 0, column = 0;
  symmetric_columns(const P *triangle, int size, sums<P> &stored)
      : summed_columns<P>{&stored}, upper(triangle), element(triangle), n(size) {}

  KSL_LANES const P &operator()() {
    const P &x = *element;
    element += column < row ? n : 1;
    if (++column == n)
      column = 0, element = upper + ++row;
    return x;
  }
};

/// A symmetric matrix (nv, nv).  In lanes only its upper triangle is computed, by Algorithm::elements.
template <class Algorithm> struct symmetric_matrix : whole_results<Algorithm> {
  template <class P> struct lanes {
    P *matrix;
    bool cleared = false;

    void lay_out(arena &memory, const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &) {
      matrix = memory.take<P>(model.nv * model.nv);
    }
    /// Computes the upper triangle, if it is wanted.
    bool elements(const model_view<scalar_of<P>> &model, const workspace_of<Algorithm, P> &w, state_view<P> &s,
                  const block<P> &b) {
      if (!b.batch.result[0].first)
        return false;
      for (int i = 0; i < model.nv * model.nv && !cleared; ++i)
        matrix[i] = P(scalar_of<P>(0)); // zeros that follow from the shape of the tree are the same in every block
      cleared = true;
      s.result[0] = matrix;
      Algorithm::elements(model, w, s);
      return true;
    }
    void compute(const model_view<scalar_of<P>> &model, const workspace_of<Algorithm, P> &w, state_view<P> &s,
                 const block<P> &b) {
      const rows_view<scalar_of<P>> &rows = b.batch.result[0];
      if (!elements(model, w, s, b))
        return;
      symmetric_columns<P> next(matrix, model.nv, b.stored);
      store_next_of<scalar_of<P>, transposition::width_of<P>>(b.batch.n, next, model.nv * model.nv, b.valid,
                                                              row(rows, b.k), rows.stride);
      next.finish();
    }
  };
};

/// The upper triangle of a matrix (nv, nv).
template <class Algorithm> struct upper_triangle : symmetric_matrix<Algorithm> {
  template <class P> struct lanes : symmetric_matrix<Algorithm>::template lanes<P> {
    void compute(const model_view<scalar_of<P>> &model, const workspace_of<Algorithm, P> &w, state_view<P> &s,
                 const block<P> &b) {
      if (!this->elements(model, w, s, b))
        return;
      scalar_of<P> *const out = row(b.batch.result[0], b.k);
      for (std::ptrdiff_t i = 0; i < model.nv; ++i) {
        next_columns<P> next(this->matrix + i * (model.nv + 1), b.stored);
        store_next<scalar_of<P>, transposition::width_of<P>>(next, model.nv - i, b.valid, out + i * (model.nv + 1),
                                                             b.batch.result[0].stride);
        next.finish();
      }
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
