// The short way from NumPy to a batch call, for arrays that need no conversion: of one precision, with equal leading shapes,
// rows of neighbouring numbers at one distance from each other, and finite numbers; external wrenches in a dict.  Whatever
// else comes in is left to ksl.model, which converts or refuses it.
#pragma once

#include "batch/threads.hpp"
#include "engine/kernels.hpp"
#include "ksl/batch.hpp"
#include "without_gil.hpp"

#include <nanobind/nanobind.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <list>
#include <new>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace direct {

namespace nb = nanobind;

enum class use { read, write };

/// What an array holds for each state: a number, a vector, a matrix or several of them, in so many of its last axes.
struct row_shape {
  int axes = 0, length[3] = {1, 1, 1};

  row_shape() = default;
  row_shape(int n) : axes(1), length{n, 1, 1} {}
  row_shape(int rows, int columns) : axes(2), length{rows, columns, 1} {}
  row_shape(int matrices, int rows, int columns) : axes(3), length{matrices, rows, columns} {}
  int numbers() const { return length[0] * length[1] * length[2]; }
};

/// The memory of an array, while this lives: a row of numbers for each state.  None is no array.
class buffer {
public:
  buffer(nb::handle object, use what, row_shape shape)
      : shape_(shape), columns_(shape.numbers()), axes_(shape.axes), none_(object.is_none()) {
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
    for (int i = 0; i < axes_; ++i)
      if (view_.shape[view_.ndim - axes_ + i] != shape_.length[i])
        return false;
    const auto distance = row_distance();
    return (axes_ == 0 || view_.strides[view_.ndim - 1] == view_.itemsize) && distance &&
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
  row_shape shape_;
  int columns_, axes_;
  bool none_, held_ = false;
};

/// External wrenches as users give them, {link name: (…, 6)}, while this lives.  None is no wrench.
class wrenches {
public:
  wrenches(const ksl::model &m, nb::handle by_link) : known_(by_link.is_none()) {
    if (!PyDict_CheckExact(by_link.ptr())) // its heirs may show other items than they hold
      return;
    const nb::list items = nb::steal<nb::list>(PyDict_Items(by_link.ptr())); // a buffer's code may change the dict
    if (!items.is_valid())
      nb::raise_python_error();
    for (nb::handle item : items) {
      const int link = index_of(m, PyTuple_GET_ITEM(item.ptr(), 0));
      if (link < 0)
        return;
      links_.push_back(link);
      buffers_.emplace_back(nb::handle(PyTuple_GET_ITEM(item.ptr(), 1)), use::read, 6);
    }
    known_ = true;
  }

  /// Can the algorithms read them, while they write to `out`?
  template <class S> bool hold(const buffer &out) const {
    for (const buffer &b : buffers_)
      if (!b.holds<S>() || !b.same_leading_shape(out) || !b.apart_from(out))
        return false;
    return known_;
  }

  /// Those of the states [first, first + part.n), side by side in `memory`, into the part.
  template <class S> void into(ksl::batch_view<S> &part, std::size_t first, std::vector<S> &memory) const {
    if (links_.empty())
      return;
    const std::size_t width = 6 * links_.size();
    memory.resize(part.n * width);
    S *to = memory.data();
    for (const buffer &b : buffers_) {
      const ksl::rows_view<const S> from = rows_from(b.rows<const S>(), first);
      for (std::size_t k = 0; k < part.n; ++k)
        std::memcpy(to + k * width, row(from, k), 6 * sizeof(S));
      to += 6;
    }
    part.external_n = static_cast<int>(links_.size());
    part.external_link = links_.data();
    part.external = {memory.data(), static_cast<std::ptrdiff_t>(width)};
  }

private:
  /// −1: no link's name.
  static int index_of(const ksl::model &m, PyObject *name) {
    Py_ssize_t size = 0;
    const char *const text = PyUnicode_CheckExact(name) ? PyUnicode_AsUTF8AndSize(name, &size) : nullptr;
    if (!text)
      PyErr_Clear();
    return text ? m.find_link(std::string(text, static_cast<std::size_t>(size))) : -1;
  }

  std::vector<int> links_;
  std::list<buffer> buffers_; // they stay where they are
  bool known_;
};

/// Of one call: x is a or tau.
struct arguments {
  buffer q, v, x;
  wrenches external;

