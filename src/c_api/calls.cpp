#include "c_api/calls.hpp"

#include "engine/states/thread_memory.hpp"
#include "ksl/engine/lanes/workspace.hpp"
#include "text/words.hpp"

#include <cstdint>
#include <cstdio>

namespace ksl::c_api {

template <class S> void require_finite(const S *x, int n, const char *name) {
  require(x || n == 0, "q, v, a, tau and other arrays must not be null");
  if (const int i = first_not_finite(x, n); i < n)
    throw bad_argument(std::string(name) + "[" + std::to_string(i) + "] is not a finite number");
}

template <class S> void require_position(const model &m, const S *q, const char *name) {
  require_finite(q, m.nq(), name);
  check_quaternions(m, rows_view<const S>{q, 0}, 0, 1, [&](const joint_row &joint, std::size_t, const S *x) {
    const std::string length = text::shown(quaternion_length(x)); // short: no memory is allocated for it
    if (!is_unit_quaternion(x))
      throw bad_argument(std::string(name) + ": the quaternion [qx qy qz qw] of " + joint.name + " has length " +
                         length + "; expected a unit quaternion");
    std::snprintf(
        last_warning(), sizeof last_warning(),
        "%s: the quaternion [qx qy qz qw] of %s has length %s, differs from unit length by more than 1e-6 and was normalised",
        name, joint.name.c_str(), length.c_str());
    return true;
  });
}

/// The first check of a call in a workspace, and so where the warning of the thread's last call is cleared.
void require_workspace(const ksl_model_t *m, const ksl_data_t *d) {
  last_warning()[0] = '\0'; // a call begins
  require(m && d, "model and data must not be null");
  require(d->model == m, "this workspace was made for another model; make one with ksl_data_create for each model");
}

namespace {

/// Checks the n links that external wrenches act on.
void require_external(const ksl_model_t *m, int n, const int *link, const void *wrench) {
  require(n >= 0 && n <= most_named && (n == 0 || (link && wrench)),
          "external needs n links and n wrenches, 2^24 at most");
  for (int k = 0; k < n; ++k)
    require_index(link[k], ksl_model_links(m), "external names a link out of range", "link", k);
}

expressed_in axes_of(ksl_expressed_t axes) {
  require(axes == KSL_IN_FRAME || axes == KSL_IN_WORLD, "external: axes must be KSL_IN_FRAME or KSL_IN_WORLD");
  return static_cast<expressed_in>(axes);
}

wrench_frame frame_of(const ksl_model_t *m, ksl_frame_t frame, int link, const char *argument) {
  if (frame == KSL_LINK)
    require_index(link, ksl_model_links(m), "at_link or axes_link is out of range", argument);
  return static_cast<wrench_frame>(frame);
}

} // namespace

template <class S> external_wrenches<S> external_of(const ksl_model_t *m,
                                                    const typename c_types<S>::external *external) {
  if (!external || external->n == 0)
    return {};
  require_external(m, external->n, external->link, external->wrench);
  require_finite(external->wrench->at, 6 * external->n, "external wrench");
  return {external->n, external->link, external->wrench->at, axes_of(external->axes)};
}

template <class S> void require_large_rows(const rows_view<S> &rows, std::size_t n, std::ptrdiff_t columns,
                                           const char *name) {
  if (!rows.first || n == 0)
    return;
  // bytes = ((n − 1) |stride| + columns) · size of a number, of which each step may be beyond 2⁶⁴
  std::size_t numbers = 0, bytes = 0;
  const std::size_t apart =
      rows.stride < 0 ? -static_cast<std::size_t>(rows.stride) : static_cast<std::size_t>(rows.stride);
  const bool beyond = __builtin_mul_overflow(n - 1, apart, &numbers) ||
                      __builtin_add_overflow(numbers, static_cast<std::size_t>(columns), &numbers) ||
                      __builtin_mul_overflow(numbers, sizeof(S), &bytes) ||
                      bytes > static_cast<std::size_t>(PTRDIFF_MAX);
  if (n > static_cast<std::size_t>(PTRDIFF_MAX) || beyond)
    throw bad_argument("n is " + std::to_string(n) + ": so many rows of " + name + " don't fit into any memory");
}

/// Values of enumerations are checked before they are cast: C passes any int.
reaction_request request_of(const ksl_model_t *m, int *links, const joints_argument &asked) {
  const auto [n, joints, options] = asked;
  const int of_tree = ksl_model_joints(m), all = of_tree + static_cast<int>(m->model.loops().size());
  require(n >= 0 && n <= all && (joints || n == 0), "n must be between 0 and the number of joints");
  for (int k = 0; k < n; ++k) {
    require_index(joints[k], all, "a joint is out of range", "joints", k);
    links[k] = joints[k] < of_tree ? m->model.joints()[static_cast<std::size_t>(joints[k])].link
                                   : static_cast<int>(m->model.links().size()) + joints[k] - of_tree;
  }
  reaction_request r;
  r.n = n;
  r.link = links;
  if (options) {
    const auto known = [](int value, int last) { return value >= 0 && value <= last; };
    require(known(options->part, KSL_COUPLING) && known(options->on, KSL_ON_PARENT) && known(options->at, KSL_LINK) &&
                known(options->axes, KSL_LINK) && known(options->order, KSL_ANGULAR_FIRST),
            "part, on, at, axes and order must be values of their enumerations");
    r.part = static_cast<wrench_part>(options->part);
    r.on = static_cast<wrench_side>(options->on);
    r.at = frame_of(m, options->at, options->at_link, "at_link");
    r.at_link = options->at_link;
    require_finite(options->offset, 3, "offset");
    for (int i = 0; i < 3; ++i)
      r.offset[i] = options->offset[i];
    r.axes = frame_of(m, options->axes, options->axes_link, "axes_link");
    r.axes_link = options->axes_link;
    r.angular_first = options->order == KSL_ANGULAR_FIRST;
  }
  return r;
}

frame_options frame_options_of(const ksl_frame_options_t *options) {
  if (!options)
    return {};
  const auto known = [](int value) { return value == 0 || value == 1; };
  require(known(options->axes) && known(options->at) && known(options->order),
          "axes, at and order must be values of their enumerations");
  require(options->kind >= KSL_SPATIAL && options->kind <= KSL_RATE, "kind must be a value of its enumeration");
  require_finite(options->offset, 3, "offset");
  return {static_cast<expressed_in>(options->axes),
          static_cast<expressed_in>(options->at),
          options->order == KSL_ANGULAR_FIRST,
          static_cast<acceleration_kind>(options->kind),
          {options->offset[0], options->offset[1], options->offset[2]}};
}

namespace {

/// What a call for a batch makes of its arguments, in memory that the thread keeps.
template <class S> struct batch_arguments {
  int *links = nullptr;
  external_rows<S> *exerted = nullptr;

  void lay_out(int joints, int external_n) {
    // laid out twice: to learn how much it is, and in the memory then
    arena measure;
    lay_out(measure, joints, external_n);
    arena memory(thread_memory(kept_for::arguments, measure.used()));
    lay_out(memory, joints, external_n);
  }

private:
  void lay_out(arena &memory, int joints, int external_n) {
    links = memory.take<int>(joints), exerted = memory.take<external_rows<S>>(external_n);
  }
};

/// Checks that all inputs and results of a batch that isn't empty are there, and that their rows can lie in memory.
template <class S>
/// Of each input and result its extent in memory; then, of results, that their own rows are apart, and that they are apart from all that is read.
void require_arrays(const algorithm_row &row, const model &m, const batch_view<S> &batch, int joints_n,
                    const rows_view<S> &wrenches) {
  for (int i = 0; i < row.inputs; ++i) {
    const input x = row.input_list[i];
    require(input_of(batch, x).first, "model and arrays must not be null");
    require_rows(input_of(batch, x), batch.n, length_of(x, m.nq(), m.nv()), row.input_name[i]);
  }
  for (int r = 0; r < row.results; ++r) {
    const std::ptrdiff_t numbers = numbers_of(row.result[r], extents_of(m, batch));
    require_result(batch.result[r].first, numbers, row.result[r].name);
    require_rows(batch.result[r], batch.n, numbers, row.result[r].name);
    check_stride(batch.result[r], numbers, batch.n, row.result[r].name, refuse_argument);
  }
  const bool reactions = row.request == request_kind::reactions;
  const std::ptrdiff_t numbers = reactions ? 6 * static_cast<std::ptrdiff_t>(joints_n) : 0;
  if (reactions) {
    require_result(wrenches.first, joints_n, "wrenches");
    require_rows(wrenches, batch.n, numbers, "wrenches");
    check_stride(wrenches, numbers, batch.n, "wrenches", refuse_argument);
  }
  for (int e = 0; e < batch.external_n; ++e)
    require_rows(batch.external[e].wrench, batch.n, 6, "external wrenches");
  require_apart(row, m, batch, batch.n, wrenches, numbers);
}

} // namespace

template <class S>
ksl_status_t batch_call(const algorithm_row &row, const ksl_model_t *m, batch_view<S> batch,
                        const typename c_types<S>::external_of_batch *external, int threads,
                        const ksl_frame_options_t *frame, const joints_argument &joints, const rows_view<S> &wrenches) {
  return guarded([&] {
    require(m, "model and arrays must not be null");
    require_model_for(row, m->model);
    batch.frame = frame_options_of(frame);
    if (names_links(row.request))
      require_links(m, batch.links.n, batch.links.index);
    check_links(row, m->model, names_links(row.request) ? batch.links.n : 0, batch.links.index, refuse_argument);
    require(may_name_links(row, m->model, batch.links.n), "links: at most as many as the model has");
    require(threads >= 0, "threads must not be negative; 0 is all cores that the process may use");
    const bool any = batch.n > 0;
    if (external) // an empty batch needs no wrenches: anything but null stands for them
      require_external(m, external->n, external->link, any ? static_cast<const void *>(external->wrench) : "");
    // The order of checks: the model and the row; links, before extents are taken from their number; wrenches and joints; arrays, whose extents are
    // known then.
    // the thread keeps memory for arguments and for workspaces apart: compute_batch uses the latter while these are read
    batch_arguments<S> arguments;
    const bool of_joints = row.request == request_kind::joints || row.request == request_kind::reactions;
    if (of_joints || external)
      arguments.lay_out(ksl_model_joints(m), external ? external->n : 0);
    reaction_request request;
    if (of_joints)
      request = request_of(m, arguments.links, joints);
    if (row.request == request_kind::joints)
      batch.joints = &request;
    if (external) {
      for (int e = 0; e < external->n; ++e)
        arguments.exerted[e] = {external->link[e], {external->wrench + 6 * e, external->stride}};
      batch.external_n = external->n, batch.external = arguments.exerted, batch.external_axes = axes_of(external->axes);
    }
    if (any)
      require_arrays(row, m->model, batch, joints.n, wrenches);
    reaction_rows<S> wanted;
    if (row.request == request_kind::reactions) {
      wanted = {request, wrenches};
      batch.reactions_n = 1, batch.reactions = &wanted;
    }
    compute_batch(row, m->model, batch, threads);
  }); // NOLINT(clang-analyzer-core.StackAddressEscape): nobody reads the batch afterwards
}

#define KSL_INSTANTIATE(S)                                                                                             \
  template void require_position(const model &, const S *, const char *);                                              \
  template void require_finite(const S *, int, const char *);                                                          \
  template void require_large_rows(const rows_view<S> &, std::size_t, std::ptrdiff_t, const char *);                   \
  template void require_large_rows(const rows_view<const S> &, std::size_t, std::ptrdiff_t, const char *);             \
  template external_wrenches<S> external_of(const ksl_model_t *, const c_types<S>::external *);                        \
  template ksl_status_t batch_call(const algorithm_row &, const ksl_model_t *, batch_view<S>,                          \
                                   const c_types<S>::external_of_batch *, int, const ksl_frame_options_t *,            \
                                   const joints_argument &, const rows_view<S> &);
KSL_INSTANTIATE(double)
KSL_INSTANTIATE(float)
#undef KSL_INSTANTIATE

} // namespace ksl::c_api
