// The short way from NumPy to a batch call, for arrays that need no conversion: of one precision, with equal leading shapes,
// rows of neighbouring numbers at one distance from each other, and finite numbers.  Whatever else comes in is left to
// ksl.model, which converts or refuses it.
#pragma once

#include "batch/threads.hpp"
#include "ksl/batch.hpp"

#include <nanobind/nanobind.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <new>
#include <optional>
#include <type_traits>
#include <utility>

namespace direct {

namespace nb = nanobind;

enum class use { read, write };

/// The memory of an array, while this lives: a row of `columns` numbers for each state.  None is no array.
class buffer {
public:
  /// axes: how many of the last ones make up a row, all equally long.
  buffer(nb::handle object, use what, int columns, int axes = 1)
      : columns_(columns), axes_(axes), none_(object.is_none()) {
    const int flags = PyBUF_FORMAT | (what == use::write ? PyBUF_C_CONTIGUOUS | PyBUF_WRITABLE : PyBUF_STRIDES);
    held_ = !none_ && PyObject_GetBuffer(object.ptr(), &view_, flags) == 0;
    if (!none_ && !held_)
      PyErr_Clear();
  }
  ~buffer() {
    if (held_)
      PyBuffer_Release(&view_);
  }
  buffer(const buffer &) = delete;
  buffer &operator=(const buffer &) = delete;

  bool none() const { return none_; }
  int columns() const { return columns_; }
  std::size_t states() const { return static_cast<std::size_t>(view_.len / view_.itemsize / columns_); }

  /// Does it hold numbers of type S in rows that the algorithms can read?
  template <class S> bool holds() const {
    constexpr char format = sizeof(S) == 8 ? 'd' : 'f';
    if (!held_ || view_.ndim < axes_ || !view_.format || view_.format[0] != format || view_.format[1] != 0 || view_.len == 0)
      return false;
    Py_ssize_t last = view_.shape[view_.ndim - 1]; // of a row with two axes: a square
    if (last * (axes_ == 2 ? view_.shape[view_.ndim - 2] : 1) != columns_ || (axes_ == 2 && last * last != columns_))
      return false;
    const auto distance = row_distance();
    return view_.strides[view_.ndim - 1] == view_.itemsize && distance &&
           *distance % static_cast<Py_ssize_t>(sizeof(S)) == 0 && reinterpret_cast<std::uintptr_t>(view_.buf) % alignof(S) == 0;
  }

  bool same_leading_shape(const buffer &other) const {
    const int leading = view_.ndim - axes_;
    if (leading != other.view_.ndim - other.axes_)
      return false;
    for (int i = 0; i < leading; ++i)
      if (view_.shape[i] != other.view_.shape[i])
        return false;
    return true;
  }

  bool apart_from(const buffer &other) const {
    const auto [begin, end] = extent();
    const auto [other_begin, other_end] = other.extent();
    return end <= other_begin || other_end <= begin;
  }

  /// Whether rows written here leave the rows of `other` alone that are still to be read: memory apart, or row on row.
  bool spares(const buffer &other) const {
    return apart_from(other) ||
           (view_.buf == other.view_.buf && columns_ == other.columns_ && row_distance() == other.row_distance());
  }

  template <class S> ksl::rows_view<S> rows() const {
    if (none_)
      return {};
    return {static_cast<S *>(view_.buf), *row_distance() / static_cast<Py_ssize_t>(sizeof(S))};
  }

private:
  /// Bytes from row to row; none where it is not always the same.
  std::optional<Py_ssize_t> row_distance() const {
    Py_ssize_t distance = columns_ * view_.itemsize, rows = 1;
    for (int i = view_.ndim - axes_ - 1; i >= 0; --i) {
      if (view_.shape[i] == 1)
        continue;
      if (rows == 1)
        distance = view_.strides[i];
      else if (view_.strides[i] != rows * distance)
        return {};
      rows *= view_.shape[i];
    }
    return distance;
  }

