#include "ksl/inverse_kinematics.hpp"

#include "batch/compute_batch.hpp"
#include "batch/inverse_kinematics_kernels.hpp"
#include "batch/threads.hpp"

#include <cstddef>

namespace ksl {
namespace {

constexpr std::size_t targets_each = 16; ///< in a part at least: some ten microseconds of work

template <class S> inverse_kinematics_kernel<S> kernel();
template <> inverse_kinematics_kernel<double> kernel() { return inverse_kinematics_kernels_in_force().in_double; }
template <> inverse_kinematics_kernel<float> kernel() { return inverse_kinematics_kernels_in_force().in_float; }

} // namespace

template <class S> void inverse_kinematics(const model &m, const inverse_kinematics_options &options,
                                           const inverse_kinematics_batch<S> &batch, int threads) {
  const inverse_kinematics_kernel<S> solve = kernel<S>();
  const model_view<S> view = m.view_in<S>();
  const coupling_view<S> coupling = m.coupling_in<S>();
  const partition parts(batch.n, targets_each, targets_each, threads);
  const std::size_t bytes = solve(view, coupling, options, batch, 0, 0, nullptr);
  std::byte *memory = scratch(bytes * parts.threads);
  on_threads(parts, [&](std::size_t first, std::size_t end, std::size_t seat) {
    solve(view, coupling, options, batch, first, end, memory + bytes * seat);
  });
}
template void inverse_kinematics(const model &, const inverse_kinematics_options &, const inverse_kinematics_batch<double> &, int);
template void inverse_kinematics(const model &, const inverse_kinematics_options &, const inverse_kinematics_batch<float> &, int);

} // namespace ksl
