// Closed mechanisms from C.
//
// A workspace serves these calls as memory only, and they write over wrenches that inverse dynamics has left in it.  A model without loops has no
// rows: results of no numbers may be null.  Calls that have no meaning for a tree refuse one, and name that for trees.
#include "ksl/engine_loops.h"

#include "c_api/calls.hpp"
#include "engine/states/thread_memory.hpp"
#include "ksl/force_elements.hpp"
#include "ksl/loops.hpp"

namespace ksl::c_api {
namespace {

/// Runs a call about a position, in a workspace that holds no wrenches afterwards.
template <class Call> ksl_status_t at_position(const ksl_model_t *m, ksl_data_t *d, const double *q, bool has_results,
                                               Call call) {
  return guarded([&] {
    last_warning()[0] = '\0';
    require_workspace(m, d);
    require(q && has_results, "q and the results must not be null");
    require_position(m->model, q, "q");
    d->holds_wrenches = 0;
    call(m->model, d->data);
  });
}

/// Flags of coordinates in memory of the thread; none if they are null.
/// bool of C may have any size; null stands for no flag.
const unsigned char *flags_of(const model &m, const bool *given) {
  const std::size_t nv = static_cast<std::size_t>(m.nv());
  unsigned char *const flags = reinterpret_cast<unsigned char *>(thread_memory(kept_for::arguments, nv));
  for (std::size_t i = 0; i < nv; ++i)
    flags[i] = given && given[i];
  return flags;
}

/// Where coordinates leave freedoms the nearest motion is an answer, too; only contradictory ones have none.
void judge(completion how, const char *what) {
  if (how == completion::contradictory)
    throw bad_argument(std::string("no motion of the closed mechanism has these ") + what +
                       "; give fewer coordinates, those of the drives say");
}

} // namespace
} // namespace ksl::c_api

using namespace ksl::c_api;

