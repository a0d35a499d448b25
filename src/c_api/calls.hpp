// Calls of algorithms from C: arguments are checked as their row says, then handed on.
#pragma once

#include "batch/compute_batch.hpp"
#include "c_api/handles.hpp"
#include "engine/compute.hpp"

#include <array>

namespace ksl::c_api {

template <class S> struct c_types;
template <> struct c_types<double> {
  using external = ksl_external_t;
  using external_of_batch = ksl_external_rows_t;
};
template <> struct c_types<float> {
  using external = ksl_externalf_t;
  using external_of_batch = ksl_external_rowsf_t;
};

/// What calls without external wrenches pass on.
struct absent {
  template <class T> operator const T *() const { return nullptr; }
};
constexpr absent no_external{}, no_external_rows{};

/// n finite numbers; the message names the first that is not.
template <class S> void require_finite(const S *x, int n, const char *name);

/// Finite, and quaternions of unit length.
template <class S> void require_position(const model &m, const S *q);

/// A workspace made for this model.
void require_workspace(const ksl_model_t *m, const ksl_data_t *d);

template <class S> external_wrenches<S> external_of(const ksl_model_t *m, const typename c_types<S>::external *external);

/// The request for reactions through n joints; `links` gets their child links.
reaction_request request_of(const ksl_model_t *m, std::vector<int> &links, int n, const int *joints,
                            const ksl_reaction_options_t *options);

/// One state in the caller's workspace.
template <class S>
ksl_status_t state_call(const algorithm_row &row, const ksl_model_t *m, ksl_data_t *d, state_view<S> s,
                        const typename c_types<S>::external *external, int joints_n = 0, const int *joints = nullptr,
                        const ksl_reaction_options_t *options = nullptr, S *wrenches = nullptr);

/// A batch.
template <class S>
ksl_status_t batch_call(const algorithm_row &row, const ksl_model_t *m, batch_view<S> batch,
                        const typename c_types<S>::external_of_batch *external, int threads, int joints_n = 0,
                        const int *joints = nullptr, const ksl_reaction_options_t *options = nullptr,
                        const rows_view<S> &wrenches = {});

} // namespace ksl::c_api