  arguments(const ksl::model &m, nb::handle q, nb::handle v, nb::handle x, nb::handle external)
      : q(q, use::read, m.nq()), v(v, use::read, m.nv()), x(x, use::read, m.nv()), external(m, external) {}
};

/// No NaN and nothing infinite.
inline bool finite(const double *x, std::size_t n) { return ksl::kernels().finite(x, n); }
inline bool finite(const float *x, std::size_t n) { return ksl::kernels().finite_single(x, n); }

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
    const int quaternion = ksl::row_of(joint.kind).quaternion;
    if (quaternion < 0)
      continue;
    for (std::size_t k = 0; k < n; ++k) {
      const S *x = row(q, k) + joint.q_index + quaternion;
      const S error = std::abs(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3] - 1);
      worst = error > worst ? error : worst;
    }
  }
  return worst < S(1.9e-3); // of the square
}

/// Whether the numbers are those of states.
template <class S> bool acceptable(const ksl::model &m, const ksl::batch_view<S> &batch) {
  return finite(batch.q, m.nq(), batch.n) && finite(batch.v, m.nv(), batch.n) && finite(batch.a, m.nv(), batch.n) &&
         finite(batch.external, 6 * batch.external_n, batch.n) && unit_quaternions(m, batch.q, batch.n);
}

constexpr std::size_t near = 64 << 10; ///< bytes of arguments that the inner caches keep beside a workspace

