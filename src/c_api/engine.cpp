// The C face of models and of single states.
#include "c_api/handles.hpp"

#include <cmath>

namespace {

using ksl::c_api::bad_argument;
using ksl::c_api::guarded;
using ksl::c_api::require;
using ksl::c_api::require_links;

void require_finite(const double *x, int n, const char *name) {
  require(x || n == 0, "q, v, a, tau and other arrays must not be null");
  for (int i = 0; i < n; ++i)
    if (!std::isfinite(x[i]))
      throw bad_argument(std::string(name) + "[" + std::to_string(i) + "] is not a finite number");
}

/// Finite, and quaternions of unit length to a thousandth.
void require_position(const ksl_model_t *m, const double *q) {
  require_finite(q, ksl_model_nq(m), "q");
  for (int i = 0; i < m->model.moving_joints(); ++i) {
    const ksl::joint_row &j = m->model.joints()[static_cast<std::size_t>(i)];
    const int quaternion = ksl::row_of(j.kind).quaternion;
    if (quaternion < 0)
      continue;
    const double *x = q + j.q_index + quaternion;
    if (std::fabs(std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]) - 1) > 1e-3)
      throw bad_argument("q: the quaternion [qx qy qz qw] of " + j.name + " is not of unit length");
  }
}

ksl::external_wrenches<double> external_of(const ksl_model_t *m, const ksl_external_t *external) {
  if (!external || external->n == 0)
    return {};
  require(external->n > 0 && external->link && external->wrench, "external needs n links and n wrenches");
  for (int k = 0; k < external->n; ++k)
    require(external->link[k] >= 0 && external->link[k] < ksl_model_links(m), "external names a link out of range");
  require_finite(external->wrench->at, 6 * external->n, "external wrench");
  return {external->n, external->link, external->wrench->at};
}

ksl::wrench_frame frame_of(const ksl_model_t *m, ksl_frame_t frame, int link) {
  require(frame != KSL_LINK || (link >= 0 && link < ksl_model_links(m)), "at_link or axes_link is out of range");
  return static_cast<ksl::wrench_frame>(frame);
}

ksl::reaction_request request_of(const ksl_model_t *m, ksl_data_t *d, int n, const int *joints,
                                 const ksl_reaction_options_t *options) {
  require(n >= 0 && n <= ksl_model_joints(m) && (joints || n == 0), "n must be between 0 and the number of joints");
  for (int k = 0; k < n; ++k) {
    require(joints[k] >= 0 && joints[k] < ksl_model_joints(m), "a joint is out of range");
    d->links[static_cast<std::size_t>(k)] = m->model.joints()[static_cast<std::size_t>(joints[k])].link;
  }
  ksl::reaction_request r;
  r.n = n;
  r.link = d->links.data();
  if (options) {
    const auto known = [](int value, int last) { return value >= 0 && value <= last; };
    require(known(options->part, KSL_ACTUATION) && known(options->on, KSL_ON_PARENT) && known(options->at, KSL_LINK) &&
                known(options->axes, KSL_LINK) && known(options->order, KSL_ANGULAR_FIRST),
            "part, on, at, axes and order must be values of their enumerations");
    r.part = static_cast<ksl::wrench_part>(options->part);
    r.on = static_cast<ksl::wrench_side>(options->on);
    r.at = frame_of(m, options->at, options->at_link);
    r.at_link = options->at_link;
    require_finite(options->offset, 3, "offset");
    for (int i = 0; i < 3; ++i)
      r.offset[i] = options->offset[i];
    r.axes = frame_of(m, options->axes, options->axes_link);
    r.axes_link = options->axes_link;
    r.angular_first = options->order == KSL_ANGULAR_FIRST;
  }
  return r;
}

/// The i-th of some lines, or null.
const char *line(const std::vector<std::string> &lines, int i) {
  return i >= 0 && static_cast<std::size_t>(i) < lines.size() ? lines[static_cast<std::size_t>(i)].c_str() : nullptr;
}

/// A workspace made for this model.
void require_workspace(const ksl_model_t *m, const ksl_data_t *d) {
  require(m && d, "model and data must not be null");
  require(d->model == m, "this workspace was made for another model; make one with ksl_data_create for each model");
}

