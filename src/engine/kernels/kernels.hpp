// The kernels of the instruction set that is in use.
#pragma once

#include "engine/kernels/algorithm_rows.hpp"

#include <cstddef>

namespace ksl {

/// The table of the instruction set in use, which is chosen at the first call.  Throws std::runtime_error for an unusable
/// KSL_ISA.
const kernel_table &kernels();

/// Are all n numbers finite?
struct finite_kernels {
  bool (*in_double)(const double *, std::size_t n);
  bool (*in_float)(const float *, std::size_t n);
};
const finite_kernels &finite_kernels_in_force();

/// The kernels for double or float, by the template argument.
template <class S> const kernels_in<S> &in_precision(const algorithm_kernels &kernels);
template <> inline const kernels_in<double> &in_precision<double>(const algorithm_kernels &kernels) {
  return kernels.in_double;
}
template <> inline const kernels_in<float> &in_precision<float>(const algorithm_kernels &kernels) {
  return kernels.in_float;
}

template <class S> const kernels_in<S> &kernels_of_row(const algorithm_row &row) {
  return in_precision<S>(*(kernels().*row.kernels));
}

/// Bytes of memory that the kernel of a batch needs: given none it computes nothing, and says how many.
template <class S>
std::size_t batch_bytes(const kernels_in<S> &kernel, const model_view<S> &view, const batch_view<S> &batch) {
  return kernel.batch(view, batch, 0, 0, nullptr).bytes;
}

} // namespace ksl
