// The call that a controller makes: one state, as arrays that can be read as they are, and nothing else asked for.  It takes the steps of
// calls.hpp that such a call needs, and none of the others.
//
// Whatever is out of the ordinary is left to calls.hpp, which knows all that is allowed and what to say of the rest: wrenches, requests,
// quaternions that are not of unit length, other shapes and types, numbers that are not finite, and states of mechanisms with loops that
// have no result.
#pragma once

#include "array.hpp"
#include "result_memory.hpp"

#include "engine/run/arguments.hpp"
#include "engine/run/compute.hpp"
#include "engine/kernels/finite.hpp"
#include "engine/states/thread_memory.hpp"
#include "text/rounding.hpp"

namespace calls {

/// An array of numbers of type double, one behind the other, that nobody else stands for.
inline bool is_plain(nb::handle object, int axes) {
  if (!PyArray_CheckExact(object.ptr()))
    return false;
  const auto array = reinterpret_cast<PyArrayObject *>(object.ptr());
  return PyArray_TYPE(array) == NPY_DOUBLE && PyArray_NDIM(array) == axes && PyArray_ISCARRAY_RO(array);
}
inline double *numbers_of(nb::handle object) {
  return static_cast<double *>(PyArray_DATA(reinterpret_cast<PyArrayObject *>(object.ptr())));
}

/// The result of a row's algorithm for one state, or an object that is not valid if calls.hpp has to look at the call.
class one_state_call {
public:
  one_state_call(const ksl::algorithm_row &row, const ksl::model &m, const nb::handle *inputs)
      : row_(row), m_(m), inputs_(inputs) {}

  nb::object run(nb::handle external, nb::handle request, nb::handle out, nb::handle threads) {
    if (row_.request != ksl::request_kind::none || !external.is_none() || !request.is_none() || !threads.is_none() ||
        (row_.needs_mass && m_.massless_joint() >= 0) || (row_.smooth_friction && m_.exact_friction()))
      return {};
    const ksl::nearest_rounding rounding;
    ksl::state_view<double> state;
    const ksl::way_calls<double> &calls = ksl::calls_of<double>(row_, m_);
    if (!is_computable() || !take_inputs(state) || !take_results(out, state))
      return {};
    const std::size_t bytes = calls.state_bytes(row_, m_, {}), nv = static_cast<std::size_t>(m_.nv());
    std::byte *const workspace =
        ksl::thread_memory(ksl::kept_for::workspace, bytes + (row_.variant_of ? nv * sizeof(double) : 0));
    if (row_.variant_of)
      take_zeros(state, reinterpret_cast<double *>(workspace + bytes), nv);
    if (!calls.run_state(row_, m_, workspace, state) ||
        !(calls.looks_at_all || row_.needs_mass || results_are_finite(state)))
      return {};
    return results();
  }

private:
  bool is_computable() const {
    try {
      ksl::require_computable(row_, m_);
    } catch (const std::invalid_argument &) {
      return false;
    }
    return true;
  }
  bool take_inputs(ksl::state_view<double> &state) const {
    for (int i = 0; i < row_.inputs; ++i) {
      const int columns = ksl::length_of(row_.input_list[i], m_.nq(), m_.nv());
      if (!is_plain(inputs_[i], 1) || PyArray_DIM(reinterpret_cast<PyArrayObject *>(inputs_[i].ptr()), 0) != columns)
        return false;
      const double *const numbers = numbers_of(inputs_[i]);
      if (!ksl::finite_kernels_in_force().in_double(numbers, static_cast<std::size_t>(columns)))
        return false;
      ksl::input_of(state, row_.input_list[i]) = numbers;
    }
    return has_unit_quaternions(state, ksl::input::q) && has_unit_quaternions(state, ksl::input::q1);
  }
  bool has_unit_quaternions(const ksl::state_view<double> &state, ksl::input x) const {
    bool are_units = true;
    if (row_.reads(x) && !m_.quaternions().empty())
      ksl::check_quaternions(m_, ksl::rows_view<const double>{ksl::input_of(state, x), 0}, 0, 1,
                             [&](const ksl::joint_row &, std::size_t, const double *) { return are_units = false; });
    return are_units;
  }

  /// A variant's kernels read more than it names: zeros, all of which have at most nv numbers.
  void take_zeros(ksl::state_view<double> &state, double *zeros, std::size_t nv) const {
    std::fill_n(zeros, nv, 0.0);
    for (int i = 0; i < row_.variant_of->inputs; ++i)
      if (!row_.reads(row_.variant_of->input_list[i]))
        ksl::input_of(state, row_.variant_of->input_list[i]) = zeros;
  }

  /// New arrays, or the one that is given, if it shares no memory with an argument.
  bool take_results(nb::handle out, ksl::state_view<double> &state) {
    if (!out.is_none() && (row_.results > 1 || !is_plain(out, row_.result[0].axes)))
      return false;
    for (int r = 0; r < row_.results; ++r) {
      const ksl::result_row &wanted = row_.result[r];
      npy_intp shape[NPY_MAXDIMS];
      count_[r] = 1;
      for (int i = 0; i < wanted.axes; ++i) {
        shape[i] = ksl::length_of(wanted.shape[i], extents());
        count_[r] *= static_cast<std::size_t>(shape[i]);
      }
      result_[r] = out.is_none() ? new_array(wanted.axes, shape, NPY_DOUBLE) : nb::borrow(out);
      if (!out.is_none() && !may_take(out, wanted.axes, shape))
        return false;
      state.result[r] = numbers_of(result_[r]);
    }
    return true;
  }
  bool may_take(nb::handle out, int axes, const npy_intp *shape) const {
    const auto array = reinterpret_cast<PyArrayObject *>(out.ptr());
    if (!PyArray_ISWRITEABLE(array) || !std::equal(shape, shape + axes, PyArray_DIMS(array)))
      return false;
    for (int i = 0; i < row_.inputs; ++i)
      if (!row_array(out, 1, axes).apart_from(row_array(inputs_[i], 1, 1)))
        return false;
    return true;
  }
  ksl::extents extents() const {
    return {m_.nq(), m_.nv(), 0, 0, m_.tree_elements(), static_cast<int>(m_.links().size())};
  }
  bool results_are_finite(const ksl::state_view<double> &state) const {
    for (int r = 0; r < row_.results; ++r)
      if (!ksl::finite_kernels_in_force().in_double(state.result[r], count_[r]))
        return false;
    return true;
  }
  nb::object results() const {
    if (row_.results == 1)
      return result_[0];
    nb::object tuple = nb::steal(PyTuple_New(row_.results));
    if (!tuple.is_valid())
      nb::raise_python_error();
    for (int r = 0; r < row_.results; ++r)
      PyTuple_SetItem(tuple.ptr(), r, nb::object(result_[r]).release().ptr()); // the macro is not in the stable ABI
    return tuple;
  }

  const ksl::algorithm_row &row_;
  const ksl::model &m_;
  const nb::handle *const inputs_;
  nb::object result_[ksl::most_results];
  std::size_t count_[ksl::most_results] = {};
};

} // namespace calls
