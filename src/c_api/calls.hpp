// Calls of algorithms from C.  Arguments are checked as the algorithm's row says and then passed on.
#pragma once

#include "batch/compute_batch.hpp"
#include "c_api/handles.hpp"
#include "engine/arguments.hpp"
#include "engine/compute.hpp"

#include <array>
#include <climits>

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

/// Joints as a call names them, and how their wrenches are expressed.
struct joints_argument {
  int n = 0;
  const int *index = nullptr;
  const ksl_reaction_options_t *options = nullptr; ///< may be null
};

/// Passed on by calls without external wrenches.
struct absent {
  template <class T> operator const T *() const { return nullptr; }
};
constexpr absent no_external{}, no_external_rows{};

/// Checks that n numbers are finite; the message names the first that is not.
template <class S> void require_finite(const S *x, int n, const char *name);

/// Checks that positions are finite and quaternions have unit length; warns where they haven't quite.
template <class S> void require_position(const model &m, const S *q, const char *name);

/// Checks that a workspace was created for this model.
void require_workspace(const ksl_model_t *m, const ksl_data_t *d);

template <class S> external_wrenches<S> external_of(const ksl_model_t *m,
                                                    const typename c_types<S>::external *external);

/// The request for reactions through joints; `links`, which has room for all joints, gets their child links.
reaction_request request_of(const ksl_model_t *m, int *links, const joints_argument &joints);

/// options may be null.
frame_options frame_options_of(const ksl_frame_options_t *options);

/// Checks that a result of one state is not null, unless it has no numbers, and that an int counts them.
inline void require_result(const void *out, std::ptrdiff_t numbers, const char *name) {
  if (numbers > INT_MAX)
    throw bad_argument(std::string(name) +
                       " would have more than 2^31 - 1 numbers for a state; name fewer links or joints");
  if (!out && numbers > 0)
    throw bad_argument(std::string(name) + " must not be null");
}

/// As require_rows, of any numbers.
template <class S> void require_large_rows(const rows_view<S> &rows, std::size_t n, std::ptrdiff_t columns,
                                           const char *name);

/// Checks that n rows of so many numbers, at most INT_MAX, can lie in memory, apart by the stride.
template <class S> void require_rows(const rows_view<S> &rows, std::size_t n, std::ptrdiff_t columns,
                                     const char *name) {
  constexpr std::ptrdiff_t far = 1 << 26; // 2^32 rows that are nearer than that have less than 2^62 bytes
  if (n >> 32 || rows.stride >= far || rows.stride <= -far)
    require_large_rows(rows, n, columns, name);
}

/// Checks what a row needs of the model.
inline void require_model_for(const algorithm_row &row, const model &m) {
  check_model(row, m, [](const std::string &sentence) { throw bad_argument(sentence); });
}

/// Checks the arguments of a row for one state: the workspace, the results and the numbers.  Inputs that the row doesn't have
/// are taken as zero.
template <const algorithm_row &row, class S> void check_state(const ksl_model_t *m, ksl_data_t *d, state_view<S> &s) {
  const model &model = m->model;
  require_model_for(row, m->model);
  if constexpr (names_links(row.request))
    require_links(m, s.links.n, s.links.index);
  require(may_name_links(row, model, s.links.n), "links: at most as many as the model has");
  for (int r = 0; r < row.results; ++r)
    require_result(s.result[r], numbers_of(row.result[r], extents_of(model, s)), row.result[r].name);
  for (int i = 0; i < row.inputs; ++i) {
    const input x = row.input_list[i];
    if (x == input::q || x == input::q1)
      require_position(m->model, input_of(s, x), row.input_name[i]);
    else
      require_finite(input_of(s, x), length_of(x, model.nq(), model.nv()), row.input_name[i]);
  }
  for (input x : {input::v, input::a, input::tau})
    if (!row.reads(x))
      input_of(s, x) = d->data.template zero<S>();
}

/// Computes one state in the caller's workspace.
template <const algorithm_row &row, class S>
ksl_status_t state_call(const ksl_model_t *m, ksl_data_t *d, state_view<S> s,
                        const typename c_types<S>::external *external, const ksl_frame_options_t *options = nullptr) {
  return guarded([&] {
    require_workspace(m, d);
    s.frame = frame_options_of(options);
    check_state<row>(m, d, s);
    if constexpr (row.external != external_use::none)
      s.external = external_of<S>(m, external);
    d->holds_wrenches = 0;
    compute<S>(row, m->model, d->data, s, arguments_are::finite);
    if constexpr (row.kernels == rows::inverse_dynamics.kernels && row.reads(input::a))
      d->holds_wrenches = sizeof(S);
  });
}

/// The same for joints: all results are those of the row.
template <const algorithm_row &row, class S>
ksl_status_t state_call(const ksl_model_t *m, ksl_data_t *d, state_view<S> s,
                        const typename c_types<S>::external *external, const joints_argument &joints) {
  return guarded([&] {
    require_workspace(m, d);
    const reaction_request request = request_of(m, d->links.data(), joints);
    s.joints = &request;
    check_state<row>(m, d, s);
    if constexpr (row.external != external_use::none)
      s.external = external_of<S>(m, external);
    d->holds_wrenches = 0;
    compute<S>(row, m->model, d->data, s, arguments_are::finite);
  });
}

/// The same with reactions as a further result.
template <const algorithm_row &row, class S>
ksl_status_t state_call(const ksl_model_t *m, ksl_data_t *d, state_view<S> s,
                        const typename c_types<S>::external *external, const joints_argument &joints, S *wrenches) {
  return guarded([&] {
    require_workspace(m, d);
    require_result(wrenches, joints.n, "wrenches");
    check_state<row>(m, d, s);
    s.external = external_of<S>(m, external);
    const reaction_request request = request_of(m, d->links.data(), joints);
    const reaction_result<S> wanted = {&request, wrenches};
    s.reactions_n = 1, s.reactions = &wanted;
    d->holds_wrenches = 0;
    compute<S>(row, m->model, d->data, s, arguments_are::finite);
    d->holds_wrenches = sizeof(S);
  });
}

/// Computes a batch.
template <class S>
ksl_status_t batch_call(const algorithm_row &row, const ksl_model_t *m, batch_view<S> batch,
                        const typename c_types<S>::external_of_batch *external, int threads,
                        const ksl_frame_options_t *frame = nullptr, const joints_argument &joints = {},
                        const rows_view<S> &wrenches = {});

} // namespace ksl::c_api
