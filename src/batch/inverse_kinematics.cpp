#include "ksl/inverse_kinematics.hpp"

#include "batch/threads.hpp"
#include "engine/kernels/inverse_kinematics_kernels.hpp"
#include "text/rounding.hpp"
#include "engine/states/thread_memory.hpp"
#include "ksl/engine/model/quaternion_tolerance.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace ksl {
namespace {

constexpr std::size_t targets_each = 16; ///< the fewest targets of a part: some ten microseconds of work

template <class S> inverse_kinematics_kernel<S> kernel();
template <> inverse_kinematics_kernel<double> kernel() { return inverse_kinematics_kernels_in_force().in_double; }
template <> inverse_kinematics_kernel<float> kernel() { return inverse_kinematics_kernels_in_force().in_float; }

/// Divides the quaternions of the results by their lengths.  A start that is at its target becomes the result as it was given, and its
/// quaternions may differ from unit length.
template <class S> void normalize_quaternions(const model &m, const inverse_kinematics_batch<S> &batch) {
  for (const model::quaternion_in_q &quaternion : m.quaternions())
    for (std::size_t k = 0; k < batch.n; ++k)
      if (S *const x = row(batch.q, k) + quaternion.q_index; !is_unit_quaternion(x, quaternion_rounding)) {
        const double length = quaternion_length(x);
        for (int i = 0; i < 4; ++i)
          x[i] = static_cast<S>(double(x[i]) / length);
      }
}

/// Kernels measure an orientation's error θ by 2 sin(θ/2), which is the largest, 2, at half a turn.
/// From π on a tolerance accepts any orientation: 4 is more than all chords.
double chord_of(double angle) {
  const double pi = std::acos(-1.0);
  return angle < pi ? 2 * std::sin(angle / 2) : 4;
}
template <class S> void chords_to_angles(const inverse_kinematics_batch<S> &batch) {
  for (std::size_t k = 0; batch.error.first && k < batch.n; ++k) {
    S &error = row(batch.error, k)[1];
    error = static_cast<S>(2 * std::asin(std::min(double(error) / 2, 1.0)));
  }
}

} // namespace

template <class S> void inverse_kinematics(const model &m, const inverse_kinematics_options &given,
                                           const inverse_kinematics_batch<S> &batch, int threads) {
  const nearest_rounding rounding;
  inverse_kinematics_options options = given;
  options.orientation_tolerance = chord_of(given.orientation_tolerance);
  const inverse_kinematics_kernel<S> solve = kernel<S>();
  const model_view<S> view = m.view_in<S>();
  const coupling_view<S> coupling = m.coupling_in<S>();
  const partition parts(batch.n, targets_each, targets_each, threads);
  // without memory it only says how much it needs
  const std::size_t bytes = solve(view, coupling, options, batch, 0, 0, nullptr);
  std::byte *memory = thread_memory(kept_for::workspace, bytes * parts.threads);
  on_threads(parts, [&](std::size_t first, std::size_t end, std::size_t seat) {
    solve(view, coupling, options, batch, first, end, memory + bytes * seat);
  });
  normalize_quaternions(m, batch);
  chords_to_angles(batch);
}
template void inverse_kinematics(const model &, const inverse_kinematics_options &,
                                 const inverse_kinematics_batch<double> &, int);
template void inverse_kinematics(const model &, const inverse_kinematics_options &,
                                 const inverse_kinematics_batch<float> &, int);

} // namespace ksl
