// The short way from NumPy to a batch call, for arrays that need no conversion: contiguous, of one precision, with equal
// leading shapes and finite numbers.  Whatever else comes in is left to ksl.model, which converts or refuses it.
#pragma once

#include "ksl/batch.hpp"

#include <nanobind/nanobind.h>

#include <cmath>

namespace direct {

namespace nb = nanobind;

/// A C-contiguous buffer of an object, while this lives.
class buffer {
public:
  buffer(nb::handle object, bool writeable) {
    const int flags = PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | (writeable ? PyBUF_WRITABLE : 0);
    held_ = PyObject_GetBuffer(object.ptr(), &view_, flags) == 0;
    if (!held_)
      PyErr_Clear();
  }
  ~buffer() {
    if (held_)
      PyBuffer_Release(&view_);
  }
  buffer(const buffer &) = delete;
  buffer &operator=(const buffer &) = delete;

  /// Does it hold rows of `width` numbers of type S?
  template <class S> bool holds(int width) const {
    constexpr char format = sizeof(S) == 8 ? 'd' : 'f';
    return held_ && view_.ndim > 0 && view_.format && view_.format[0] == format && view_.format[1] == 0 &&
           view_.shape[view_.ndim - 1] == width;
  }
  bool same_leading_shape(const buffer &other) const {
    if (view_.ndim != other.view_.ndim)
      return false;
    for (int i = 0; i + 1 < view_.ndim; ++i)
      if (view_.shape[i] != other.view_.shape[i])
        return false;
    return true;
  }
  template <class S> S *numbers() const { return static_cast<S *>(view_.buf); }
  std::size_t count() const { return static_cast<std::size_t>(view_.len / view_.itemsize); }

  template <class S> bool finite() const {
    S sum = 0; // a NaN or an infinity times zero is NaN
    const S *x = numbers<S>();
    for (std::size_t i = 0; i < count(); ++i)
      sum += x[i] * S(0);
    return sum == 0;
  }

private:
  Py_buffer view_{};
  bool held_ = false;
};

constexpr std::size_t states_worth_releasing = 32; ///< the interpreter's lock, which takes 50 ns

template <class Call> void without_lock(std::size_t n, Call call) {
  if (n < states_worth_releasing) {
    call();
  } else {
    nb::gil_scoped_release release;
    call();
  }
}

inline bool has_floating_joint(const ksl::model &m) { return m.nq() != m.nv(); }

/// out = algorithm(q, v, x) for states of one precision; false where the arrays are not of that kind.
template <class S, class Algorithm>
bool run(const ksl::model &m, const buffer &q, const buffer &v, const buffer &x, const buffer &out, Algorithm algorithm) {
  const int nv = m.nv();
  if (nv == 0 || has_floating_joint(m) || !q.holds<S>(m.nq()) || !v.holds<S>(nv) || !x.holds<S>(nv) || !out.holds<S>(nv) ||
      !q.same_leading_shape(v) || !q.same_leading_shape(x) || !q.same_leading_shape(out))
    return false;
  if (!q.finite<S>() || !v.finite<S>() || !x.finite<S>())
    return false;
  ksl::batch_view<S> batch;
  batch.n = v.count() / static_cast<std::size_t>(nv);
  batch.q = {q.numbers<const S>(), m.nq()};
  batch.v = {v.numbers<const S>(), nv};
  batch.a = batch.tau = {x.numbers<const S>(), nv};
  batch.out = {out.numbers<S>(), nv};
  without_lock(batch.n, [&] { algorithm(batch); });
  return true;
}

inline bool inverse_dynamics(const ksl::model &m, nb::handle q, nb::handle v, nb::handle a, nb::handle tau, int threads) {
  const buffer bq(q, false), bv(v, false), ba(a, false), out(tau, true);
  const auto algorithm = [&](const auto &batch) { ksl::inverse_dynamics_batch(m, batch, {}, threads); };
  return run<double>(m, bq, bv, ba, out, algorithm) || run<float>(m, bq, bv, ba, out, algorithm);
}

inline bool forward_dynamics(const ksl::model &m, nb::handle q, nb::handle v, nb::handle tau, nb::handle a, int threads) {
  const buffer bq(q, false), bv(v, false), bt(tau, false), out(a, true);
  const auto algorithm = [&](const auto &batch) { ksl::forward_dynamics_batch(m, batch, threads); };
  return run<double>(m, bq, bv, bt, out, algorithm) || run<float>(m, bq, bv, bt, out, algorithm);
}

} // namespace direct
