// The kernels of inverse kinematics: a target in each lane.
#pragma once

#include "ksl/engine/algorithms/kinematics/inverse_kinematics.hpp"

namespace ksl {

/// Solves the targets [first, end).  Returns the bytes of memory that it needs, aligned to 64; with null for the memory it solves
/// nothing.
template <class S>
using inverse_kinematics_kernel = std::size_t (*)(const model_view<S> &, const coupling_view<S> &,
                                                  const inverse_kinematics_options &,
                                                  const inverse_kinematics_batch<S> &, std::size_t first,
                                                  std::size_t end, void *memory);

struct inverse_kinematics_kernels {
  inverse_kinematics_kernel<double> in_double;
  inverse_kinematics_kernel<float> in_float;
};

/// The kernels of the instruction set in use.
const inverse_kinematics_kernels &inverse_kinematics_kernels_in_force();

} // namespace ksl
