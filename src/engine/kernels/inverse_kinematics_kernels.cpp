// Inverse kinematics in lanes.  Compiled once for each instruction set (CMakeLists.txt).
#include "engine/kernels/inverse_kinematics_kernels.hpp"

#include "engine/kernels/kernel.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class S>
std::size_t solve_in_lanes(const model_view<S> &model, const coupling_view<S> &coupling,
                           const inverse_kinematics_options &options, const inverse_kinematics_batch<S> &batch,
                           std::size_t first, std::size_t end, void *memory) {
  inverse_kinematics_solver<batch_pack<S>> solver(model, coupling, options, batch);
  arena pieces(memory);
  solver.lay_out(pieces);
  if (memory)
    solver.solve(first, end);
  return pieces.used();
}

} // namespace KSL_ISA
} // namespace ksl

extern "C" const ksl::inverse_kinematics_kernels KSL_KERNELS_IN(inverse_kinematics, KSL_ISA) = {
    .in_double = ksl::solve_in_lanes<double>, .in_float = ksl::solve_in_lanes<float>};