  /// From its first byte in memory to behind its last.
  std::pair<const char *, const char *> extent() const {
    const char *const first = static_cast<const char *>(view_.buf);
    const Py_ssize_t to_last = *row_distance() * static_cast<Py_ssize_t>(states() - 1), row = columns_ * view_.itemsize;
    return {to_last < 0 ? first + to_last : first, (to_last < 0 ? first : first + to_last) + row};
  }

  Py_buffer view_{};
  int columns_, axes_;
  bool none_, held_ = false;
};

/// No NaN and nothing infinite.  Exponents of ones overflow into the sign: sums of doubles would wait for each other.  Eight
/// at once, since gcc makes no more than one register of a plain loop.
template <class S> bool finite(const S *x, std::size_t n) {
  using bits = std::conditional_t<sizeof(S) == 8, std::uint64_t, std::uint32_t>;
  constexpr bits exponent = sizeof(S) == 8 ? static_cast<bits>(0x7ff0'0000'0000'0000) : static_cast<bits>(0x7f80'0000);
  constexpr bits lowest = exponent & (~exponent + 1);
  const auto sign_if_not = [](const S *number) {
    bits b;
    std::memcpy(&b, number, sizeof b);
    return (b & exponent) + lowest;
  };
  bits found[8] = {};
  std::size_t i = 0;
  for (; i + 8 <= n; i += 8)
    for (std::size_t k = 0; k < 8; ++k)
      found[k] |= sign_if_not(x + i + k);
  for (; i < n; ++i)
    found[0] |= sign_if_not(x + i);
  bits any = 0;
  for (bits f : found)
    any |= f;
  return !(any >> (8 * sizeof(S) - 1));
}

/// n rows; none at all are no numbers.
template <class S> bool finite(ksl::rows_view<const S> rows, int columns, std::size_t n) {
  if (!rows.first)
    return true;
  if (rows.stride == columns)
    return finite(rows.first, n * static_cast<std::size_t>(columns));
  for (std::size_t k = 0; k < n; ++k)
    if (!finite(row(rows, k), static_cast<std::size_t>(columns)))
      return false;
  return true;
}

/// Whether all quaternions are surely within ksl.model.QUATERNION_TOLERANCE; that decides where this says no.
template <class S> bool unit_quaternions(const ksl::model &m, ksl::rows_view<const S> q, std::size_t n) {
  S worst = 0;
  for (int j = 0; j < m.moving_joints() && m.nq() != m.nv(); ++j) {
    const ksl::joint_row &joint = m.joints()[static_cast<std::size_t>(j)];
    if (joint.kind != ksl::joint_kind::floating)
      continue;
    for (std::size_t k = 0; k < n; ++k) {
      const S *x = row(q, k) + joint.q_index + 3;
      const S error = std::abs(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3] - 1);
      worst = error > worst ? error : worst;
    }
  }
  return worst < S(1.9e-3); // of the square
}

/// Whether the numbers are those of states.
template <class S> bool acceptable(const ksl::model &m, const ksl::batch_view<S> &batch) {
  return finite(batch.q, m.nq(), batch.n) && finite(batch.v, m.nv(), batch.n) && finite(batch.a, m.nv(), batch.n) &&
         unit_quaternions(m, batch.q, batch.n);
}

constexpr std::size_t near = 64 << 10; ///< bytes of arguments that the inner caches keep beside a workspace

/// Calls step(part) for all parts of a batch, some states each, on several threads, until one says no.
template <class S, class Step>
bool for_parts(const ksl::model &m, const ksl::batch_view<S> &batch, int threads, Step step) {
  const std::size_t bytes = sizeof(S) * static_cast<std::size_t>(m.nq() + 2 * m.nv());
  const std::size_t some = (1 + near / 64 / bytes) * 64;
  std::atomic<bool> well{true}, no_memory{false};
  const ksl::partition parts(batch.n, some, ksl::least_states(m.moving_joints()), threads);
  ksl::on_threads(parts, [&](std::size_t first, std::size_t end, std::size_t) {
    for (std::size_t k = first; k < end && well.load(std::memory_order_relaxed); k += some) {
      ksl::batch_view<S> part = batch;
      part.n = end - k < some ? end - k : some;
      part.q = rows_from(batch.q, k);
      part.v = rows_from(batch.v, k);
      part.a = part.tau = rows_from(batch.a, k);
      part.out = rows_from(batch.out, k);
      try {
        if (!step(part))
          well.store(false, std::memory_order_relaxed);
      } catch (const std::bad_alloc &) { // may not leave a thread
        no_memory.store(true);
        well.store(false);
      }
    }
  });
  if (no_memory.load())
    throw std::bad_alloc();
  return well.load();
}

