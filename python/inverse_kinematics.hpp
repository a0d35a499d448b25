// Inverse kinematics from Python: arrays that ksl.inverse_kinematics has converted, of one precision.
#pragma once

#include "calls.hpp"

#include "engine/model/pose_check.hpp"
#include "ksl/inverse_kinematics.hpp"

#include <tuple>

namespace calls {

/// link, weight of the position, of the orientation
using wanted_frames = std::vector<std::tuple<int, double, double>>;

template <class S>
nb::tuple solve_inverse_kinematics(const ksl::model &m, const std::vector<ksl::wanted_frame> &frames, nb::handle target,
                                   nb::handle start, ksl::inverse_kinematics_options options, int threads) {
  const int frames_n = static_cast<int>(frames.size());
  options.frames_n = frames_n, options.frames = frames.data();
  ksl::inverse_kinematics_batch<S> batch;
  const row_array targets(target, 16 * frames_n, 1), starts(start, m.nq(), 1);
  const npy_intp n = targets.length(0), q_shape[2] = {n, m.nq()}, error_shape[2] = {n, 2};
  const auto data = [](const nb::object &x) { return PyArray_DATA(reinterpret_cast<PyArrayObject *>(x.ptr())); };
  const nb::object q = new_array(2, q_shape, numpy_type<S>), error = new_array(2, error_shape, numpy_type<S>),
                   end = new_array(1, q_shape, NPY_INT), iterations = new_array(1, q_shape, NPY_INT),
                   used = new_array(1, q_shape, NPY_INT);
  batch.n = static_cast<std::size_t>(n);
  batch.target = targets.rows<const S>(), batch.start = starts.rows<const S>();
  batch.q = {static_cast<S *>(data(q)), m.nq()}, batch.error = {static_cast<S *>(data(error)), 2};
  batch.end = static_cast<int *>(data(end)), batch.iterations = static_cast<int *>(data(iterations));
  batch.starts = static_cast<int *>(data(used));
  for (std::size_t k = 0; k < batch.n; ++k)
    for (int f = 0; f < frames_n; ++f)
      if (!ksl::is_pose(row(batch.target, k) + 16 * f))
        refuse("target " + std::to_string(k) + (frames_n > 1 ? ", frame " + std::to_string(f) : "") +
               " is not a pose; expected a rotation, a position in the last column, and 0 0 0 1 in the last row");
  std::string rough;
  if (batch.start.first)
    ksl::check_quaternions(
        m, batch.start, 0, batch.n, [&](const ksl::joint_row &joint, std::size_t k, const S *numbers) {
          const std::string which = "q0 of target " + std::to_string(k) + ": the quaternion of " + joint.name;
          if (!ksl::is_unit_quaternion(numbers))
            refuse(which + " has length " + ksl::text::shown(ksl::quaternion_length(numbers)) +
                   "; expected a unit quaternion [qx qy qz qw]");
          rough = rough.empty() ? which : rough;
          return true;
        });
  if (!rough.empty())
    warn_of_quaternion(rough);
  {
    const without_gil released;
    ksl::inverse_kinematics(m, options, batch, threads);
  }
  return nb::make_tuple(q, error, end, iterations, used);
}

/// target (n, 16 frames) and start (n, nq) or None, contiguous and of one precision.
inline nb::tuple inverse_kinematics(const ksl::model &m, const wanted_frames &frames, nb::handle target,
                                    nb::handle start, double position_tolerance, double orientation_tolerance,
                                    int iterations, int starts, std::uint64_t seed, bool limits, nb::handle threads) {
  std::vector<ksl::wanted_frame> wanted;
  for (const auto &[link, position, orientation] : frames)
    wanted.push_back({link, position, orientation});
  ksl::inverse_kinematics_options options;
  options.position_tolerance = position_tolerance, options.orientation_tolerance = orientation_tolerance;
  options.iterations = iterations, options.starts = starts, options.seed = seed, options.limits = limits;
  const int most = thread_count(threads);
  ksl::kernels(); // raises the error of an unusable KSL_ISA here and not on another thread
  const bool single = row_array(target, 16, 1).readable<float>();
  return single ? solve_inverse_kinematics<float>(m, wanted, target, start, options, most)
                : solve_inverse_kinematics<double>(m, wanted, target, start, options, most);
}

} // namespace calls
