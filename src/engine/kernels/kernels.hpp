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

} // namespace ksl