constexpr std::size_t states_worth_releasing = 32; ///< the interpreter's lock, which takes 50 ns

/// Checks each part right before it is computed, while its numbers are near: one pass over memory instead of two.  Where the
/// result takes an argument's place, all are checked first: ksl.model must find what was wrong.
template <class S, class Algorithm>
bool checked(const ksl::model &m, const ksl::batch_view<S> &batch, bool in_place, int threads, Algorithm algorithm) {
  const auto check = [&](const ksl::batch_view<S> &part) { return acceptable(m, part); };
  const auto compute = [&](const ksl::batch_view<S> &part) { return algorithm(part), true; };
  if (in_place)
    return for_parts(m, batch, threads, check) && for_parts(m, batch, threads, compute);
  return for_parts(m, batch, threads, [&](const ksl::batch_view<S> &part) { return check(part) && compute(part); });
}

/// out = algorithm(q, v, x) for states of one precision; false where the arrays or numbers are not of that kind, and then
/// `out` may be written in part.
template <class S, class Algorithm>
bool run(const ksl::model &m, const buffer &q, const buffer &v, const buffer &x, const buffer &out, int threads,
         Algorithm algorithm) {
  if (m.nv() == 0 || !out.holds<S>())
    return false;
  bool in_place = false;
  for (const buffer *in : {&q, &v, &x}) {
    if (in->none())
      continue;
    if (!in->holds<S>() || !in->same_leading_shape(out) || !out.spares(*in))
      return false;
    in_place = in_place || !out.apart_from(*in);
  }
  ksl::batch_view<S> batch;
  batch.n = q.states();
  batch.q = q.rows<const S>();
  batch.v = v.rows<const S>();
  batch.a = batch.tau = x.rows<const S>();
  batch.out = out.rows<S>();
  std::optional<nb::gil_scoped_release> release;
  if (batch.n >= states_worth_releasing)
    release.emplace();
  return checked(m, batch, in_place, threads, algorithm);
}

template <class Algorithm>
bool in_either_precision(const ksl::model &m, nb::handle q, nb::handle v, nb::handle x, const buffer &out, int threads,
                         Algorithm algorithm) {
  const buffer in[] = {{q, use::read, m.nq()}, {v, use::read, m.nv()}, {x, use::read, m.nv()}};
  return run<double>(m, in[0], in[1], in[2], out, threads, algorithm) ||
         run<float>(m, in[0], in[1], in[2], out, threads, algorithm);
}

/// v and a may be None: zero.
inline bool inverse_dynamics(const ksl::model &m, nb::handle q, nb::handle v, nb::handle a, nb::handle tau, int threads) {
  return in_either_precision(m, q, v, a, {tau, use::write, m.nv()}, threads,
                             [&](const auto &batch) { ksl::inverse_dynamics_batch(m, batch, {}, 1); });
}

inline bool forward_dynamics(const ksl::model &m, nb::handle q, nb::handle v, nb::handle tau, nb::handle a, int threads) {
  return in_either_precision(m, q, v, tau, {a, use::write, m.nv()}, threads,
                             [&](const auto &batch) { ksl::forward_dynamics_batch(m, batch, 1); });
}

inline bool mass_matrix(const ksl::model &m, nb::handle q, nb::handle out, int threads) {
  return in_either_precision(m, q, nb::none(), nb::none(), {out, use::write, m.nv() * m.nv(), 2}, threads,
                             [&](const auto &batch) { ksl::mass_matrix_batch(m, batch, 1); });
}

} // namespace direct
