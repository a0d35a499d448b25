// Access to NumPy arrays as rows of numbers, one row for each state.
#pragma once

#define NPY_NO_DEPRECATED_API NPY_1_23_API_VERSION
#define NPY_TARGET_VERSION NPY_1_23_API_VERSION
#include <nanobind/nanobind.h>

#include <numpy/ndarrayobject.h>

#include "ksl/engine/algorithms/batch_view.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

namespace nb = nanobind;

template <class S> constexpr int numpy_type = sizeof(S) == sizeof(double) ? NPY_DOUBLE : NPY_FLOAT;

/// (3, 4), as Python writes it.
inline std::string text_of(const npy_intp *shape, int axes) {
  std::string text = "(";
  for (int i = 0; i < axes; ++i)
    text += std::to_string(shape[i]) + (i + 1 < axes ? ", " : axes == 1 ? "," : "");
  return text + ")";
}

/// A leading shape: the axes over states.  There is room for as many axes as NumPy allows; only the first `axes` lengths are
/// initialised and copied, since a call makes many of these.
struct leading_shape {
  int axes = 0;
  npy_intp length[NPY_MAXDIMS + 4]; // 4 more for the axes of a result

  leading_shape() = default;
  leading_shape(const npy_intp *lengths, int n) : axes(n) { std::copy_n(lengths, n, length); }
  leading_shape(const leading_shape &other) : leading_shape(other.length, other.axes) {}
  // NOLINTNEXTLINE(bugprone-unhandled-self-assignment,cert-oop54-cpp): numbers that are copied onto themselves stay what they are
  leading_shape &operator=(const leading_shape &other) {
    axes = other.axes;
    std::copy_n(other.length, axes, length);
    return *this;
  }

  npy_intp states() const {
    npy_intp n = 1;
    for (int i = 0; i < axes; ++i)
      n *= length[i];
    return n;
  }
  /// The index of state k as text, "1, 2, "; empty if there are no leading axes.
  std::string index_of(npy_intp k) const {
    std::string text;
    for (int i = axes - 1; i >= 0; k /= length[i--])
      text = std::to_string(k % length[i]) + ", " + text;
    return text;
  }
  /// Broadcasts as NumPy does; false if the shapes don't fit.
  bool broadcast(const leading_shape &other) {
    leading_shape both;
    both.axes = std::max(axes, other.axes);
    for (int i = 1; i <= both.axes; ++i) {
      const npy_intp a = i <= axes ? length[axes - i] : 1, b = i <= other.axes ? other.length[other.axes - i] : 1;
      if (a != b && a != 1 && b != 1)
        return false;
      both.length[both.axes - i] = a == 1 ? b : a;
    }
    *this = both;
    return true;
  }
};

/// A view of an array, which must outlive it.  The last row_axes axes are a row of `columns` numbers; the axes before them run
/// over states.  Or no array (None).
class row_array {
public:
  row_array() = default;
  row_array(PyArrayObject *array, int columns, int row_axes) : array_(array), columns_(columns), row_axes_(row_axes) {}
  row_array(nb::handle array, int columns, int row_axes) // or None
      : row_array(array.is_none() ? nullptr : reinterpret_cast<PyArrayObject *>(array.ptr()), columns, row_axes) {}

  bool none() const { return !array_; }
  int columns() const { return columns_; }
  int axes() const { return PyArray_NDIM(array_); }
  npy_intp length(int axis) const { return PyArray_DIM(array_, axis); }
  char kind() const { return PyArray_DESCR(array_)->kind; }
  std::string shape() const { return text_of(PyArray_DIMS(array_), axes()); }
  std::string type() const { return nb::str(nb::handle(reinterpret_cast<PyObject *>(PyArray_DESCR(array_)))).c_str(); }

  leading_shape leading() const { return {PyArray_DIMS(array_), axes() - row_axes_}; }
  bool has_leading(const leading_shape &shape) const {
    return axes() - row_axes_ == shape.axes &&
           std::equal(shape.length, shape.length + shape.axes, PyArray_DIMS(array_));
  }

  /// Can the array be read as it is?  Its numbers must be of type S, aligned and in native byte order, rows contiguous, and the
  /// distance between rows constant.
  template <class S> bool readable() const {
    if (PyArray_TYPE(array_) != numpy_type<S> || !PyArray_ISBEHAVED_RO(array_))
      return false;
    const bool neighbours = row_axes_ == 0 || columns_ < 2 ||
                            PyArray_STRIDE(array_, axes() - 1) == static_cast<npy_intp>(sizeof(S)) ||
                            PyArray_SIZE(array_) == 0; // then NumPy may give any strides
    const auto distance = row_distance();
    return neighbours && distance && *distance % static_cast<npy_intp>(sizeof(S)) == 0;
  }

  template <class S> ksl::rows_view<S> rows() const {
    if (none())
      return {};
    return {static_cast<S *>(PyArray_DATA(array_)), *row_distance() / static_cast<std::ptrdiff_t>(sizeof(S))};
  }

  bool apart_from(const row_array &other) const {
    const auto [begin, end] = extent();
    const auto [other_begin, other_end] = other.extent();
    return end <= other_begin || other_end <= begin;
  }

  /// Whether writing rows here does not overwrite rows of `other` that are still to be read.  So it is if their memory doesn't
  /// overlap, or if each row lies exactly on the row of the same state.
  bool spares(const row_array &other) const {
    return apart_from(other) || (PyArray_DATA(array_) == PyArray_DATA(other.array_) && columns_ == other.columns_ &&
                                 row_distance() == other.row_distance());
  }

private:
  /// Distance between rows in bytes; empty if it is not constant.
  std::optional<npy_intp> row_distance() const {
    npy_intp distance = columns_ * PyArray_ITEMSIZE(array_), rows = 1;
    for (int i = axes() - row_axes_ - 1; i >= 0; --i) {
      if (length(i) == 1)
        continue;
      if (length(i) == 0)
        return columns_ * PyArray_ITEMSIZE(array_);
      if (rows == 1)
        distance = PyArray_STRIDE(array_, i);
      else if (PyArray_STRIDE(array_, i) != rows * distance)
        return {};
      rows *= length(i);
    }
    return distance;
  }

  /// The range of memory that the array occupies, [first byte, one past the last); empty for no numbers.
  std::pair<const char *, const char *> extent() const {
    const char *const first = PyArray_BYTES(array_);
    const npy_intp states = leading().states(), row = columns_ * PyArray_ITEMSIZE(array_);
    if (states == 0 || row == 0)
      return {first, first};
    const npy_intp to_last = *row_distance() * (states - 1);
    return {to_last < 0 ? first + to_last : first, (to_last < 0 ? first : first + to_last) + row};
  }

  PyArrayObject *array_ = nullptr;
  int columns_ = 0, row_axes_ = 0;
};