/// Calls step(part) for all parts of a batch, some states each, on several threads, until one says no.
template <class S, class Step>
bool for_parts(const ksl::model &m, const ksl::batch_view<S> &batch, const wrenches &external, int threads, Step step) {
  const std::size_t bytes = sizeof(S) * static_cast<std::size_t>(m.nq() + 2 * m.nv());
  const std::size_t some = (1 + near / 64 / bytes) * 64;
  std::atomic<bool> well{true}, no_memory{false};
  const ksl::partition parts(batch.n, some, ksl::least_states(m.moving_joints()), threads);
  ksl::on_threads(parts, [&](std::size_t first, std::size_t end, std::size_t) {
    std::vector<S> memory;
    for (std::size_t k = first; k < end && well.load(std::memory_order_relaxed); k += some) {
      ksl::batch_view<S> part = batch;
      part.n = end - k < some ? end - k : some;
      part.q = rows_from(batch.q, k);
      part.v = rows_from(batch.v, k);
      part.a = part.tau = rows_from(batch.a, k);
      part.out = rows_from(batch.out, k);
      try {
        external.into(part, k, memory);
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
bool checked(const ksl::model &m, const ksl::batch_view<S> &batch, const wrenches &external, bool in_place, int threads,
             Algorithm algorithm) {
  const auto check = [&](const ksl::batch_view<S> &part) { return acceptable(m, part); };
  const auto compute = [&](const ksl::batch_view<S> &part) { return algorithm(part), true; };
  if (in_place)
    return for_parts(m, batch, external, threads, check) && for_parts(m, batch, external, threads, compute);
  return for_parts(m, batch, external, threads, [&](const ksl::batch_view<S> &part) { return check(part) && compute(part); });
}

/// out = algorithm(arguments) for states of one precision; false where the arrays or numbers are not of that kind, and then
/// `out` may be written in part.
template <class S, class Algorithm>
bool run(const ksl::model &m, const arguments &in, const buffer &out, int threads, Algorithm algorithm) {
  if (m.nv() == 0 || !out.holds<S>() || !in.external.hold<S>(out))
    return false;
  bool in_place = false;
  for (const buffer *x : {&in.q, &in.v, &in.x}) {
    if (x->none())
      continue;
    if (!x->holds<S>() || !x->same_leading_shape(out) || !out.spares(*x))
      return false;
    in_place = in_place || !out.apart_from(*x);
  }
  ksl::instruction_set(); // refuses an unusable KSL_ISA here, and not on another thread
  ksl::batch_view<S> batch;
  batch.n = in.q.states();
  batch.q = in.q.rows<const S>();
  batch.v = in.v.rows<const S>();
  batch.a = batch.tau = in.x.rows<const S>();
  batch.out = out.rows<S>();
  std::optional<without_gil> released;
  if (batch.n >= states_worth_releasing)
    released.emplace();
  return checked(m, batch, in.external, in_place, threads, algorithm);
}

template <class Algorithm>
bool in_either_precision(const ksl::model &m, const arguments &in, const buffer &out, int threads, Algorithm algorithm) {
  return run<double>(m, in, out, threads, algorithm) || run<float>(m, in, out, threads, algorithm);
}

/// v and a may be None: zero.
inline bool inverse_dynamics(const ksl::model &m, nb::handle q, nb::handle v, nb::handle a, nb::handle external,
                             nb::handle tau, int threads) {
  return in_either_precision(m, {m, q, v, a, external}, {tau, use::write, m.nv()}, threads,
                             [&](const auto &batch) { ksl::inverse_dynamics_batch(m, batch, {}, 1); });
}

/// out: (…, request.n, 6).
inline bool reactions(const ksl::model &m, nb::handle q, nb::handle v, nb::handle a, nb::handle external,
                      const ksl::reaction_request &request, nb::handle out, int threads) {
  return in_either_precision(m, {m, q, v, a, external}, {out, use::write, {request.n, 6}}, threads,
                             [&]<class S>(ksl::batch_view<S> batch) {
                               const ksl::reaction_rows<S> wanted{request, std::exchange(batch.out, {})};
                               ksl::inverse_dynamics_batch(m, batch, {wanted}, 1);
                             });
}

inline bool forward_dynamics(const ksl::model &m, nb::handle q, nb::handle v, nb::handle tau, nb::handle external,
                             nb::handle a, int threads) {
  return in_either_precision(m, {m, q, v, tau, external}, {a, use::write, m.nv()}, threads,
                             [&](const auto &batch) { ksl::forward_dynamics_batch(m, batch, 1); });
}

inline bool mass_matrix(const ksl::model &m, nb::handle q, nb::handle out, int threads) {
  return in_either_precision(m, {m, q, nb::none(), nb::none(), nb::none()}, {out, use::write, {m.nv(), m.nv()}}, threads,
                             [&](const auto &batch) { ksl::mass_matrix_batch(m, batch, 1); });
}

/// out: (…, 4, 4).
inline bool frame_pose(const ksl::model &m, nb::handle q, int link, nb::handle out, int threads) {
  return in_either_precision(m, {m, q, nb::none(), nb::none(), nb::none()}, {out, use::write, {4, 4}}, threads,
                             [&](const auto &batch) { ksl::frame_poses_batch(m, batch, 1, &link, 1); });
}

/// out: (…, links, 4, 4).
inline bool frame_poses(const ksl::model &m, nb::handle q, const std::vector<int> &links, nb::handle out, int threads) {
  const int n = static_cast<int>(links.size());
  if (n == 0) // rows of no numbers are no rows
    return false;
  return in_either_precision(m, {m, q, nb::none(), nb::none(), nb::none()}, {out, use::write, {n, 4, 4}}, threads,
                             [&](const auto &batch) { ksl::frame_poses_batch(m, batch, n, links.data(), 1); });
}

/// The potential energies go where no other array lies.
template <class S>
bool energy_in_precision(const ksl::model &m, const arguments &in, const buffer &kinetic, const buffer &potential, int threads) {
  for (const buffer *x : {&kinetic, &in.q, &in.v})
    if (!potential.holds<S>() || !x->holds<S>() || !potential.apart_from(*x))
      return false;
  return potential.same_leading_shape(kinetic) && run<S>(m, in, kinetic, threads, [&](const ksl::batch_view<S> &batch) {
    const std::ptrdiff_t first = batch.out.first - kinetic.rows<S>().first;
    ksl::energy_batch<S>(m, batch, batch.out, {potential.rows<S>().first + first, 1}, 1);
  });
}

inline bool energy(const ksl::model &m, nb::handle q, nb::handle v, nb::handle kinetic, nb::handle potential, int threads) {
  const arguments in{m, q, v, nb::none(), nb::none()};
  const buffer out[] = {{kinetic, use::write, row_shape()}, {potential, use::write, row_shape()}};
  return energy_in_precision<double>(m, in, out[0], out[1], threads) || energy_in_precision<float>(m, in, out[0], out[1], threads);
}

} // namespace direct