extern "C" {

int ksl_model_loops(const ksl_model_t *m) { return m ? static_cast<int>(m->model.loops().size()) : 0; }
int ksl_model_loop_rows(const ksl_model_t *m) { return m ? ksl::loop_rows(m->model) : 0; }
const char *ksl_model_loop_name(const ksl_model_t *m, int loop) {
  return loop >= 0 && loop < ksl_model_loops(m) ? m->model.loops()[static_cast<std::size_t>(loop)].name.c_str()
                                                : nullptr;
}

int ksl_model_force_elements(const ksl_model_t *m) {
  return m ? static_cast<int>(m->model.force_elements().size()) : 0;
}
const char *ksl_model_force_element_name(const ksl_model_t *m, int element) {
  return element >= 0 && element < ksl_model_force_elements(m)
             ? m->model.force_elements()[static_cast<std::size_t>(element)].name.c_str()
             : nullptr;
}

ksl_status_t ksl_force_element_states(const ksl_model_t *m, const double *q, const double *v, double *length,
                                      double *rate, double *tension) {
  return guarded([&] {
    last_warning()[0] = '\0';
    require(m && q && length && rate && tension, "model, q and the results must not be null");
    require_position(m->model, q, "q");
    if (v)
      require_finite(v, m->model.nv(), "v");
    ksl::force_element_states(m->model, q, v, length, rate, tension);
  });
}

ksl_status_t ksl_loop_error(const ksl_model_t *m, ksl_data_t *d, const double *q, double *error) {
  return at_position(m, d, q, error || ksl_model_loop_rows(m) == 0,
                     [&](const ksl::model &model, ksl::data &data) { ksl::loop_error(model, data, q, error); });
}

ksl_status_t ksl_loop_jacobian(const ksl_model_t *m, ksl_data_t *d, const double *q, double *J) {
  return at_position(m, d, q, J || ksl_model_loop_rows(m) == 0,
                     [&](const ksl::model &model, ksl::data &data) { ksl::loop_jacobian(model, data, q, J); });
}

ksl_status_t ksl_loop_acceleration(const ksl_model_t *m, ksl_data_t *d, const double *q, const double *v,
                                   const double *a, double *acceleration) {
  return at_position(m, d, q, v && a && (acceleration || ksl_model_loop_rows(m) == 0),
                     [&](const ksl::model &model, ksl::data &data) {
                       require_finite(v, model.nv(), "v");
                       require_finite(a, model.nv(), "a");
                       ksl::loop_acceleration(model, data, q, v, a, acceleration);
                     });
}

ksl_status_t ksl_mobility(const ksl_model_t *m, ksl_data_t *d, const double *q, ksl_mobility_t *mobility,
                          int *redundant_rows) {
  return at_position(m, d, q, mobility != nullptr, [&](const ksl::model &model, ksl::data &data) {
    const ksl::loop_mobility found = ksl::mobility(model, data, q, redundant_rows);
    *mobility = {found.mobility, found.rank, found.redundant, found.smallest, found.next, found.length};
  });
}

ksl_status_t ksl_independent(const ksl_model_t *m, ksl_data_t *d, const double *q, int *indices, int *n) {
  return at_position(m, d, q, indices && n,
                     [&](const ksl::model &model, ksl::data &data) { *n = ksl::independent(model, data, q, indices); });
}

// That there is no closed position nearby is an answer, not a failure of the call: `closed` is then the one that is least open.
ksl_status_t ksl_close(const ksl_model_t *m, ksl_data_t *d, const double *q, const bool *hold, bool limits,
                       double *closed, ksl_closing_t *end, double *error) {
  return at_position(m, d, q, closed && end, [&](const ksl::model &model, ksl::data &data) {
    double left = 0;
    ksl::close_options options;
    options.limits = limits;
    const ksl::closing how = ksl::close(model, data, q, flags_of(model, hold), options, closed, &left);
    *end = static_cast<ksl_closing_t>(how);
    if (error)
      *error = left;
  });
}

ksl_status_t ksl_consistent_velocity(const ksl_model_t *m, ksl_data_t *d, const double *q, const double *v,
                                     const bool *given, double *out) {
  return at_position(m, d, q, v && given && out, [&](const ksl::model &model, ksl::data &data) {
    require_finite(v, model.nv(), "v");
    judge(ksl::consistent_velocity(model, data, q, v, flags_of(model, given), out), "velocities");
  });
}

ksl_status_t ksl_consistent_acceleration(const ksl_model_t *m, ksl_data_t *d, const double *q, const double *v,
                                         const double *a, const bool *given, double *out) {
  return at_position(m, d, q, v && a && given && out, [&](const ksl::model &model, ksl::data &data) {
    require_finite(v, model.nv(), "v");
    require_finite(a, model.nv(), "a");
    judge(ksl::consistent_acceleration(model, data, q, v, a, flags_of(model, given), out), "accelerations");
  });
}

ksl_status_t ksl_reaction_patterns(const ksl_model_t *m, ksl_data_t *d, const double *q, double *patterns, int *n) {
  return at_position(
      m, d, q, n && (patterns || ksl_model_loop_rows(m) == 0),
      [&](const ksl::model &model, ksl::data &data) { *n = ksl::reaction_patterns(model, data, q, patterns); });
}

// Widths of these arrays are freedoms of the position, which ksl_independent counts before.
ksl_status_t ksl_closed_inverse_dynamics_derivatives(const ksl_model_t *m, ksl_data_t *d, const double *q,
                                                     const double *v, const double *a, const ksl_external_t *external,
                                                     double *by_q, double *by_v, double *by_a) {
  return at_position(m, d, q, v && a && by_q && by_v && by_a, [&](const ksl::model &model, ksl::data &data) {
    require(!model.loops().empty(), "the model has no loops; ksl_inverse_dynamics_derivatives is for trees");
    require_finite(v, model.nv(), "v");
    require_finite(a, model.nv(), "a");
    ksl::closed_inverse_dynamics_derivatives(model, data, q, v, a, external_of<double>(m, external), by_q, by_v, by_a);
  });
}

ksl_status_t ksl_closed_forward_dynamics_derivatives(const ksl_model_t *m, ksl_data_t *d, const double *q,
                                                     const double *v, const double *tau, const ksl_external_t *external,
                                                     double *by_q, double *by_v, double *by_tau) {
  return at_position(m, d, q, v && tau && by_q && by_v && by_tau, [&](const ksl::model &model, ksl::data &data) {
    require(!model.loops().empty(), "the model has no loops; ksl_forward_dynamics_derivatives is for trees");
    require_finite(v, model.nv(), "v");
    require_finite(tau, model.nv(), "tau");
    ksl::closed_forward_dynamics_derivatives(model, data, q, v, tau, external_of<double>(m, external), by_q, by_v,
                                             by_tau);
  });
}

ksl_status_t ksl_closed_reaction_variations(const ksl_model_t *m, ksl_data_t *d, const double *q, const double *v,
                                            const double *a, const ksl_external_t *external, double *motions,
                                            double *on_links, double *at_joints, double *wrenches) {
  const bool all = v && a && motions && on_links && at_joints && wrenches;
  return at_position(m, d, q, all, [&](const ksl::model &model, ksl::data &data) {
    require(!model.loops().empty(), "the model has no loops; ksl_reactions_derivatives is for trees");
    require_finite(v, model.nv(), "v");
    require_finite(a, model.nv(), "a");
    ksl::closed_reaction_variations(model, data, q, v, a, external_of<double>(m, external), motions, on_links,
                                    at_joints, wrenches);
  });
}

ksl_status_t ksl_stabilised_forward_dynamics(const ksl_model_t *m, ksl_data_t *d, const double *q, const double *v,
                                             const double *tau, const ksl_external_t *external, double alpha,
                                             double beta, double *a) {
  return at_position(m, d, q, v && tau && a, [&](const ksl::model &model, ksl::data &data) {
    require(!model.loops().empty(), "the model has no loops; ksl_forward_dynamics is for trees");
    require(alpha >= 0 && beta >= 0 && std::isfinite(alpha) && std::isfinite(beta),
            "gains are not finite and 0 or more; give alpha and beta in 1/s");
    require_finite(v, model.nv(), "v");
    require_finite(tau, model.nv(), "tau");
    ksl::stabilised_forward_dynamics(model, data, q, v, tau, external_of<double>(m, external), {alpha, beta}, a);
  });
}

} // extern "C"
