// Inverse kinematics from C.
//
// Rows of a batch of n: start and q (nq), targets (frames, 4, 4) row-major, errors (2): of position, m, and of orientation, rad; ends, iterations and
// starts one each.  Starts are read as solutions are written, state by state, so that q may be start; no result may lie over targets.
#include "c_api/calls.hpp"
#include "engine/model/pose_check.hpp"
#include "engine/states/thread_memory.hpp"

#include "ksl/inverse_kinematics.hpp"

#include <cmath>

namespace ksl::c_api {
namespace {

inverse_kinematics_options options_of(const ksl_inverse_kinematics_options_t *given) {
  const ksl_inverse_kinematics_options_t o = given ? *given : ksl_inverse_kinematics_options();
  for (const double tolerance : {o.position_tolerance, o.orientation_tolerance})
    require(tolerance > 0 && std::isfinite(tolerance), "tolerances must be positive and finite");
  require(o.iterations > 0 && o.starts > 0, "iterations and starts must be positive");
  inverse_kinematics_options options;
  options.position_tolerance = o.position_tolerance, options.orientation_tolerance = o.orientation_tolerance;
  options.iterations = o.iterations, options.starts = o.starts, options.seed = o.seed, options.limits = o.limits;
  return options;
}

/// Checks that q and errors overwrite neither each other nor the targets.  q may have the memory of the starts.
template <class S>
void require_results_apart(const model &m, const inverse_kinematics_batch<S> &batch, int frames_n) {
  const std::size_t n = batch.n;
  check_stride(batch.q, m.nq(), n, "q", refuse_argument);
  check_stride(batch.error, 2, n, "errors", refuse_argument);
  const memory_of_rows q(batch.q, m.nq()), errors(batch.error, 2), start(batch.start, m.nq()),
      targets(batch.target, 16 * static_cast<std::ptrdiff_t>(frames_n));
  check_overlap(q, "q", targets, "targets", n, false, refuse_argument);
  check_overlap(errors, "errors", targets, "targets", n, false, refuse_argument);
  check_overlap(q, "q", start, "start", n, true, refuse_argument);
  check_overlap(errors, "errors", start, "start", n, false, refuse_argument);
  check_overlap(errors, "errors", q, "q", n, false, refuse_argument);
}

template <class S>
ksl_status_t solve(const ksl_model_t *m, int frames_n, const ksl_wanted_frame_t *frames,
                   const ksl_inverse_kinematics_options_t *given, const inverse_kinematics_batch<S> &batch,
                   int threads) {
  return guarded([&] {
    last_warning()[0] = '\0';
    require(m && frames_n > 0 && frames_n <= most_named && frames,
            "model and frames must not be null, and there must be a frame, 2^24 at most");
    require(batch.n == 0 || (batch.target.first && batch.q.first), "targets and q must not be null");
    require(threads >= 0, "threads must not be negative; 0 is all cores that the process may use");
    require_rows(batch.target, batch.n, 16 * static_cast<std::ptrdiff_t>(frames_n), "targets");
    require_rows(batch.start, batch.n, m->model.nq(), "start");
    require_rows(batch.q, batch.n, m->model.nq(), "q");
    require_rows(batch.error, batch.n, 2, "errors");
    require_results_apart(m->model, batch, frames_n);
    inverse_kinematics_options options = options_of(given);
    arena memory(thread_memory(kept_for::arguments, static_cast<std::size_t>(frames_n) * sizeof(wanted_frame)));
    wanted_frame *const wanted = memory.take<wanted_frame>(frames_n);
    for (int f = 0; f < frames_n; ++f) {
      require_index(frames[f].link, ksl_model_links(m), "a link is out of range", "link of frames", f);
      for (const double weight : {frames[f].position_weight, frames[f].orientation_weight})
        require(weight >= 0 && std::isfinite(weight), "weights must not be negative, nor infinite");
      wanted[f] = {frames[f].link, frames[f].position_weight, frames[f].orientation_weight};
    }
    options.frames_n = frames_n, options.frames = wanted;
    // all targets and starts before anything is computed, and all results afterwards: a refused call leaves q as it was
    for (std::size_t k = 0; k < batch.n; ++k) {
      for (int f = 0; f < frames_n; ++f)
        require(is_pose(row(batch.target, k) + 16 * f),
                "a target is not a pose: a rotation, a position, and 0 0 0 1, row-major");
      if (batch.start.first)
        require_position(m->model, row(batch.start, k), "start");
    }
    inverse_kinematics(m->model, options, batch, threads);
    for (std::size_t k = 0; k < batch.n; ++k) {
      examine_numbers("inverse_kinematics", "q", row(batch.q, k), m->model.nq(), k, batch.n > 1);
      if (batch.error.first)
        examine_numbers("inverse_kinematics", "errors", row(batch.error, k), 2, k, batch.n > 1);
    }
  });
}

} // namespace
} // namespace ksl::c_api

extern "C" {

ksl_inverse_kinematics_options_t ksl_inverse_kinematics_options(void) {
  const ksl::inverse_kinematics_options o;
  return {o.position_tolerance, o.orientation_tolerance, o.iterations, o.starts, o.seed, o.limits};
}

ksl_status_t ksl_inverse_kinematics(const ksl_model_t *model, size_t n, int frames_n, const ksl_wanted_frame_t *frames,
                                    const double *targets, ptrdiff_t targets_stride, const double *start,
                                    ptrdiff_t start_stride, const ksl_inverse_kinematics_options_t *options, double *q,
                                    ptrdiff_t q_stride, double *errors, ptrdiff_t errors_stride, int *ends,
                                    int *iterations, int *starts, int threads) {
  return ksl::c_api::solve<double>(model, frames_n, frames, options,
                                   {n,
                                    {start, start_stride},
                                    {targets, targets_stride},
                                    {q, q_stride},
                                    {errors, errors_stride},
                                    ends,
                                    iterations,
                                    starts},
                                   threads);
}

ksl_status_t ksl_inverse_kinematicsf(const ksl_model_t *model, size_t n, int frames_n, const ksl_wanted_frame_t *frames,
                                     const float *targets, ptrdiff_t targets_stride, const float *start,
                                     ptrdiff_t start_stride, const ksl_inverse_kinematics_options_t *options, float *q,
                                     ptrdiff_t q_stride, float *errors, ptrdiff_t errors_stride, int *ends,
                                     int *iterations, int *starts, int threads) {
  return ksl::c_api::solve<float>(model, frames_n, frames, options,
                                  {n,
                                   {start, start_stride},
                                   {targets, targets_stride},
                                   {q, q_stride},
                                   {errors, errors_stride},
                                   ends,
                                   iterations,
                                   starts},
                                  threads);
}

} // extern "C"
