// KSL: symmetric matrices over joint coordinates, of which only those elements are stored that the shape of the tree lets differ from
// zero.
//
// Element (i, j) of the mass matrix is zero unless one of the joints carries the other.  So row i is stored as its elements in the
// columns on the path from the ground to i, in that order, i itself last.  An element's index in this list is its *place*.  The path
// of an ancestor is the beginning of the path of i: an element has the same place in both rows, and a row is combined with those of
// its ancestors element by element, without a list of indices.  (Featherstone, RBDA (2008), section 6.5, has the same elements in an
// array of nv × nv.)
#pragma once

#include "ksl/engine/lanes/workspace.hpp"
#include "ksl/engine/model/model.hpp"
#include "ksl/engine/steps/symmetric_matrix.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Such rows in a workspace, at equal distances.  With plain numbers they are padded to whole registers, and the padding may be
/// overwritten.
template <class T> class tree_rows {
public:
  template <class S> KSL_LANES void lay_out(arena &memory, const model_view<S> &model) {
    pitch_ = is_number<T> ? padded(model.longest_path) : model.longest_path;
    first_ = memory.take<T>(static_cast<int>(pitch_) * model.nv);
  }
  KSL_LANES T *operator[](index row) const { return first_ + row * pitch_; }

  KSL_LANES void set(index, index place, index row, const T &x) const { first_[row * pitch_ + place] = x; }
  KSL_LANES void clear(index, index, index) const {}
  /// Writes zeros to `rows` rows of plain numbers.  Numbers that happen to be in the padding can be subnormal, and then slow down
  /// arithmetic with the other lanes.
  KSL_LANES void clear_padding(index rows) const {
    if constexpr (is_number<T>)
      for (index k = 0; k < rows * pitch_; k += native_lanes<T>)
        body_lanes::write(native_pack<T>(T(0)), first_ + k);
  }

private:
  T *first_;
  index pitch_;
};

/// The elements that tree_rows has, one after the other, row by row, without gaps: the lower triangle in compressed sparse rows.
template <class T> class compressed_rows {
public:
  compressed_rows(const model_view<scalar_of<T>> &model, T *first) : first_(first), row_(model.tree_row) {}
  KSL_LANES void set(index, index place, index row, const T &x) const { first_[row_[row] + place] = x; }
  KSL_LANES void clear(index, index, index) const {}

private:
  T *first_;
  const int *row_; ///< where each row begins
};

/// Calls step(body, row, place) for each row of the matrix, from the first to the last; place is that of its diagonal element.
template <class S, class Step> KSL_LANES void for_each_row(const model_view<S> &model, Step step) {
  for (int i = 1; i < model.bodies; ++i)
    for (int c = 0; c < model.body[i].nv; ++c)
      step(model.body[i], index(model.body[i].v_index + c), index(model.body[i].ancestors + c));
}

/// Calls step(ancestor, place) for the coordinates on the path from coordinate c of body i to the ground, that coordinate itself left
/// out.  It goes line by line (model.hpp): within a line, coordinates and places descend by one.
template <class S, class Step> KSL_LANES void for_each_ancestor(const model_view<S> &model, int i, int c, Step step) {
  while (i > 0) {
    const body<S> &b = model.body[i], &start = model.body[b.line_start];
    index place = b.ancestors + c - 1;
    for (index column = b.v_index + c - 1; column >= start.v_index; --column, --place)
      step(column, place);
    i = start.parent;
    c = model.body[i].nv;
  }
}

/// x[0 … n) −= a y[0 … n).  Plain numbers are computed in registers, so that up to a register of numbers from x[n] on may be
/// overwritten.
template <class T> KSL_LANES void subtract_scaled(const T &a, const T *y, T *x, index n) {
  if constexpr (is_number<T>) {
    using P = native_pack<T>;
    const P factor(a);
    for (index k = 0; k < n; k += native_lanes<T>) {
      P u, v;
      body_lanes::read(y + k, u);
      body_lanes::read(x + k, v);
      body_lanes::write(v - factor * u, x + k);
    }
  } else {
    for (index k = 0; k < n; ++k)
      x[k] = x[k] - a * y[k];
  }
}

/// x[0 … n) *= a, likewise.
template <class T> KSL_LANES void scale(const T &a, T *x, index n) {
  if constexpr (is_number<T>) {
    using P = native_pack<T>;
    const P factor(a);
    for (index k = 0; k < n; k += native_lanes<T>) {
      P v;
      body_lanes::read(x + k, v);
      body_lanes::write(factor * v, x + k);
    }
  } else {
    for (index k = 0; k < n; ++k)
      x[k] = a * x[k];
  }
}

/// A square matrix in a workspace, whose rows are padded to whole registers.
template <class T> class padded_matrix {
public:
  KSL_LANES void lay_out(arena &memory, int n) {
    n_ = n, pitch_ = padded(n);
    first_ = memory.take<T>(n * padded(n));
  }
  KSL_LANES T *operator[](index row) const { return first_ + row * pitch_; }
  KSL_LANES index pitch() const { return pitch_; }

  /// Copies the matrix to one without gaps.
  KSL_LANES void store(T *to) const {
    for (index row = 0; row < n_; ++row)
      for (index k = 0; k < n_; k += native_lanes<T>) {
        native_pack<T> x;
        body_lanes::read(first_ + row * pitch_ + k, x);
        store_first<T>(x, to + row * n_ + k, static_cast<int>(n_ - k));
      }
  }

private:
  T *first_;
  index n_, pitch_;
};

/// x[k] = a, by a store of the whole register.  A reload of the register then doesn't have to wait for the store.
template <class T> KSL_LANES void set_lane(T *x, index k, const T &a) {
  using P = native_pack<T>;
  const index block = k / native_lanes<T> * native_lanes<T>;
  P v, number;
  for (int i = 0; i < native_lanes<T>; ++i)
    number.set(i, T(i));
  body_lanes::read(x + block, v);
  body_lanes::write(math<P>::select(number == P(T(k - block)), P(a), v), x + block);
}

/// Copies the rows to an array without gaps: the lower triangle in compressed sparse rows.
template <class T> void store_tree_rows(const model_view<scalar_of<T>> &model, const tree_rows<T> &rows, T *out) {
  for_each_row(model, [&](const auto &, index row, index place) KSL_INLINED {
    for (index k = 0; k <= place; ++k)
      *out++ = rows[row][k];
  });
}

} // namespace KSL_ISA
} // namespace ksl
