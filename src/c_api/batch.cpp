// The C face of batches.
#include "c_api/handles.hpp"
#include "ksl/batch.hpp"

namespace {

using ksl::c_api::guarded;
using ksl::c_api::require;
using ksl::c_api::require_links;

/// States and results of one call; null inputs are refused where the algorithm needs them.
template <class S>
ksl::batch_view<S> view(std::size_t n, ksl::rows_view<const S> q, ksl::rows_view<const S> v, ksl::rows_view<const S> a,
                        ksl::rows_view<S> out) {
  ksl::batch_view<S> b;
  b.n = n;
  b.q = q, b.v = v, b.a = b.tau = a, b.out = out;
  return b;
}

template <class S>
ksl_status_t inverse_dynamics(const ksl_model_t *m, const ksl::batch_view<S> &b, int threads) {
  return guarded([&] {
    require(m && (b.n == 0 || (b.q.first && b.v.first && b.a.first && b.out.first)), "model and arrays must not be null");
    ksl::inverse_dynamics_batch<S>(m->model, b, {}, threads);
  });
}

template <class S>
ksl_status_t forward_dynamics(const ksl_model_t *m, const ksl::batch_view<S> &b, int threads) {
  return guarded([&] {
    require(m && (b.n == 0 || (b.q.first && b.v.first && b.tau.first && b.out.first)), "model and arrays must not be null");
    ksl::forward_dynamics_batch(m->model, b, threads);
  });
}

template <class S> ksl_status_t mass_matrix(const ksl_model_t *m, const ksl::batch_view<S> &b, int threads) {
  return guarded([&] {
    require(m && (b.n == 0 || (b.q.first && b.out.first)), "model and arrays must not be null");
    ksl::mass_matrix_batch(m->model, b, threads);
  });
}

template <class S>
ksl_status_t frame_poses(const ksl_model_t *m, const ksl::batch_view<S> &b, int n, const int *links, int threads) {
  return guarded([&] {
    require(m && (b.n == 0 || (b.q.first && (b.out.first || n == 0))), "model and arrays must not be null");
    require_links(m, n, links);
    ksl::frame_poses_batch(m->model, b, n, links, threads);
  });
}

template <class S>
ksl_status_t energy(const ksl_model_t *m, const ksl::batch_view<S> &b, ksl::rows_view<S> kinetic, ksl::rows_view<S> potential,
                    int threads) {
  return guarded([&] {
    require(m && (b.n == 0 || (b.q.first && b.v.first && kinetic.first && potential.first)), "model and arrays must not be null");
    ksl::energy_batch(m->model, b, kinetic, potential, threads);
  });
}

} // namespace

extern "C" {

// The calls in one precision; `suffix` is that of their names.
#define KSL_BATCH_CALLS(S, suffix)                                                                                     \
  ksl_status_t ksl_inverse_dynamics_batch##suffix(const ksl_model_t *m, size_t n, const S *q, ptrdiff_t q_stride,      \
                                                  const S *v, ptrdiff_t v_stride, const S *a, ptrdiff_t a_stride,      \
                                                  S *tau, ptrdiff_t tau_stride, int threads) {                         \
    return inverse_dynamics(m, view<S>(n, {q, q_stride}, {v, v_stride}, {a, a_stride}, {tau, tau_stride}), threads);   \
  }                                                                                                                    \
  ksl_status_t ksl_forward_dynamics_batch##suffix(const ksl_model_t *m, size_t n, const S *q, ptrdiff_t q_stride,      \
                                                  const S *v, ptrdiff_t v_stride, const S *tau, ptrdiff_t tau_stride,  \
                                                  S *a, ptrdiff_t a_stride, int threads) {                             \
    return forward_dynamics(m, view<S>(n, {q, q_stride}, {v, v_stride}, {tau, tau_stride}, {a, a_stride}), threads);   \
  }                                                                                                                    \
  ksl_status_t ksl_mass_matrix_batch##suffix(const ksl_model_t *m, size_t n, const S *q, ptrdiff_t q_stride, S *M,     \
                                             ptrdiff_t M_stride, int threads) {                                        \
    return mass_matrix(m, view<S>(n, {q, q_stride}, {}, {}, {M, M_stride}), threads);                                  \
  }                                                                                                                    \
  ksl_status_t ksl_frame_poses_batch##suffix(const ksl_model_t *m, size_t n, const S *q, ptrdiff_t q_stride,           \
                                             int links_n, const int *links, S *poses, ptrdiff_t poses_stride,          \
                                             int threads) {                                                            \
    return frame_poses(m, view<S>(n, {q, q_stride}, {}, {}, {poses, poses_stride}), links_n, links, threads);          \
  }                                                                                                                    \
  ksl_status_t ksl_energy_batch##suffix(const ksl_model_t *m, size_t n, const S *q, ptrdiff_t q_stride, const S *v,    \
                                        ptrdiff_t v_stride, S *kinetic, ptrdiff_t kinetic_stride, S *potential,        \
                                        ptrdiff_t potential_stride, int threads) {                                     \
    return energy<S>(m, view<S>(n, {q, q_stride}, {v, v_stride}, {}, {}), {kinetic, kinetic_stride},                   \
                     {potential, potential_stride}, threads);                                                          \
  }

KSL_BATCH_CALLS(double, )
KSL_BATCH_CALLS(float, f)
#undef KSL_BATCH_CALLS

} // extern "C"
