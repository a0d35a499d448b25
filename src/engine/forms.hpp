// Ways to compute and store results that are faster, for some algorithms, than whole_results of engine/kernel.hpp.  A row of
// api/algorithms/ names the form of its results.
#pragma once

#include "engine/kernel.hpp"
#include "ksl/engine/tree_rows.hpp"

namespace ksl {
inline namespace KSL_ISA {
namespace forms {

/// Which elements of a matrix over the coordinates of a tree (engine/tree_rows.hpp) are stored.
enum class stored { both_triangles, upper_triangle, tree_elements };

/// Such a matrix, of which Algorithm::rows computes the elements that aren't zero by the shape of the tree.  In lanes they are
/// stored from there to the rows of a batch, in the order of a list that is made once.
template <class Algorithm, stored which> struct matrix_of_tree : whole_results<Algorithm> {
  template <class P> struct lanes {
    using S = scalar_of<P>;
    int *element; ///< where each number lies in w.rows; −1: it is zero
    int segments, n;

    void lay_out(arena &memory, const model_view<S> &model, const batch_view<S> &) {
      n = which == stored::tree_elements ? model.tree_elements : model.nv * model.nv;
      segments = which == stored::upper_triangle ? model.nv : 1;
      element = memory.take<int>(n);
      if (memory.counts())
        return;
      const int pitch = model.longest_path;
      int *next = element;
      for (int k = 0; k < n && which != stored::tree_elements; ++k)
        element[k] = -1;
      for_each_row(model, [&](const auto &, int i, index row, index place) {
        for_each_line(model, i, [&](index column, index first, index width) {
          for (index k = 0; k < width && column + k <= row; ++k) {
            const int at = static_cast<int>(row) * pitch + static_cast<int>(first + k);
            if constexpr (which == stored::tree_elements)
              next[first + k] = at;
            else
              element[row * model.nv + column + k] = element[(column + k) * model.nv + row] = at;
          }
        });
        next += place + 1;
      });
    }
    void compute(const model_view<S> &model, const workspace_of<Algorithm, P> &w, state_view<P> &s, const block<P> &b) {
      const rows_view<S> &rows = b.batch.result[0];
      if (!rows.first)
        return; // not wanted
      Algorithm::rows(model, w, s);
      const P *const from = w.rows[0], zero(S(0));
      for (int r = 0; r < segments; ++r) {
        const int begin = segments > 1 ? r * model.nv + r : 0, end = segments > 1 ? (r + 1) * model.nv : n;
        const int *at = element + begin;
        const auto next = [&]() -> const P & {
          const int k = *at++;
          return k < 0 ? zero : from[k];
        };
        store_next<S, sizeof(P) / sizeof(S)>(next, end - begin, b.valid, row(rows, b.k) + begin, rows.stride);
      }
    }
  };
};
template <class Algorithm> using symmetric_matrix = matrix_of_tree<Algorithm, stored::both_triangles>;
template <class Algorithm> using upper_triangle = matrix_of_tree<Algorithm, stored::upper_triangle>;
template <class Algorithm> using tree_elements = matrix_of_tree<Algorithm, stored::tree_elements>;

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
  static void state(const model_view<scalar_of<T>> &model, const workspace_of<Algorithm, T> &w, const state_view<T> &s) {
    const bool any = s.reactions_n > 0;
    if (s.q)
      inverse_dynamics_with_reactions(model, w, s.q, s.v, s.a, s.external, s.result[0], any ? *s.reactions->request : no_reactions,
                                      any ? s.reactions->out : nullptr);
    for (int r = s.q ? 1 : 0; r < s.reactions_n; ++r)
      reactions(model, w, s.external, *s.reactions[r].request, s.reactions[r].out);
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
