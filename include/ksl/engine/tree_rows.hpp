// KSL: symmetric matrices over joint coordinates whose zeros follow from the shape of the tree, by their non-zero elements.
//
// An element (i, j) of the mass matrix is zero unless one joint carries the other.  So row i is stored as the elements of its
// lower triangle in the columns of the joints on the path from the ground to i, in that order, i itself last.  The path of an
// ancestor is the beginning of the path of i.  Thus a row is combined with those of its ancestors element by element, without
// indices (Featherstone, RBDA (2008), section 6.5, stores the same elements in an array of nv × nv).
#pragma once

#include "ksl/engine/matrix_rows.hpp"
#include "ksl/engine/workspace.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// How many elements of a row precede that of coordinate c of body i: its place on the path.
template <class S> KSL_LANES index place_on_path(const body<S> &b, int c) { return b.ancestors + c; }

/// The rows in a workspace.  All begin at the same distance.  With plain numbers they are padded to whole registers, and what
/// lies beyond the last element may be overwritten.
template <class T> class tree_rows {
public:
  template <class S> KSL_LANES void lay_out(arena &memory, const model_view<S> &model) {
    pitch_ = is_number<T> ? padded(model.longest_path) : model.longest_path;
    first_ = memory.take<T>(static_cast<int>(pitch_) * model.nv);
  }
  KSL_LANES T *operator[](index row) const { return first_ + row * pitch_; }
  KSL_LANES index pitch() const { return pitch_; }

private:
  T *first_;
  index pitch_;
};

/// Calls step(column, place, n) for the joints on the path to body i, i included, from the last to the first: n neighbouring
/// columns of a matrix, and their place on the path.
template <class S, class Step> KSL_LANES void for_each_line(const model_view<S> &model, int i, Step step) {
  while (i > 0) {
    const body<S> &end = model.body[i], &start = model.body[end.line_start];
    step(index(start.v_index), index(start.ancestors), index(end.v_index + end.nv - start.v_index));
    i = start.parent;
  }
}

/// Calls step(b, i, row) for each row of the matrix, where i is the body whose joint has that coordinate.
template <class S, class Step> KSL_LANES void for_each_row(const model_view<S> &model, Step step) {
  for (int i = 1; i < model.bodies; ++i)
    for (int c = 0; c < model.body[i].nv; ++c)
      step(model.body[i], i, index(model.body[i].v_index + c), index(model.body[i].ancestors + c));
}

/// x[0 … n) −= a y[0 … n), in registers with plain numbers, where up to a register beyond may be written.
template <class T> KSL_LANES void subtract_scaled(const T &a, const T *y, T *x, index n) {
  if constexpr (is_number<T>) {
    using P = native_pack<T>;
    const P factor(a);
    for (index k = 0; k < n; k += native_lanes<T>) {
      P u, v;
      __builtin_memcpy(&u, y + k, sizeof(P));
      __builtin_memcpy(&v, x + k, sizeof(P));
      v = v - factor * u;
      __builtin_memcpy(x + k, &v, sizeof(P));
    }
  } else {
    for (index k = 0; k < n; ++k)
      x[k] = x[k] - a * y[k];
  }
}

/// Copies n numbers, and nothing beyond.
template <class T> KSL_LANES void copy_numbers(const T *from, T *to, index n) {
  if constexpr (is_number<T>)
    for (index k = 0; k < n; k += native_lanes<T>) {
      native_pack<T> x;
      __builtin_memcpy(&x, from + k, sizeof x); // within the padded row
      store_first<T>(x, to + k, static_cast<int>(n - k));
    }
  else
    for (index k = 0; k < n; ++k)
      to[k] = from[k];
}

/// The elements one after the other, row by row, without gaps: the lower triangle in compressed sparse rows.
template <class T>
void store_tree_rows(const model_view<scalar_of<T>> &model, const tree_rows<T> &rows, T *out) {
  for_each_row(model, [&](const auto &, int, index row, index place) KSL_INLINED {
    copy_numbers(rows[row], out, place + 1);
    out += place + 1;
  });
}

/// Both triangles of a matrix (nv, nv), zeros included.
template <class T>
void store_symmetric_rows(const model_view<scalar_of<T>> &model, const tree_rows<T> &rows, T *M) {
  const index n = model.nv;
  if (model.longest_path < n) // there are branches, and zeros
    clear_numbers(M, n * n);
  for_each_row(model, [&](const auto &, int i, index row, index) KSL_INLINED {
    const T *const from = rows[row];
    for_each_line(model, i, [&](index column, index place, index width) KSL_INLINED {
      const index end = column + width > row ? row + 1 - column : width; // of the own joint, only the lower triangle
      copy_numbers(from + place, M + row * n + column, end);
      for (index k = 0; k < end; ++k)
        M[(column + k) * n + row] = from[place + k];
    });
  });
}

/// The upper triangle of a matrix (nv, nv), zeros included.  The elements below it are left as they are.
template <class T>
void store_upper_rows(const model_view<scalar_of<T>> &model, const tree_rows<T> &rows, T *M) {
  const index n = model.nv;
  for (index row = 0; row < n && model.longest_path < n; ++row)
    clear_numbers(M + row * n + row, n - row);
  for_each_row(model, [&](const auto &, int i, index row, index) KSL_INLINED {
    const T *const from = rows[row];
    for_each_line(model, i, [&](index column, index place, index width) KSL_INLINED {
      const index end = column + width > row ? row + 1 - column : width;
      for (index k = 0; k < end; ++k)
        M[(column + k) * n + row] = from[place + k];
    });
  });
}

} // namespace KSL_ISA
} // namespace ksl
