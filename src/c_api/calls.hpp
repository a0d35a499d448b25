// Calls of algorithms from C.  Arguments are checked as the algorithm's row says and then passed on.
//
//     ksl_NAME             engine_calls.cpp, generated: arguments become a view, unchecked
//        ↓
//     guarded              handles.hpp: exceptions end here, as a status and a message of this thread
//        ↓
//     state_call<row>      one state, in the caller's workspace, on the caller's thread; allocates nothing
//     batch_call(row)      many states, in memory that threads keep, on threads of the library
//        ↓
//     compute              engine/run, batch: they trust their arguments
//
// All checks are made before anything is written, so that a refused call leaves results as they are.  The row of one state is a template argument:
// the compiler knows which inputs and results to check.
#pragma once

#include "batch/compute_batch.hpp"
#include "c_api/handles.hpp"
#include "engine/run/arguments.hpp"
#include "engine/run/compute.hpp"

#include <array>
#include <climits>
#include <functional>

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
///
///     joints of a call       0 … n − 1               n … n + loops − 1
///                            those of the tree       those that close loops
///     links of a request     their child links       number of links + number of the loop
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

/// What checks of engine/run/arguments.hpp call.
constexpr auto refuse_argument = [](const std::string &sentence) { throw bad_argument(sentence); };

/// Checks what a row needs of the model.
inline void require_model_for(const algorithm_row &row, const model &m) { check_model(row, m, refuse_argument); }

template <class S> rows_view<S> rows_of(S *numbers) { return {numbers, 0}; }
template <class S> const rows_view<S> &rows_of(const rows_view<S> &rows) { return rows; }

/// The memory of external wrenches: of the one array of a state, or of those of a batch.
template <class S, class Use> void for_external(const state_view<S> &s, Use use) {
  use(memory_of_rows(rows_of(s.external.wrench), 6 * static_cast<std::ptrdiff_t>(s.external.n)));
}
template <class S, class Use> void for_external(const batch_view<S> &batch, Use use) {
  for (int e = 0; e < batch.external_n; ++e)
    use(memory_of_rows(batch.external[e].wrench, 6));
}

/// Checks that the results of n states, and reactions of so many numbers for each, overwrite neither each other nor what is still to be
/// read.  As Python's calls have it, a result may have the memory of an input if both have the same rows.
template <class View, class S>
void require_apart(const algorithm_row &row, const model &m, const View &view, std::size_t n,
                   const rows_view<S> &reactions, std::ptrdiff_t numbers) {
  const auto result = [&](int r) {
    return r < row.results ? memory_of_rows(rows_of(view.result[r]), numbers_of(row.result[r], extents_of(m, view)))
                           : memory_of_rows(reactions, numbers);
  };
  const auto name = [&](int r) { return r < row.results ? row.result[r].name : "wrenches"; };
  for (int r = 0; r < row.results + (numbers > 0); ++r) {
    const memory_of_rows out = result(r);
    for (int i = 0; i < row.inputs; ++i) {
      const input x = row.input_list[i];
      check_overlap(out, name(r), {rows_of(input_of(view, x)), length_of(x, m.nq(), m.nv())}, row.input_name[i], n,
                    true, refuse_argument);
    }
    for_external(view, [&](const memory_of_rows &wrench) {
      check_overlap(out, name(r), wrench, "the external wrenches", n, false, refuse_argument);
    });
    for (int other = 0; other < r; ++other)
      if (!are_apart(out, result(other), n))
        refuse_argument(std::string(name(other)) + " and " + name(r) + " overlap; give each memory of its own");
  }
}

/// Checks the arguments of a row for one state: the workspace, the results and the numbers.  Inputs that the row doesn't have
/// are taken as zero.
template <const algorithm_row &row, class S> void check_state(const ksl_model_t *m, ksl_data_t *d, state_view<S> &s) {
  const model &model = m->model;
  require_model_for(row, m->model);
  if constexpr (names_links(row.request))
    require_links(m, s.links.n, s.links.index);
  if constexpr (row.mimic == mimic_by::hybrid)
    check_links(row, model, s.links.n, s.links.index, refuse_argument);
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

/// Are the results of one state apart from each other and from what is read?  The usual answer, found in a nanosecond.
template <const algorithm_row &row, class S>
bool clearly_apart(const model &m, const state_view<S> &s, const S *wrenches = nullptr, std::ptrdiff_t numbers = 0) {
  const std::less<const S *> before;
  const auto apart = [&](const S *a, std::ptrdiff_t a_numbers, const S *b, std::ptrdiff_t b_numbers) {
    return !before(a, b + b_numbers) || !before(b, a + a_numbers);
  };
  const auto result = [&](int r) { return r < row.results ? s.result[r] : wrenches; };
  const auto length = [&](int r) { return r < row.results ? numbers_of(row.result[r], extents_of(m, s)) : numbers; };
  bool all = true;
  for (int r = 0; r < row.results + (numbers > 0); ++r) {
    for (int i = 0; i < row.inputs; ++i)
      all = all &&
            apart(result(r), length(r), input_of(s, row.input_list[i]), length_of(row.input_list[i], m.nq(), m.nv()));
    all = all && apart(result(r), length(r), s.external.wrench, 6 * static_cast<std::ptrdiff_t>(s.external.n));
    for (int other = 0; other < r; ++other)
      all = all && apart(result(r), length(r), result(other), length(other));
  }
  return all;
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
    if (!clearly_apart<row>(m->model, s))
      require_apart(row, m->model, s, 1, rows_view<S>(), 0);
    // before anything is computed: a call that fails leaves no wrenches that ksl_reactions would read
    d->holds_wrenches = 0;
    compute<S>(row, m->model, d->data, s, arguments_are::finite);
    if constexpr (row.kernels == rows::inverse_dynamics.kernels && row.reads(input::a))
      d->holds_wrenches = sizeof(S);
  });
}

/// A call with joints: all results are those of the row.
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
    if (!clearly_apart<row>(m->model, s))
      require_apart(row, m->model, s, 1, rows_view<S>(), 0);
    d->holds_wrenches = 0;
    compute<S>(row, m->model, d->data, s, arguments_are::finite);
  });
}

/// A call with reactions as a further result.
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
    const std::ptrdiff_t numbers = 6 * static_cast<std::ptrdiff_t>(joints.n);
    if (!clearly_apart<row>(m->model, s, wrenches, numbers))
      require_apart(row, m->model, s, 1, rows_of(wrenches), numbers);
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