void require_inverse_dynamics(const ksl_model_t *m, const ksl_data_t *d, const double *q, const double *v, const double *a,
                              const double *tau) {
  require_workspace(m, d);
  require(tau, "tau must not be null");
  require_position(m, q);
  require_finite(v, ksl_model_nv(m), "v");
  require_finite(a, ksl_model_nv(m), "a");
}

} // namespace

extern "C" {

const char *ksl_error_message(void) { return ksl::c_api::last_message().c_str(); }

const char *ksl_instruction_set(void) {
  const char *name = nullptr;
  guarded([&] { name = ksl::instruction_set(); });
  return name;
}

ksl_model_options_t ksl_model_options(void) { return {false, false, false, false, {0, 0, -9.81}}; }

ksl_status_t ksl_model_load(const char *urdf_path, const ksl_model_options_t *options, ksl_model_t **model) {
  return guarded([&] {
    require(urdf_path && model, "path and model must not be null");
    *model = nullptr;
    const ksl_model_options_t o = options ? *options : ksl_model_options();
    require_finite(o.gravity, 3, "gravity");
    ksl::model_options how;
    how.floating_base = o.floating_base;
    how.gravity = {o.gravity[0], o.gravity[1], o.gravity[2]};
    *model = new ksl_model_t{ksl::load(urdf_path, how, o.mimic_independent, o.strict, o.masses_optional)};
  });
}

void ksl_model_free(ksl_model_t *model) { delete model; }

ksl_status_t ksl_data_create(const ksl_model_t *model, ksl_data_t **data) {
  return guarded([&] {
    require(model && data, "model and data must not be null");
    *data = new ksl_data_t{model, ksl::data(model->model), false, std::vector<int>(model->model.joints().size())};
  });
}

void ksl_data_free(ksl_data_t *data) { delete data; }

int ksl_model_nq(const ksl_model_t *m) { return m ? m->model.nq() : 0; }
int ksl_model_nv(const ksl_model_t *m) { return m ? m->model.nv() : 0; }
int ksl_model_moving_joints(const ksl_model_t *m) { return m ? m->model.moving_joints() : 0; }
int ksl_model_joints(const ksl_model_t *m) { return m ? static_cast<int>(m->model.joints().size()) : 0; }
int ksl_model_links(const ksl_model_t *m) { return m ? static_cast<int>(m->model.links().size()) : 0; }

const char *ksl_model_joint_name(const ksl_model_t *m, int joint) {
  return joint < 0 || joint >= ksl_model_joints(m) ? nullptr
                                                   : m->model.joints()[static_cast<std::size_t>(joint)].name.c_str();
}

const char *ksl_model_link_name(const ksl_model_t *m, int link) {
  return link < 0 || link >= ksl_model_links(m) ? nullptr : m->model.links()[static_cast<std::size_t>(link)].name.c_str();
}

int ksl_model_joint(const ksl_model_t *m, const char *name) { return m && name ? m->model.find_joint(name) : -1; }
int ksl_model_link(const ksl_model_t *m, const char *name) { return m && name ? m->model.find_link(name) : -1; }

const char *ksl_model_warning(const ksl_model_t *m, int i) { return m ? line(m->model.description().warnings, i) : nullptr; }
const char *ksl_model_unused(const ksl_model_t *m, int i) { return m ? line(m->model.description().unused, i) : nullptr; }

ksl_status_t ksl_inverse_dynamics(const ksl_model_t *m, ksl_data_t *d, const double *q, const double *v, const double *a,
                                  const ksl_external_t *external, double *tau) {
  return guarded([&] {
    require_inverse_dynamics(m, d, q, v, a, tau);
    const ksl::external_wrenches<double> wrenches = external_of(m, external);
    ksl::inverse_dynamics(m->model, d->data, q, v, a, tau, wrenches);
    d->holds_wrenches = true;
  });
}

ksl_status_t ksl_forward_dynamics(const ksl_model_t *m, ksl_data_t *d, const double *q, const double *v,
                                  const double *tau, const ksl_external_t *external, double *a) {
  return guarded([&] {
    require_workspace(m, d);
    require(a, "a must not be null");
    require_position(m, q);
    require_finite(v, ksl_model_nv(m), "v");
    require_finite(tau, ksl_model_nv(m), "tau");
    const ksl::external_wrenches<double> wrenches = external_of(m, external);
    d->holds_wrenches = false;
    ksl::forward_dynamics(m->model, d->data, q, v, tau, a, wrenches);
  });
}

ksl_status_t ksl_mass_matrix(const ksl_model_t *m, ksl_data_t *d, const double *q, double *M) {
  return guarded([&] {
    require_workspace(m, d);
    require(M, "M must not be null");
    require_position(m, q);
    d->holds_wrenches = false;
    ksl::mass_matrix(m->model, d->data, q, M);
  });
}

ksl_status_t ksl_bias(const ksl_model_t *m, ksl_data_t *d, const double *q, const double *v,
                      const ksl_external_t *external, double *tau) {
  return guarded([&] {
    require_workspace(m, d);
    require(tau, "tau must not be null");
    require_position(m, q);
    require_finite(v, ksl_model_nv(m), "v");
    const ksl::external_wrenches<double> wrenches = external_of(m, external);
    d->holds_wrenches = false;
    ksl::bias(m->model, d->data, q, v, tau, wrenches);
  });
}

ksl_status_t ksl_gravity_torque(const ksl_model_t *m, ksl_data_t *d, const double *q, const ksl_external_t *external,
                                double *tau) {
  return guarded([&] {
    require_workspace(m, d);
    require(tau, "tau must not be null");
    require_position(m, q);
    const ksl::external_wrenches<double> wrenches = external_of(m, external);
    d->holds_wrenches = false;
    ksl::gravity_torque(m->model, d->data, q, tau, wrenches);
  });
}

ksl_status_t ksl_reactions(const ksl_model_t *m, ksl_data_t *d, int n, const int *joints,
                           const ksl_reaction_options_t *options, const ksl_external_t *external, double *wrenches) {
  return guarded([&] {
    require_workspace(m, d);
    require(wrenches || n == 0, "wrenches must not be null");
    require(d->holds_wrenches, "ksl_reactions reads what ksl_inverse_dynamics left in the workspace; call that first");
    ksl::reactions(m->model, d->data, request_of(m, d, n, joints, options), wrenches, external_of(m, external));
  });
}

ksl_status_t ksl_inverse_dynamics_with_reactions(const ksl_model_t *m, ksl_data_t *d, const double *q, const double *v,
                                                 const double *a, const ksl_external_t *external, double *tau, int n,
                                                 const int *joints, const ksl_reaction_options_t *options, double *wrenches) {
  return guarded([&] {
    require_inverse_dynamics(m, d, q, v, a, tau);
    require(wrenches || n == 0, "wrenches must not be null");
    const ksl::external_wrenches<double> exerted = external_of(m, external);
    const ksl::reaction_request request = request_of(m, d, n, joints, options);
    ksl::inverse_dynamics_with_reactions(m->model, d->data, q, v, a, tau, request, wrenches, exerted);
    d->holds_wrenches = true;
  });
}

ksl_status_t ksl_frame_pose(const ksl_model_t *m, ksl_data_t *d, const double *q, int link, ksl_SE3_t *pose) {
  return guarded([&] {
    require_workspace(m, d);
    require(pose, "pose must not be null");
    require(link >= 0 && link < ksl_model_links(m), "link is out of range");
    require_position(m, q);
    d->holds_wrenches = false;
    *pose = ksl::same_layout<ksl_SE3_t>(ksl::frame_pose(m->model, d->data, q, link));
  });
}

ksl_status_t ksl_frame_poses(const ksl_model_t *m, ksl_data_t *d, const double *q, int n, const int *links, double *poses) {
  return guarded([&] {
    require_workspace(m, d);
    require(poses || n == 0, "poses must not be null");
    require_links(m, n, links);
    require_position(m, q);
    d->holds_wrenches = false;
    ksl::frame_poses(m->model, d->data, q, n, links, poses);
  });
}

ksl_status_t ksl_energy(const ksl_model_t *m, ksl_data_t *d, const double *q, const double *v, double *kinetic,
                        double *potential) {
  return guarded([&] {
    require_workspace(m, d);
    require(kinetic && potential, "results must not be null");
    require_position(m, q);
    require_finite(v, ksl_model_nv(m), "v");
    d->holds_wrenches = false;
    ksl::energy(m->model, d->data, q, v, kinetic, potential);
  });
}

} // extern "C"
